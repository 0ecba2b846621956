"""The sources of an interval, and what would reduce it most."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.survey.adjustment.adjusted_track import Adjusted
from app.survey.distances.interval import U95, half_width_m
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
"""Share of the variance below which a source is not listed: removing it changes nothing visible."""
_WORTH_IT = 0.8
"""A tape measurement is advised if it narrows the interval to this factor or less."""


@dataclass(frozen=True)
class Part:
    """One source of an interval."""

    name: PartName
    half_width_m: float
    """Half of the 95 % interval from this source alone; sources add up in quadrature."""


@dataclass(frozen=True)
class Taped:
    """The effect of one more taped length."""

    length_m: float
    half_width_m: float


@dataclass(frozen=True)
class UncertaintyBudget:
    """The interval of the distance of a frame."""

    frame: int
    distance_m: float
    half_width_m: float
    parts: tuple[Part, ...]
    """Sources, the largest first."""
    taped: Taped | None
    """None if a tape would not help much; then the first of the parts is what to improve."""


def budget_of(adjusted: Adjusted, raw: Track, frame: int) -> UncertaintyBudget | None:
    """Return the sources of the interval of a frame.

    Args:
        adjusted: The correction of the track.
        raw: The run so far, possibly longer than `adjusted`.
        frame: A row of `raw`.
    Returns:
        None where the interval is unknown: another program measured the track; or where it is that
        of readings.
    """
    if adjusted.is_read:
        return None
    if adjusted.carried is not None:
        raw = adjusted.carried.measured
    if adjusted.scale_sigma is None or not 0 <= frame < len(raw):
        return None
    zero = adjusted.zero.frame if adjusted.zero else None
    try:
        parts = interval_parts(
            raw, scale_effects(adjusted.rig), adjusted.measured, frame, zero_frame=zero
        )
    except (InvalidCorrection, InvalidRig):  # such as rows added since that do not fit
        return None
    named = [(name, float(getattr(parts, f"{name}_mm"))) for name in NAMES]
    seen = [
        Part(name, round(U95 * sigma_mm / 1000, 4))
        for name, sigma_mm in named
        if sigma_mm**2 >= _LEAST_SHARE * parts.sigma_mm**2 and sigma_mm > 0
    ]
    return UncertaintyBudget(
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
