"""What the uncertainty of a distance is made of, and what would shrink it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vo_core.drift import row_of
from vo_core.geometry.height import ScaleEffects
from vo_core.scale.correction import (
    TAPE_SIGMA_MM,
    Evidence,
    KnownLength,
    StatedScale,
    correct,
    sigma_parts,
)
from vo_core.track import Track

TAPED_MM = 5000.0
"""Length of the tape that is suggested; the whole way where the run is shorter."""

EXACT = 1e-9
"""Relative standard uncertainty of a rig that states none."""


@dataclass(frozen=True)
class IntervalParts:
    """Standard uncertainties in mm; all but the last add up in quadrature to `sigma_mm`."""

    sigma_mm: float
    """Of the distance from the zero to the frame."""
    tracking_mm: float
    """Registration of the pictures, and stretches that were bridged."""
    height_mm: float
    """Of the camera."""
    focal_mm: float
    diameter_mm: float
    tilt_mm: float
    joints_mm: float
    """Places of the joints, and segments that differ from each other."""
    segment_mm: float
    """The stated length of a segment, alike in all."""
    change_mm: float
    """A scale that changes along the run, between the joints and beyond them, and a bed of silt."""
    tape_mm: float
    """Taped lengths."""
    taped_mm: float
    """What `sigma_mm` would become by one more taped length: `TAPED_MM`, or the whole way where
    that is shorter."""


def interval_parts(
    track: Track,
    effects: ScaleEffects,
    evidence: Sequence[Evidence],
    frame: int,
    *,
    zero_frame: int | None = None,
) -> IntervalParts:
    """What the interval of the distance of a frame is made of, and what a tape would make of it.

    Args:
        track: As it was measured.
        effects: Of the tolerances of its rig, see `height.scale_effects`; they take some 20 ms to
            work out and do not change with the run.
        evidence: Tapes and joints by which the track is corrected; the rig's own scale is added.
        frame: Whose distance it is.
        zero_frame: From which the distance is counted; the zero of the track without it.
    Raises:
        InvalidCorrection: As `scale.correct` does.
    """
    rig_sigma = max(effects.sigma, EXACT)
    known = [*evidence, StatedScale(rig_sigma)]
    parts = sigma_parts(track, known, frame, zero_frame=zero_frame)
    row = row_of(track, frame)
    corrected = correct(track, known, zero_frame=zero_frame).track
    taped = sigma_parts(track, [*known, *_tape(track, corrected)], frame, zero_frame=zero_frame)
    rig_mm = parts.get("rig", 0.0) / rig_sigma
    return IntervalParts(
        sigma_mm=float(corrected.sigma_distance_mm[row]),
        tracking_mm=parts["tracking"],
        height_mm=rig_mm * abs(effects.height),
        focal_mm=rig_mm * abs(effects.focal),
        diameter_mm=rig_mm * abs(effects.diameter),
        tilt_mm=rig_mm * effects.tilt,
        joints_mm=parts.get("joints", 0.0),
        segment_mm=parts.get("segment", 0.0),
        change_mm=parts["wander"],
        tape_mm=parts.get("tape", 0.0),
        taped_mm=float(np.linalg.norm(list(taped.values()))),
    )


def _tape(track: Track, corrected: Track) -> list[KnownLength]:
    """A tape from where the run is nearest to its beginning, with the length that it has there.

    None where the run has not gone as far as a tape is uncertain.
    """
    locked = track.status != "lost"
    way_mm = np.abs(corrected.distance_mm - corrected.distance_mm[0])
    last = int(np.argmin(np.where(locked, np.abs(way_mm - TAPED_MM), np.inf)))
    if not locked[0] or way_mm[last] < TAPE_SIGMA_MM:
        return []
    return [KnownLength(int(track.frame[0]), int(track.frame[last]), float(way_mm[last]))]
