"""The accuracy class that contracts ask for."""

from __future__ import annotations

from dataclasses import dataclass

from app.survey.places.spans import SAME_MM

CLASSES_PERCENT = (0.5, 1.0, 5.0)


@dataclass(frozen=True)
class DistanceClass:
    """The percentage of the length within which distances are known."""

    percent: float | None
    """0.5, 1 or 5; None if not even 5 is met."""
    half_width_m: float
    """Half of the 95 % interval at the far end."""
    residual_mm: float | None
    """Residual of the closure; None if the length is not known."""
    length_mm: float

    @classmethod
    def of(cls, length_mm: float, half_width_m: float, residual_mm: float | None) -> DistanceClass:
        """Return the narrowest class that both the interval and the residual meet."""
        error_mm = max(1000 * half_width_m, abs(residual_mm or 0.0))
        met = (
            percent
            for percent in CLASSES_PERCENT
            if error_mm <= percent / 100 * length_mm + SAME_MM
        )
        return cls(next(met, None), half_width_m, residual_mm, length_mm)
