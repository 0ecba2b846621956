"""Figures as they are sent."""

from __future__ import annotations


def metres(mm: float | None) -> float | None:
    """Metres to a tenth of a millimetre."""
    return None if mm is None else round(mm / 1000, 4)


def rounded(value: float | None, digits: int) -> float | None:
    """To so many digits behind the point."""
    return None if value is None else round(value, digits)
