"""Detects a wall without the pipe's shape, such as a bed of silt, and estimates its effect.

A picture that shows only a flat bed does not show how near the bed is, so the distance there is
wrong by an unknown factor. But the bed can be detected: its sides lie deeper than those of a pipe,
and under the model of a pipe the camera seems to pitch steadily as it drives on.
"""

from __future__ import annotations

import numpy as np

from vo_core.rig import Rig
from vo_core.types import Matrix

DEPTH_MM = 25.0
"""How much nearer than the rig states such a wall may be, one sigma."""

NOTICED = 0.4
"""Share of `flat_misfit` from which the wall counts as a bed."""

MISFITS = (0.03, 0.08)
"""Limits of the misfit from which the wall counts as a bed: a wrong rig makes up to 0.015."""

MEMORY_MM = 400.0
"""Distance over which the misfit is averaged: soft wheels nod over shorter ones."""

UNNOTICED_MM = 240.0
"""Distance on a bed until the mean has grown to about half the misfit of the bed."""

_LEAST_COUNT = 8
"""Least number of frames before a bed is detected."""

_FAR_MM = 20.0
"""Beyond this distance from the reference a picture shows a pitch as well as from farther away."""


def flat_misfit(rig: Rig, patch_mm: tuple[float, float]) -> float:
    """Apparent pitch per distance on a flat bed, times the height; 0 over a floor.

    On the developed wall of a pipe of radius R the content of a flat bed moves as 1 - y^2 / (2 R h)
    across the pipe.  A pitch moves it in the same way, and also as x^2 / h^2 along the pipe.  To
    second order, least squares over a patch of the sides a and b give
    1 / (1 + (a / b)^4 (2 R / h)^2).
    """
    if rig.pipe.diameter_mm is None:
        return 0.0
    along_mm, across_mm = patch_mm
    relative = rig.pipe.diameter_mm / rig.mount.height_mm
    return 1 / (1 + (along_mm / across_mm) ** 4 * relative**2)


class Bed:
    """Detects beds from the changes of the pose between keyframes."""

    def __init__(self, rig: Rig, patch_mm: tuple[float, float]) -> None:
        """`patch_mm` are the sides of the visible wall, along the pipe and across it."""
        self._height_mm = rig.mount.height_mm
        self._least = float(np.clip(NOTICED * flat_misfit(rig, patch_mm), *MISFITS))
        self._count, self._seen_mm = 0, 0.0
        self._pitch = 0.0
        """Weighted mean of the pitch times the distance."""
        self._way = 0.0
        """Weighted mean of the squared distance."""
        self._is_here = False
        """Whether the wall is a bed now."""
        self._highest = 0.0
        """Highest misfit of that bed."""
        self._way_mm = 0.0
        """Distance driven on beds, signed like the distance."""
        self._left_mm = 0.0
        """Distance at which the last bed ended."""

    def take(self, change: Matrix, last_mm: float, x_mm: float) -> None:
        """Add the change of a pose since its reference, and the distances of the last two fixes.

        Args:
            change: (6,) in the order of `Pose`, measured without the habit prior.
            last_mm, x_mm: Distance of the camera at the fix before, and at this one.
        """
        way_mm, pitch_rad, driven_mm = float(change[0]), float(change[4]), abs(x_mm - last_mm)
        self._count += 1
        self._seen_mm += driven_mm
        share = driven_mm / max(min(self._seen_mm, MEMORY_MM), driven_mm, 1e-9)
        weight = 1 / max(way_mm**2, _FAR_MM**2)
        self._pitch += share * (weight * pitch_rad * way_mm - self._pitch)
        self._way += share * (weight * way_mm**2 - self._way)
        sure = 2 - min(self._seen_mm / MEMORY_MM, 1.0)  # at first a robot may nod to one side only
        was_here, self._is_here = self._is_here, self.misfit > sure * self._least
        highest = max(self._highest, self.misfit)
        self._highest = highest if self._is_here else 0.0
        if self._is_here:
            before_mm = 0.0 if was_here else min(UNNOTICED_MM, abs(x_mm - self._left_mm))
            self._way_mm += x_mm - last_mm + float(np.copysign(before_mm, x_mm - last_mm))
        elif was_here:
            # Behind the bed the mean takes this distance to fall to the threshold.
            outlasted_mm = MEMORY_MM * min(np.log(highest / self._least), 1.0)
            self._way_mm -= float(np.copysign(outlasted_mm, x_mm - last_mm))
            self._left_mm = x_mm

    @property
    def misfit(self) -> float:
        """Apparent pitch per distance, times the height.

        It is near 0 where the wall is as the rig states, and 0 before there are enough frames.
        """
        if self._count < _LEAST_COUNT:
            return 0.0
        return abs(self._pitch) / max(self._way, 1e-9) * self._height_mm

    @property
    def sigma_mm(self) -> float:
        """Standard uncertainty of the distance by beds; it stays after the bed has ended."""
        return abs(self.doubt_mm)

    @property
    def doubt_mm(self) -> float:
        """The same, signed like the way on beds, so that the doubts of consecutive ways add up."""
        return DEPTH_MM / self._height_mm * self._way_mm
