"""The interval that people read: one width and one notation wherever a distance is shown.

Its half-width comes from `sigma_distance_mm`, which holds every source of error, and is rounded up:
an interval may be wider than the error but not narrower. static/core/wall/units.js has the same
rule.
"""

from __future__ import annotations

from app.survey.rounding import decimals, rounded_up

U95 = 1.96
"""Standard deviations in the half-width of a 95 % interval."""
LEAST_M = 0.01
"""Smallest half-width: distances are shown to a centimetre, and none is known better."""


def half_width_m(sigma_mm: float) -> float:
    """Return half of the 95 % interval, rounded up to a millimetre, at least `LEAST_M`."""
    return max(LEAST_M, rounded_up(U95 * sigma_mm / 1000, 3))


def half_width_text(half_m: float, *, unit_m: float = 1.0, digits: int = 2) -> str:
    """Format a half-width without its unit, rounded up to the last digit shown and never zero.

    Args:
        half_m: From `half_width_m`.
        unit_m: Metres in the unit that is shown.
        digits: Decimals of distances in this unit.
    """
    return decimals(max(rounded_up(half_m / unit_m, digits), 10.0**-digits), digits)
