"""What the uncertainty of a distance is made of, and what would shrink it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from vo_core.rig import Rig
from vo_core.scale import Evidence
from vo_core.track import Track

TAPED_MM = 5000.0
"""Length of the tape that is suggested; the whole way where the run is shorter."""


@dataclass(frozen=True)
class IntervalParts:
    """Standard uncertainties in mm that add up in quadrature to `sigma_mm`."""

    sigma_mm: float
    """Of the distance from the zero to a frame."""
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
    tape_mm: float
    """Taped lengths."""
    taped_mm: float
    """What `sigma_mm` would become by one more taped length of `TAPED_MM`."""


def interval_parts(
    track: Track,
    rig: Rig,
    evidence: Sequence[Evidence],
    frame: int,
    *,
    zero_frame: int | None = None,
) -> IntervalParts:
    """What the interval of the distance of a frame is made of.

    Args:
        track: As it was measured.
        rig: With which it was measured.
        evidence: Tapes and joints by which the track is corrected; the rig's own scale is added.
        frame: Whose distance it is.
        zero_frame: From which the distance is counted; the zero of the track without it.
    Raises:
        InvalidCorrection: As `scale.correct` does.
    """
    raise NotImplementedError
