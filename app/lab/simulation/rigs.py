"""Draws stated rigs that are wrong by about their tolerance."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vo_core.errors import InvalidRig
from vo_core.rig import Rig


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
