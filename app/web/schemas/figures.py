"""Figures as they are sent."""

from __future__ import annotations

from app.survey import rounding


def metres(mm: float | None) -> float | None:
    """A distance as it is published, to the millimetre."""
    return None if mm is None else rounding.metres(mm)


def rounded(value: float | None, digits: int) -> float | None:
    """To so many digits behind the point."""
    return None if value is None else rounding.rounded(value, digits)
