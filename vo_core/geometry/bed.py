"""A wall that has not the shape of the pipe, such as a bed of silt: where it is, and what it costs.

Nothing in a picture that shows a flat bed alone says how near it is, so that the distance is wrong
by an unknown factor there.  But the bed shows: its sides lie deeper than those of a pipe would, and
to the model of a pipe the camera seems to pitch as it drives on, always by the same.
"""

from __future__ import annotations

import numpy as np

from vo_core.rig import Rig
from vo_core.types import Matrix

DEPTH_MM = 25.0
"""How much nearer than the rig says such a wall may be, one sigma."""

NOTICED = 0.4
"""Share of the misfit that a flat bed makes, see `flat_misfit`, from which the wall is no pipe."""

MISFITS = (0.03, 0.08)
"""Least and most misfit that is taken for a bed: a rig that is wrong makes up to 0.015."""

MEMORY_MM = 400.0
"""Way over which the misfit is averaged: soft wheels nod to either side on less."""

UNNOTICED_MM = 240.0
"""Way on a bed until the mean has grown to about half of what the bed makes."""

_LEAST_COUNT = 8
"""Frames that a judgement takes."""

_FAR_MM = 20.0
"""From the reference, from which a picture shows a pitch as well as from farther off."""


def flat_misfit(rig: Rig, patch_mm: tuple[float, float]) -> float:
    """Share of the way that a flat bed makes look like a pitch, times height; 0 over a floor.

    Content of a flat bed on the developed wall of a pipe of radius R moves as 1 - y^2 / (2 R h)
    across it, as it does in a pitch, which moves it as x^2 / h^2 along it, too.  Of that the least
    squares over a patch of the sides a and b make 1 / (1 + (a / b)^4 (2 R / h)^2), to second order.
    """
    if rig.pipe.diameter_mm is None:
        return 0.0
    along_mm, across_mm = patch_mm
    relative = rig.pipe.diameter_mm / rig.mount.height_mm
    return 1 / (1 + (along_mm / across_mm) ** 4 * relative**2)


class Bed:
    """Takes the changes of the pose from keyframe to keyframe."""

    def __init__(self, rig: Rig, patch_mm: tuple[float, float]) -> None:
        """`patch_mm` are the sides of the wall that is seen, along the pipe and across it."""
        self._height_mm = rig.mount.height_mm
        self._least = float(np.clip(NOTICED * flat_misfit(rig, patch_mm), *MISFITS))
        self._count, self._seen_mm = 0, 0.0
        self._pitch, self._way = 0.0, 0.0
        """Weighted means of the pitch times the way and of the way squared."""
        self._is_here, self._highest = False, 0.0
        """Is the wall a bed, and the highest misfit of it?"""
        self._way_mm = self._left_mm = 0.0
        """Over beds, signed like the distance, and where the last one ended."""

    def take(self, change: Matrix, last_mm: float, x_mm: float) -> None:
        """Take how a pose differs from its reference's, and the distances of the last two fixes.

        Args:
            change: (6,) in the order of `Pose`, as measured without any habit.
            last_mm, x_mm: Of the camera, one after the other.
        """
        way_mm, pitch_rad, driven_mm = float(change[0]), float(change[4]), abs(x_mm - last_mm)
        self._count += 1
        self._seen_mm += driven_mm
        share = driven_mm / max(min(self._seen_mm, MEMORY_MM), driven_mm, 1e-9)
        weight = 1 / max(way_mm**2, _FAR_MM**2)
        self._pitch += share * (weight * pitch_rad * way_mm - self._pitch)
        self._way += share * (weight * way_mm**2 - self._way)
        sure = 2 - min(self._seen_mm / MEMORY_MM, 1.0)  # robots nod to one side at first
        was_here, self._is_here = self._is_here, self.misfit > sure * self._least
        highest = max(self._highest, self.misfit)
        self._highest = highest if self._is_here else 0.0
        if self._is_here:
            before_mm = 0.0 if was_here else min(UNNOTICED_MM, abs(x_mm - self._left_mm))
            self._way_mm += x_mm - last_mm + float(np.copysign(before_mm, x_mm - last_mm))
        elif was_here:
            # A mean falls from what it was to the least by so much way behind the bed.
            outlasted_mm = MEMORY_MM * min(np.log(highest / self._least), 1.0)
            self._way_mm -= float(np.copysign(outlasted_mm, x_mm - last_mm))
            self._left_mm = x_mm

    @property
    def misfit(self) -> float:
        """Share of the way that pictures take for a pitch, by the height at which they show it.

        Next to 0 where the wall is as the rig says, and before there is enough to judge by.
        """
        if self._count < _LEAST_COUNT:
            return 0.0
        return abs(self._pitch) / max(self._way, 1e-9) * self._height_mm

    @property
    def sigma_mm(self) -> float:
        """Of the distance.  A bed belongs to its place: what it did stays behind it."""
        return DEPTH_MM / self._height_mm * abs(self._way_mm)
