"""How a camera that looks along the pipe moves in it beside its way forward.

A crawler steers and climbs, a push camera rolls over, a phone on a rod points anywhere. Nobody
states where such a camera stands, and the whole ring of the wall shows it.  So its pose is a random
walk whose steps are learnt from the drive, without a pull towards the axis.
"""

from __future__ import annotations

import numpy as np

from vo_core.geometry.wall import Pose
from vo_core.types import Matrix

ASIDE = 0.035
"""Distance of the first pose from the pipe's axis, one sigma, as a share of the diameter."""

TURNED = np.radians(2.5)
"""Its turn against the axis, one sigma."""

WAY_MM = 300.0
"""Distance of the steps below."""

STANDING_MM = 15.0
"""A camera that stands wanders as much as one that has driven so far."""

STIFFEST = np.array([1.0, np.radians(0.2), 1.0, np.radians(0.2), np.radians(0.2)])
"""Least change of y, yaw, z, pitch and roll over `WAY_MM`, one sigma, mm and rad."""

USUAL = np.array([5.0, np.radians(1.5), 3.0, np.radians(1.0), np.radians(1.0)])
"""Initial value of the same."""

LOOSEST = np.array([40.0, np.radians(15), 40.0, np.radians(15), np.radians(15)])
"""Upper limit of the same."""

CLEAR = 4.0
"""A squared change counts only beyond this many times its error variance."""

_MEMORY = 40
"""Frames over which the steps are averaged."""

_WORTH = 5
"""Weight of `USUAL` in that average, in frames."""


class Wander:
    """Learns how far a camera that looks ahead wanders; it has the methods of `Sway`."""

    def __init__(self) -> None:
        self.own = np.eye(6)
        self._variance = np.square(USUAL)
        self._count = _WORTH

    def learn(self, change: Matrix, variance: Matrix) -> None:
        """Update the steps by a change of the pose since its reference.

        Args:
            change: (6,) in the order of `Pose`, measured without the habit prior.
            variance: (6,) of `change`.
        """
        self._count += 1
        share = 1 / min(self._count, _MEMORY)
        per_step = 1 / self.spread(float(change[0]))[1:]
        noise = per_step * variance[1:]
        weight = np.square(self._variance / (self._variance + noise))
        shown = per_step * np.square(change[1:]) - CLEAR * noise
        self._variance += share * weight * (shown - self._variance)

    def follow(self, pose: Pose, variance: Matrix) -> None:
        """Ignore the absolute pose."""

    def mean(self, pose: Pose) -> Matrix:
        """(6,) the mean pose, which does not matter to a random walk."""
        return np.zeros(6)

    def kept(self, way_mm: float) -> Matrix:
        """(6,) shares of a deviation that remain after a distance: all of it."""
        return np.ones(6)

    def spread(self, way_mm: float) -> Matrix:
        """(6,) variance of a change after a distance, over that after `WAY_MM`."""
        return np.full(6, (abs(way_mm) + STANDING_MM) / WAY_MM)

    @property
    def covariance(self) -> Matrix:
        """(6, 6) of a change over `WAY_MM`, in the order of `Pose`; open along the pipe."""
        return np.diag([1e12, *np.clip(self._variance, STIFFEST**2, LOOSEST**2)])
