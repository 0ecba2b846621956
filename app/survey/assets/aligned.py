"""Two surveys of an asset in register by their walls, in corrected distances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.survey.distances.interval import U95


@dataclass(frozen=True)
class Tie:
    """A place of the wall in both surveys."""

    distance_m: float
    """Corrected distance in the later survey."""
    earlier_m: float
    """Corrected distance in the earlier survey."""
    sigma_mm: float
    """Standard uncertainty of the one for a given other."""
    turn_h: float
    """What is added to the hours of the later survey, with the opposite direction to their
    negative, to get those of the earlier one; 0 on a floor."""

    @property
    def u95_m(self) -> float:
        """Half of the 95 % interval."""
        return U95 * self.sigma_mm / 1000


@dataclass(frozen=True)
class AlignedSurveys:
    """Which place of a later survey is which of an earlier one."""

    is_opposite: bool
    stretches: Sequence[Sequence[Tie]]
    """It holds along each stretch, and `reach_m` beyond its ends."""
    reach_m: float

    def of_earlier(self, earlier_m: float) -> Tie | None:
        """Return where a place of the earlier survey is; None where the alignment does not hold."""
        return self._tie("earlier_m", earlier_m)

    def of_later(self, distance_m: float) -> Tie | None:
        """Return where a place of the later survey is; None where the alignment does not hold."""
        return self._tie("distance_m", distance_m)

    def later_clock(self, hour: float, tie: Tie) -> float:
        """Return hours of the earlier survey as the later one has them, at a place."""
        return tie.turn_h - hour if self.is_opposite else hour - tie.turn_h

    def _tie(self, by: str, at_m: float) -> Tie | None:
        other = "distance_m" if by == "earlier_m" else "earlier_m"
        for stretch in self.stretches:
            names = (by, other, "sigma_mm", "turn_h")
            table = np.array([[getattr(tie, name) for name in names] for tie in stretch])
            knots, *columns = table[np.argsort(table[:, 0])].T
            if not knots[0] - self.reach_m <= at_m <= knots[-1] + self.reach_m:
                continue
            inside_m = min(max(at_m, float(knots[0])), float(knots[-1]))
            there_m, sigma_mm, turn_h = (float(np.interp(inside_m, knots, c)) for c in columns)
            there_m += (at_m - inside_m) * (-1 if self.is_opposite else 1)
            return Tie(**{by: at_m, other: there_m}, sigma_mm=sigma_mm, turn_h=turn_h)
        return None
