"""Films of mixed quality for `chainage archive`: rendered, with rules; some are broken."""

from __future__ import annotations

import json
import shutil
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

from builders import half_size

from app.lab.simulation import SCENARIOS, simulate
from vo_core import Rig

QUALITIES = (
    "nominal", "dim", "low_texture", "burnt_in_text", "dirty_lens", "blur", "fast", "flicker",
    "low_bit_rate", "turned_camera", "silt", "forward",
)  # fmt: skip
BROKEN_EVERY = 20
"""Every so many films one breaks off in its middle, and the next one is no film."""


def make_films(folder: Path, count: int, length_mm: float, *, workers: int = 2) -> Path:
    """Render films into `<folder>/<quality>/C-<number>.mp4`; return the file of their rules."""
    folder.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(workers) as pool:
        list(pool.map(partial(_render, folder, length_mm), range(count)))
    for number in range(BROKEN_EVERY, count, BROKEN_EVERY):
        path = film_of(folder, number)
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        film_of(folder, number + 1).write_text("This is no film.")
    rules = folder.with_suffix(".rules.json")
    stated = {
        "rigs": {quality: half_size(SCENARIOS[quality].rig) for quality in QUALITIES},
        "rules": [
            {"name": quality, "pattern": f"{quality}/{{asset}}.*", "rig": quality}
            for quality in QUALITIES
        ],
    }
    rules.write_text(json.dumps(stated))
    return rules


def film_of(folder: Path, number: int) -> Path:
    """Return the path of a film."""
    return folder / QUALITIES[number % len(QUALITIES)] / f"C-{number:05d}.mp4"


def _render(folder: Path, length_mm: float, number: int) -> None:
    path = film_of(folder, number)
    if path.exists():
        return
    scenario = SCENARIOS[QUALITIES[number % len(QUALITIES)]]
    small = Rig.parse(half_size(scenario.rig))
    own = replace(scenario, rig=small, seed=1000 + number, length_mm=length_mm)
    path.parent.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as made:
        simulate(own, Path(made))
        shutil.move(Path(made, "video.mp4"), path)
