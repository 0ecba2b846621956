"""A wall that has not the shape of the pipe, such as a bed of silt: where it is, and what it costs.

Nothing in a picture that shows a flat bed alone says how near it is, so that the distance is wrong
by an unknown factor there.  But the bed shows: its sides lie deeper than those of a pipe would, and
to the model of a pipe the camera seems to pitch as it drives on, always by the same.
"""

from __future__ import annotations

import numpy as np

from vo_core.types import Matrix

DEPTH_MM = 25.0
"""How much nearer than the rig says such a wall may be, one sigma."""

MISFIT = 0.08
"""Share of the way that pictures take for a pitch, by the depth at which they show it, from which
the wall is no pipe.  It is next to 0 where the wall is as the rig says; a flat bed makes 0.15 to
0.2 of it from the first steps on."""

MEMORY_MM = 400.0
"""Way over which the misfit is averaged: soft wheels nod to either side on less."""

UNNOTICED_MM = 280.0
"""Way on a bed until the mean has grown to half of what the bed makes."""

_LEAST_COUNT = 8
"""Frames that a judgement takes."""

_FAR_MM = 20.0
"""From the reference, from which a picture shows a pitch as well as from farther off."""


class Bed:
    """Takes the changes of the pose from keyframe to keyframe."""

    def __init__(self, height_mm: float) -> None:
        """`height_mm` is that of the camera above the wall, by the rig."""
        self._height_mm = height_mm
        self._count, self._seen_mm = 0, 0.0
        self._pitch, self._way = 0.0, 0.0
        """Weighted means of the pitch times the way and of the way squared."""
        self._is_here = False
        self._way_mm = 0.0
        """Over beds, signed like the distance."""

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
        was_here, self._is_here = self._is_here, self.misfit > MISFIT
        if self._is_here:
            before_mm = 0.0 if was_here else min(UNNOTICED_MM, abs(x_mm))
            self._way_mm += x_mm - last_mm + float(np.copysign(before_mm, x_mm - last_mm))

    @property
    def misfit(self) -> float:
        """See `MISFIT`; 0 before there is enough to judge by."""
        if self._count < _LEAST_COUNT:
            return 0.0
        return abs(self._pitch) / max(self._way, 1e-9) * self._height_mm

    @property
    def sigma_mm(self) -> float:
        """Of the distance.  A bed belongs to its place: what it did stays behind it."""
        return DEPTH_MM / self._height_mm * abs(self._way_mm)
