"""A known length against the length that was measured without it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from vo_core import Track
from vo_core.drift import row_of
from vo_core.joints.lattice import SCALE_SIGMA
from vo_core.scale.correction import correct
from vo_core.scale.evidence import Evidence, KnownLength, StatedScale

CLOSURE_LIMIT = 3.0
"""Standard deviations beyond which a known length contradicts the run."""
UNCALIBRATED = SCALE_SIGMA
"""Relative standard uncertainty of the scale where nothing else is known about it."""


@dataclass(frozen=True)
class Closure:
    """A known length compared with the length measured without it."""

    known_mm: float
    measured_mm: float
    sigma_mm: float
    """Standard deviation of the residual."""

    @classmethod
    def of(cls, raw: Track, length: KnownLength, others: Sequence[Evidence]) -> Closure:
        """Measure a known length by all other evidence."""
        evidence = others or [StatedScale(UNCALIBRATED)]
        without = correct(raw, evidence, zero_frame=length.first_frame).track
        row = row_of(without, length.last_frame)
        sigma_mm = math.hypot(float(without.sigma_distance_mm[row]), length.sigma_mm)
        return cls(length.length_mm, abs(float(without.distance_mm[row])), sigma_mm)

    @property
    def residual_mm(self) -> float:
        """Measured less known length."""
        return self.measured_mm - self.known_mm

    @property
    def residual_percent(self) -> float:
        """The residual in percent of the known length."""
        return 100 * self.residual_mm / self.known_mm

    @property
    def is_plausible(self) -> bool:
        """Whether chance explains the residual."""
        return abs(self.residual_mm) <= CLOSURE_LIMIT * self.sigma_mm

    def refusal(self) -> str:
        """The sentence that says why an implausible length is not used."""
        return (
            f"The known length of {self.known_mm / 1000:.3f} m does not fit: "
            f"{self.measured_mm / 1000:.3f} m were measured, {self.residual_mm:+.0f} mm "
            f"({self.residual_percent:+.2f} %), where {CLOSURE_LIMIT * self.sigma_mm:.0f} mm can "
            "be explained. Likely causes are the wrong asset, the wrong end, or a stretch where "
            "the wall was lost. If the length is right all the same, force it with a remark."
        )
