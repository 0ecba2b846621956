"""Pauses before trying again another program that has failed: each is twice as long as the last."""

from __future__ import annotations

from dataclasses import dataclass

_MOST_DOUBLINGS = 60


@dataclass(frozen=True)
class BackOff:
    """Pauses between tries."""

    first_s: float
    longest_s: float

    def pause_s(self, failures: int) -> float:
        """Return the pause after a failed try that followed `failures` failures in a row."""
        return min(self.first_s * 2.0 ** min(failures, _MOST_DOUBLINGS), self.longest_s)
