"""How many frame periods lie between two frames, by time stamps that need not be exact.

Frames of a network camera arrive in bursts and jitter by more than a period, and recorders write
these times into files.  So each frame counts as one period after the one before, unless the gap is
clearly longer: then frames are missing.  Nothing here divides by a single interval.
"""

from __future__ import annotations

from collections import deque
from statistics import fmean, median

_GAP = 1.5
"""An interval longer than this many periods counts as a gap."""


class Clock:
    """Estimates the frame period from time stamps, and counts the periods that have passed."""

    def __init__(self) -> None:
        self._last_s: float | None = None
        self._intervals_s: deque[float] = deque(maxlen=31)
        self.periods = 0.0
        """Frame periods since the first frame."""

    def tick(self, t_s: float) -> None:
        """Add the time of the next frame."""
        if self._last_s is not None:
            interval_s = t_s - self._last_s
            if interval_s > 0:
                self._intervals_s.append(interval_s)
            periods = interval_s / self.period_s
            self.periods += periods if periods > _GAP else 1.0
        self._last_s = t_s

    @property
    def period_s(self) -> float:
        """Estimated time from one frame to the next."""
        shortest_s, longest_s = 1 / 240, 2.0  # of any camera
        if not self._intervals_s:
            return longest_s
        return min(max(median(self._intervals_s), shortest_s), longest_s)

    @property
    def jitter(self) -> float:
        """Mean deviation of the intervals from the period, relative to it, at most 1."""
        if not self._intervals_s:
            return 0.0
        period_s = self.period_s
        return fmean(min(abs(each_s / period_s - 1), 1.0) for each_s in self._intervals_s)
