"""Draws rigs: stated ones that are wrong by about their tolerance, and forward cameras of crews."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import copysign, cos, hypot, pi, sin

import numpy as np

from app.lab.simulation.scenario import Scenario
from vo_core.errors import InvalidRig
from vo_core.rig import Camera, Mount, Rig

_FOCAL_PX = (300.0, 700.0)
_CORNER_SHARE = (-0.15, 0.03)
"""How far distortion moves a corner of the picture from the centre, negative inwards, as a share of
its distance: a cheap wide lens to a slightly overcorrected one."""

_CENTRE_SHARE = 0.03
"""Largest distance of the principal point from the middle, in picture sizes."""

_OFFSET_MM = (5.0, 30.0)
_TILT_DEG = (1.0, 5.0)
_TURN_DEG = 3.0


def drawn_rigs(true: Rig, seed: int) -> Iterator[Rig]:
    """Yield stated rigs without end, drawn around the true one from its tolerances.

    Height, pitch, roll, focal length, diameter and the length of a segment have normal errors that
    are independent.  An impossible rig, with its camera outside the pipe, is drawn again.
    """
    rng = np.random.default_rng(seed)
    while True:
        try:
            yield _drawn(true, rng)
        except InvalidRig:
            continue


def _drawn(true: Rig, rng: np.random.Generator) -> Rig:
    tolerance = true.tolerance
    sigmas = (
        tolerance.height_mm,
        tolerance.tilt_deg,
        tolerance.tilt_deg,
        tolerance.focal_percent,
        tolerance.diameter_mm,
        tolerance.segment_length_mm,
    )
    height_mm, pitch_deg, roll_deg, focal_percent, diameter_mm, segment_mm = rng.normal(0.0, sigmas)
    fields = true.model_dump()
    fields["camera"]["fx"] *= 1 + focal_percent / 100
    fields["camera"]["fy"] *= 1 + focal_percent / 100
    fields["mount"]["height_mm"] += height_mm
    fields["mount"]["pitch_deg"] += pitch_deg
    fields["mount"]["roll_deg"] += roll_deg
    if true.pipe.diameter_mm is not None:
        fields["pipe"]["diameter_mm"] += diameter_mm
    if true.pipe.segment_length_mm is not None:
        fields["pipe"]["segment_length_mm"] += segment_mm
    return Rig.parse(fields, origin="a rig drawn from the tolerances")


def with_drawn_rig(scenario: Scenario, seed: int) -> Scenario:
    """Give a scenario with a forward pinhole another lens, mount and wall, drawn at random.

    The lens is always stated.  The mount is stated where the scenario states its own, and then it
    is not turned aside, which no rig can state.  Equal names and seeds give equal scenarios.

    Raises:
        InvalidRig: The scenario has another camera.
    """
    if (scenario.rig.mount.view, scenario.rig.camera.model) != ("forward", "pinhole"):
        raise InvalidRig(
            f"{scenario.name}: lens and mount are drawn only for a pinhole that looks forward."
        )
    rng = np.random.default_rng([seed, *scenario.name.encode()])
    camera = _drawn_lens(scenario.rig.camera, rng)
    is_stated = scenario.true_rig is None
    mount, aside_deg = _drawn_mount(scenario.rig, rng, aside=not is_stated)
    true = scenario.rig.model_copy(update={"camera": camera, "mount": mount})
    return replace(
        scenario,
        rig=true if is_stated else scenario.rig.model_copy(update={"camera": camera}),
        true_rig=None if is_stated else true,
        aside_deg=aside_deg,
        seed=seed,
    )


def _drawn_lens(camera: Camera, rng: np.random.Generator) -> Camera:
    limits = (_FOCAL_PX, _CORNER_SHARE, *((-_CENTRE_SHARE, _CENTRE_SHARE),) * 2)
    focal_px, corner_share, across, down = rng.uniform(*np.transpose(limits)).tolist()
    # A corner at the distance r, in focal lengths, without distortion, is shown at r (1 + k1 r^2).
    r = hypot(camera.width, camera.height) / 2 / focal_px / (1 + corner_share)
    fields = camera.model_dump() | {
        "fx": focal_px,
        "fy": focal_px,
        "cx": (camera.width - 1) / 2 + across * camera.width,
        "cy": (camera.height - 1) / 2 + down * camera.height,
        "distortion": [corner_share / r**2, 0.0, 0.0, 0.0],
    }
    return Camera.parse(fields, origin="a drawn lens")


def _drawn_mount(rig: Rig, rng: np.random.Generator, *, aside: bool) -> tuple[Mount, float]:
    """Draw a mount and the angle by which its camera looks aside, 0 if it must not."""
    limits = (_OFFSET_MM, _TILT_DEG, (-_TURN_DEG, _TURN_DEG), (0, 2 * pi), (0, 2 * pi))
    offset_mm, tilt_deg, turn_deg, to, towards = rng.uniform(*np.transpose(limits)).tolist()
    up, right = (cos(towards), sin(towards)) if aside else (copysign(1.0, cos(towards)), 0.0)
    fields = rig.mount.model_dump()
    fields["lateral_mm"] += offset_mm * sin(to)
    fields["height_mm"] += offset_mm * cos(to)
    fields["rotation_deg"] += turn_deg
    fields["pitch_deg"] += tilt_deg * up
    return Mount.parse(fields, origin="a drawn mount"), tilt_deg * right
