"""How far the distance may be wrong over wall that is not as the rig states it."""

from __future__ import annotations

import numpy as np

UNLIKELY = 4.6
"""Log odds against a bed, or against waves, before anything was seen: one pipe in a hundred."""


def probability(odds: float) -> float:
    """Probability by log odds."""
    return float(1 / (1 + np.exp(-np.clip(odds, -50.0, 50.0))))


class Doubt:
    """Adds up over the way the share by which it may be wrong.

    What the pictures say is about the wall seen of late, not about the last picture: as it becomes
    certain, the whole way within `memory_mm` counts by it. The way before keeps its own.
    """

    def __init__(self, memory_mm: float) -> None:
        self._memory_mm = memory_mm
        self.share = 0.0
        """Share that counts for the way within the memory."""
        self._late_mm = 0.0
        """Way within the memory, signed like the distance."""
        self._before_mm = 0.0
        """Doubt of the way before."""

    def take(self, share: float, way_mm: float) -> None:
        """Add a way, signed, and the share that counts from now on for what the memory holds."""
        moved_mm = self._late_mm + way_mm
        self._late_mm = float(np.clip(moved_mm, -self._memory_mm, self._memory_mm))
        self._before_mm += share * (moved_mm - self._late_mm)
        self.share = share

    @property
    def mm(self) -> float:
        """Standard uncertainty, signed like the way, so that what consecutive ways add adds up."""
        return self._before_mm + self.share * self._late_mm


def together_mm(one: Doubt, other: Doubt) -> float:
    """Combine two independent doubts, mm; the sign is that of the larger one."""
    larger_mm = max(one.mm, other.mm, key=abs)
    return float(np.copysign(np.hypot(one.mm, other.mm), larger_mm))
