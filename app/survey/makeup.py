"""What an interval is made of, and what would shrink it most, for people who can do it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.survey.adjustment import Adjusted
from app.survey.interval import U95, half_width_m
from vo_core import Track
from vo_core.errors import InvalidCorrection, InvalidRig
from vo_core.geometry.height import scale_effects
from vo_core.scale.interval import TAPED_MM, IntervalParts, interval_parts

PartName = Literal[
    "tracking", "height", "focal", "diameter", "tilt", "joints", "segment", "change", "tape"
]
NAMES: tuple[PartName, ...] = (
    "tracking", "height", "focal", "diameter", "tilt", "joints", "segment", "change", "tape",
)  # fmt: skip

_LEAST_SHARE = 0.01
"""Of the variance; what is less changes nothing that anybody sees."""
_WORTH_IT = 0.8
"""A tape is worth its while if the interval becomes so many times as wide."""


@dataclass(frozen=True)
class Part:
    """One cause of an interval."""

    name: PartName
    half_width_m: float
    """95 %, if there were no other; they add up in quadrature."""


@dataclass(frozen=True)
class Taped:
    """What one more taped length would make of it."""

    length_m: float
    half_width_m: float


@dataclass(frozen=True)
class Makeup:
    """The interval of the distance of a frame."""

    frame: int
    distance_m: float
    half_width_m: float
    parts: tuple[Part, ...]
    """The largest first."""
    taped: Taped | None
    """None if a tape would not help much; then the first of the parts is what to work on."""


def makeup_of(adjusted: Adjusted, raw: Track, frame: int) -> Makeup | None:
    """What the interval of a frame is made of.

    Args:
        adjusted: By what the track is corrected.
        raw: As far as it is now, perhaps further than `adjusted`.
        frame: Of `raw`.
    Returns:
        None where nobody knows the interval: another program has measured.
    """
    if adjusted.scale_sigma is None or not 0 <= frame < len(raw):
        return None
    zero = adjusted.zero.frame if adjusted.zero else None
    try:
        parts = interval_parts(
            raw, scale_effects(adjusted.rig), adjusted.measured, frame, zero_frame=zero
        )
    except (InvalidCorrection, InvalidRig):  # such as rows that came since and do not fit
        return None
    named = [(name, float(getattr(parts, f"{name}_mm"))) for name in NAMES]
    seen = [
        Part(name, round(U95 * sigma_mm / 1000, 4))
        for name, sigma_mm in named
        if sigma_mm**2 >= _LEAST_SHARE * parts.sigma_mm**2 and sigma_mm > 0
    ]
    return Makeup(
        frame=frame,
        distance_m=round(float(adjusted.extended(raw).distance_mm[frame]) / 1000, 4),
        half_width_m=half_width_m(parts.sigma_mm),
        parts=tuple(sorted(seen, key=lambda part: -part.half_width_m)),
        taped=_taped(raw, parts),
    )


def _taped(raw: Track, parts: IntervalParts) -> Taped | None:
    way_mm = float(abs(raw.distance_mm - raw.distance_mm[0]).max())
    taped_m, now_m = half_width_m(parts.taped_mm), half_width_m(parts.sigma_mm)
    if taped_m > _WORTH_IT * now_m:
        return None
    return Taped(round(min(way_mm, TAPED_MM) / 1000, 1), taped_m)
