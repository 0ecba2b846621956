"""Texts on the labels of the 3D view, in the viewer's language and unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.reports.content.words import Language, words_of
from app.survey.adjustment.adjusted_track import Source
from app.survey.distances.interval import half_width_text
from app.survey.rounding import decimals, with_interval

Units = Literal["m", "ft"]

_METRES_IN: dict[Units, float] = {"m": 1.0, "ft": 0.3048}
_DECIMALS: dict[Units, int] = {"m": 2, "ft": 1}
"""Decimals of distances, the same as on the page."""


@dataclass(frozen=True)
class Wording:
    """Words and distances for one page."""

    language: Language = "en"
    units: Units = "m"
    is_late: bool = False
    """Whether the page draws seldom, so that its own read-out is seconds ahead of the robot."""

    def word(self, name: str) -> str:
        """Return `joint`, `expected`, `to`, `weak` or `lost` in the language."""
        return words_of(self.language)[f"scene.{name}"]

    def source(self, source: Source) -> str:
        """Name what a distance rests on, such as `by the counter`."""
        return words_of(self.language)[f"source.{source}"]

    def distance(self, metres: float, *, more_decimals: int = 0) -> str:
        """Format '3.42 m' or '11.2 ft', with optional further decimals; never -0."""
        digits = _DECIMALS[self.units] + more_decimals
        return f"{decimals(metres, digits, unit=_METRES_IN[self.units])} {self.units}"

    @property
    def unit_m(self) -> float:
        """The unit of distances in metres."""
        return _METRES_IN[self.units]

    def length(self, metres: float) -> str:
        """Format a length on the wall, '215 mm' or '2.15 m' from a metre on, or '0.7 ft'."""
        if self.units == "m" and metres < 1:
            return f"{decimals(metres, 0, unit=0.001)} mm"
        return self.distance(metres)

    def size(self, value_mm: float, u95_mm: float) -> str:
        """Format a measured length on the wall, '215 ± 4 mm' or '0.71 ± 0.02 ft'."""
        if self.units == "m":
            return f"{with_interval(value_mm, u95_mm)} mm"
        value_ft, u95_ft = (mm / 1000 / self.unit_m for mm in (value_mm, u95_mm))
        return f"{decimals(value_ft, 2)} ± {half_width_text(u95_ft)} {self.units}"

    def interval(self, half_m: float) -> str:
        """Format '± 0.02 m', rounded up."""
        unit_m, digits = _METRES_IN[self.units], _DECIMALS[self.units]
        return f"± {half_width_text(half_m, unit_m=unit_m, digits=digits)} {self.units}"

    def joint(self, number: int | None, x_m: float, *, is_seen: bool) -> str:
        """Format 'joint 2 · 3.00 m', without the number where it cannot be counted from the
        zero.
        """
        name = self.word("joint") if number is None else f"{self.word('joint')} {number}"
        expected = "" if is_seen else f" · {self.word('expected')}"
        return f"{name} · {self.distance(x_m)}{expected}"
