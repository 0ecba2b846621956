"""Dirt on the lens: what stays fixed in the pictures, and the blocks that seldom show the wall."""

from __future__ import annotations

import numpy as np

from vo_core.geometry.rectify import PatchGrid
from vo_core.geometry.wall import Pose, apart_mm
from vo_core.image.pattern import FixedPattern
from vo_core.types import GrayImage, Matrix

PATTERN_STEP = 0.1
"""Dirt is learnt from a frame once the wall has moved by this share of the patch."""

NCC_GAIN = 0.05
"""Weight of the newest frame in the mean correlation of a block."""

NCC_FLOOR = 0.05
"""Least weight of a block, so that it can recover after the lens was wiped."""


class Dirt:
    """Learns what is fixed in the pictures, once for each piece of new wall."""

    def __init__(self, grid: PatchGrid) -> None:
        self.pattern = FixedPattern()
        self.ncc_weights: Matrix | None = None
        """(blocks,) running mean of the normalised correlation (NCC) of each block over frames that
        showed motion; None before the robot has moved."""
        self._step_mm = PATTERN_STEP * max(grid.shape) * grid.mm_per_px
        self._pose = Pose()
        """Pose at which dirt was learnt last."""

    def learn(self, normal: GrayImage, ncc: Matrix, pose: Pose) -> None:
        """Learn from a normalised picture, the correlation of its blocks, (blocks,), and its pose.

        A block that shows nothing keeps its weight.
        """
        has_begun = self.pattern.count > 0
        if has_begun and apart_mm(pose, self._pose) < self._step_mm:
            return
        if has_begun:
            newest = ncc + NCC_FLOOR
            known = newest if self.ncc_weights is None else self.ncc_weights
            self.ncc_weights = np.where(ncc > 0, known + NCC_GAIN * (newest - known), known)
        self.pattern.add(normal)
        self._pose = pose

    def forget(self) -> None:
        """Begin a new pattern, because the next picture has another vantage."""
        self.pattern = FixedPattern()

    def shift(self, x_mm: float, y_mm: float) -> None:
        """Shift the poses by a move of the zero point."""
        self._pose = self._pose.shifted(x_mm, y_mm)
