"""Rendered films that tests share: each scenario is rendered once and kept on disk.

A film fits one scenario, one state of the renderer's code, one version of numpy and OpenCV, and
what OpenCV uses of the processor; if one of them changes, the film is rendered again.  So two test
processes, and the next run of the tests, get the same pictures to the bit without rendering them.
Tests of the renderer call it.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from builders import half_size
from locks import alone

from app.lab.simulation import RenderedFrame, Scenario, render
from vo_core import Rig

ROOT = Path(__file__).parent.parent
FILMS = ROOT / ".films"
RENDERER = (
    "app/lab/simulation/*.py",
    "vo_core/rig.py",
    "vo_core/types.py",
    "vo_core/geometry/wall.py",
)
"""The code that determines the pictures."""

POSE = [field.name for field in fields(RenderedFrame) if field.name not in ("index", "image")]


def film(scenario: Scenario) -> list[RenderedFrame]:
    """Return all frames of a scenario, rendered by the first test that asks for them."""
    folder = FILMS / _renderer()
    file = folder / f"{hashlib.sha256(repr(scenario).encode()).hexdigest()[:24]}.npz"
    with alone(file.with_suffix(".lock")):
        if not file.exists():
            _keep(file, list(render(scenario)))
    return _read(file)


def half_sized(scenario: Scenario) -> Scenario:
    """Return the scenario in pictures of half the size, which are rendered in half of the time.

    The odometry reduces pictures of the scenarios' size to that; the noise weighs twice as much.
    """
    rigs = {
        name: None if rig is None else Rig.parse(half_size(rig))
        for name, rig in (("rig", scenario.rig), ("true_rig", scenario.true_rig))
    }
    return replace(scenario, **rigs)


def _keep(file: Path, frames: list[RenderedFrame]) -> None:
    partial = file.with_suffix(f".{os.getpid()}.npz")  # complete, or not there at all
    poses = np.array([[getattr(frame, name) for name in POSE] for frame in frames])
    np.savez(partial, poses=poses, images=np.stack([frame.image for frame in frames]))
    partial.rename(file)


def _read(file: Path) -> list[RenderedFrame]:
    with np.load(file) as kept:
        poses, images = kept["poses"].tolist(), kept["images"]
    return [
        RenderedFrame(index=n, image=image, **dict(zip(POSE, pose, strict=True)))
        for n, (image, pose) in enumerate(zip(images, poses, strict=True))
    ]


@lru_cache(maxsize=1)
def _renderer() -> str:
    """Return the digest of the renderer; remove films of other versions."""
    made_by = f"{np.__version__} {cv2.__version__} {cv2.getCPUFeaturesLine()}"
    digest = hashlib.sha256(made_by.encode())
    for pattern in RENDERER:
        for path in sorted(ROOT.glob(pattern)):
            digest.update(path.read_bytes())
    name = digest.hexdigest()[:24]
    (FILMS / name).mkdir(parents=True, exist_ok=True)
    for other in FILMS.iterdir():
        if other.name != name:
            shutil.rmtree(other, ignore_errors=True)
    return name
