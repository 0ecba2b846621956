"""Pictures that are equal to the one before: a recorder repeated it, or the robot stands still.

Sensor noise differs from picture to picture, and coding keeps a little of it even at a standstill.
A picture that a recorder repeats is equal but for a coder's last corrections, and not for long.  In
a film that has shown a standstill as equal pictures, equal pictures are a standstill again.
"""

from __future__ import annotations

import cv2
import numpy as np

from vo_core.geometry.rectify import PatchGrid
from vo_core.geometry.wall import Pose, apart_mm
from vo_core.tracker.course import Course
from vo_core.types import GrayImage

SAME_GREY = 0.003
"""Mean difference of two pictures, grey levels, up to which they are equal.

H.264 at crf 18 corrects a frozen picture by up to 0.002, and lets through 0.005 to 0.07 of the
noise at a standstill."""

REPEATED_LIMIT_S = 0.3
"""A picture repeated for longer than this shows a robot that stands still."""

STOPPED = 0.5
"""The robot stood still during repeated pictures if it went less than this share of the
prediction."""


class Repeats:
    """Decides for each picture whether it only repeats the one before."""

    def __init__(self, grid: PatchGrid, *, is_noiseless: bool) -> None:
        self.is_noiseless = is_noiseless
        """Whether the film has shown a standstill as equal pictures, without noise."""
        self._mm_per_px = grid.mm_per_px
        self._is_held = False
        """Whether the last picture only repeated the one before, like the next."""
        self._was_held = False

    def __call__(self, patch: GrayImage, before: GrayImage | None, course: Course) -> bool:
        """Whether a recorder repeated the last picture although the robot was moving."""
        self._was_held, self._is_held = self._is_held, False
        if course.velocity is None or before is None:
            return False
        if cv2.norm(patch, before, cv2.NORM_L1) <= SAME_GREY * patch.size:
            if np.hypot(*course.velocity[:2]) <= self._mm_per_px:
                self.is_noiseless = True
            self._is_held = not self.is_noiseless and course.gone_s <= REPEATED_LIMIT_S
        return self._is_held

    def judge(self, pose: Pose, course: Course) -> None:
        """Check, by the pose of a new picture, whether repeated ones before were a standstill."""
        if self._was_held:
            way_mm = apart_mm(course.predict(), course.fixed.pose)
            self.is_noiseless |= apart_mm(pose, course.fixed.pose) < STOPPED * way_mm
