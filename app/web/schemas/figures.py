"""Rounding of figures that are sent."""

from __future__ import annotations

from app.survey import rounding


def metres(mm: float | None) -> float | None:
    """Round a distance for publication, to the millimetre."""
    return None if mm is None else rounding.metres(mm)


def rounded(value: float | None, digits: int) -> float | None:
    """Round to a number of decimals."""
    return None if value is None else rounding.rounded(value, digits)
