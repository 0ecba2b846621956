"""The length axis of drawings of the pipe."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.reports.content.translator import Translator
from app.reports.report import Report

LONGEST_M = 100_000.0
"""Limit of a stated length; an imported header may hold any number."""


@dataclass(frozen=True)
class Axis:
    """The range of distances that is drawn."""

    first_m: float
    last_m: float

    @classmethod
    def of(cls, report: Report) -> Axis:
        """Span from the zero, or from earlier points, to the far end of the run or of the pipe."""
        known_m = 0.0
        match report.header.get("known_length_m"):
            case int() | float() as known if math.isfinite(known):
                known_m = float(known)
        placed = [entry.distance_m for entry in report.entries if entry.distance_m is not None]
        first_m = max(min([0.0, *placed]), -LONGEST_M)
        last_m = min(max([report.distance_m or 0.0, known_m, *placed]), LONGEST_M)
        return cls(first_m, max(last_m, first_m + 0.5))

    @property
    def length_m(self) -> float:
        """Length of the whole range."""
        return self.last_m - self.first_m

    def ticks(self, step_m: float) -> list[float]:
        """Return the multiples of a step within the range."""
        first, last = (
            math.ceil(self.first_m / step_m - 1e-9),
            math.floor(self.last_m / step_m + 1e-9),
        )
        return [n * step_m for n in range(first, last + 1)]


def tick_step_m(t: Translator, points_per_m: float, least: float) -> float:
    """Return a round step in the report's unit whose ticks are at least so many points apart."""
    per_unit_m = t.per_unit_m
    wanted = least / (points_per_m * per_unit_m)
    power = 10.0 ** math.floor(math.log10(wanted))
    factor = next(factor for factor in (1, 2, 5, 10) if factor * power >= wanted * (1 - 1e-9))
    return factor * power * per_unit_m
