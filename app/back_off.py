"""How long to wait for another program that has failed: twice as long after each failure."""

from __future__ import annotations

from dataclasses import dataclass

_MOST_DOUBLINGS = 60


@dataclass(frozen=True)
class BackOff:
    """Pauses between tries."""

    first_s: float
    longest_s: float

    def pause_s(self, failures: int) -> float:
        """The pause after a try that has failed, and so many failures in a row before it."""
        return min(self.first_s * 2.0 ** min(failures, _MOST_DOUBLINGS), self.longest_s)
