"""Detects a wall without the pipe's shape, such as a bed of silt, and estimates its effect.

A picture that shows only a flat bed does not show how near the bed is, so the distance there is
wrong by an unknown factor. But the bed can be detected: its sides lie deeper than those of a pipe,
and under the model of a pipe the camera seems to pitch steadily as it drives on.
"""

from __future__ import annotations

import numpy as np

from vo_core.geometry.doubt import UNLIKELY, Doubt, probability
from vo_core.rig import Rig
from vo_core.types import Matrix

DEPTH_MM = 25.0
"""How much nearer than the rig states such a wall may be, one sigma."""

MISFITS = (0.075, 0.2)
"""Limits of the misfit of a bed: rendered beds show 0.16 to 0.18, also where `flat_misfit` is
more."""

NO_BED_MISFIT = 0.02
"""Misfit over `MEMORY_MM` of a clean wall, one sigma: a nodding robot shows up to 0.035, a rig that
is a little wrong 0.015.  Over less it is larger, as for any mean."""

MEMORY_MM = 400.0
"""Distance over which the misfit is averaged: soft wheels nod over shorter ones."""


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
        self._is_pipe = rig.pipe.diameter_mm is not None
        self._expected = float(np.clip(flat_misfit(rig, patch_mm), *MISFITS))
        self._seen_mm = 0.0
        self._pitch = 0.0
        """Weighted mean of the pitch times the distance."""
        self._way = 0.0
        """Weighted mean of the squared distance."""
        self.doubt = Doubt(MEMORY_MM)
        """That of the distance by beds; it stays after the bed has ended."""

    def take(self, change: Matrix, last_mm: float, x_mm: float) -> None:
        """Add the change of a pose since its reference, and the distances of the last two fixes.

        Args:
            change: (6,) in the order of `Pose`, measured without the prior of the motion.
            last_mm, x_mm: Distance of the camera at the fix before, and at this one.
        """
        far_mm = 20.0  # a picture farther from its reference shows a pitch no better
        way_mm, pitch_rad, driven_mm = float(change[0]), float(change[4]), abs(x_mm - last_mm)
        self._seen_mm += driven_mm
        share = driven_mm / max(min(self._seen_mm, MEMORY_MM), driven_mm, 1e-9)
        weight = 1 / max(way_mm**2, far_mm**2)
        self._pitch += share * (weight * pitch_rad * way_mm - self._pitch)
        self._way += share * (weight * way_mm**2 - self._way)
        # Of a mixture of a bed and none, the standard deviation.
        depth = DEPTH_MM / self._height_mm
        self.doubt.take(float(np.sqrt(self.probability)) * depth, x_mm - last_mm)

    @property
    def misfit(self) -> float:
        """Apparent pitch per distance, times the height: near 0 where the rig is right."""
        return abs(self._pitch) / max(self._way, 1e-9) * self._height_mm

    @property
    def probability(self) -> float:
        """Probability that the wall is a bed now: misfits are normal about that of a bed, or 0."""
        if not self._is_pipe:
            return 0.0
        variance = NO_BED_MISFIT**2 / max(min(self._seen_mm / MEMORY_MM, 1.0), 1e-3)
        gain = (self.misfit - self._expected / 2) * self._expected / variance
        return probability(gain - UNLIKELY)
