"""What distances are meant for: how wide their interval may be before they are of no use."""

from __future__ import annotations

from dataclasses import dataclass

from app.survey.places.spans import SAME_M


@dataclass(frozen=True)
class IntendedUse:
    """The greater of a length and a share of the inspected length, for half of the 95 % interval.

    By default 0.3 m or 2 %: a crew that digs finds the place.
    """

    within_m: float = 0.3
    percent: float = 2.0

    def most_m(self, length_m: float | None) -> float:
        """Return the widest half of an interval that is of use; a length may not be known yet."""
        return max(self.within_m, self.percent / 100 * abs(length_m or 0.0))

    def is_met(self, length_m: float | None, u95_m: float | None) -> bool | None:
        """Return whether the end of a survey is known well enough; None if nobody measured it."""
        if length_m is None or u95_m is None:
            return None
        return u95_m <= self.most_m(length_m) + SAME_M
