"""The sources of a distance's uncertainty, and what one more taped length would improve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vo_core.drift import row_of
from vo_core.geometry.height import ScaleEffects
from vo_core.scale.correction import correct, sigma_parts
from vo_core.scale.evidence import TAPE_SIGMA_MM, Evidence, KnownLength, StatedScale
from vo_core.track import Track

TAPED_MM = 5000.0
"""Length of the suggested tape; the whole way where the run is shorter."""

EXACT = 1e-9
"""Relative standard uncertainty assumed for a rig that states none."""


@dataclass(frozen=True)
class IntervalParts:
    """Standard uncertainties in mm; the parts add up in quadrature to `sigma_mm`."""

    sigma_mm: float
    """Standard uncertainty of the distance from the zero to the frame."""
    tracking_mm: float
    """Part by the registration of the pictures, and by bridged stretches."""
    height_mm: float
    """Part by the camera's height; the next three are by focal length, diameter and tilt."""
    focal_mm: float
    diameter_mm: float
    tilt_mm: float
    joints_mm: float
    """Part by the positions of the joints, and by segments that differ from each other."""
    segment_mm: float
    """Part by the stated length of a segment, the same in all."""
    change_mm: float
    """Part by a scale that changes along the run, between and beyond the joints, and by silt."""
    tape_mm: float
    """Part by taped lengths."""
    taped_mm: float
    """What `sigma_mm` would be with one more taped length: `TAPED_MM`, or the whole way where that
    is shorter.  It is no part of `sigma_mm`."""


def interval_parts(
    track: Track,
    effects: ScaleEffects,
    evidence: Sequence[Evidence],
    frame: int,
    *,
    zero_frame: int | None = None,
) -> IntervalParts:
    """Split the uncertainty of a frame's distance into its sources, and predict it with a tape.

    Args:
        track: As it was measured.
        effects: Effects of the tolerances of its rig, see `height.scale_effects`; they take some
            20 ms to compute and do not change during the run.
        evidence: Tapes and joints that correct the track; the scale of the rig is added.
        frame: The frame of the distance.
        zero_frame: The frame from which the distance is counted; by default the track's zero.
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
    """The suggested tape from the first frame, with the length that the corrected track has.

    Empty while the run is shorter than the uncertainty of a tape.
    """
    locked = track.status != "lost"
    way_mm = np.abs(corrected.distance_mm - corrected.distance_mm[0])
    last = int(np.argmin(np.where(locked, np.abs(way_mm - TAPED_MM), np.inf)))
    if not locked[0] or way_mm[last] < TAPE_SIGMA_MM:
        return []
    return [KnownLength(int(track.frame[0]), int(track.frame[last]), float(way_mm[last]))]
