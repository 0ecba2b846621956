"""The zero point of an interlaced film: which field of the first picture was exposed first.

Poses are those of the field that was read.  If it turns out to be the wrong one, they are all off
by the motion between the two fields, half a frame.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vo_core.geometry.rectify import BOTTOM, TOP, Rectifier, Rows
from vo_core.geometry.wall import Pose
from vo_core.image.filters import low_pass, normalise
from vo_core.links.fix import Outlook
from vo_core.links.locator import Locator
from vo_core.links.picture import Picture, Reference, View
from vo_core.state import State
from vo_core.tracker.course import Course
from vo_core.types import Image


class ZeroPoint:
    """Keeps the first picture until the order of its fields is certain."""

    def __init__(self, rectify: Rectifier, locator: Locator) -> None:
        self._rectify, self._locator = rectify, locator
        self._first: tuple[Image, Rows] | None = None
        """Picture at the zero point and the rows that were read."""

    def keep(self, image: Image, rows: Rows) -> None:
        """Keep the first picture, (H, W) grey, and the rows that were read."""
        self._first = image, rows

    def moved_mm(
        self, rows: Rows, view: View, course: Course, *, is_certain: bool
    ) -> tuple[float, float] | None:
        """How far ahead and to the right the zero point lies by the rows that are read now.

        None if it stays; `is_certain` is whether these rows are read of all frames from now on.
        """
        if self._first is None:
            return None
        image, before = self._first
        is_other = {before, rows} == {TOP, BOTTOM}
        self._first = None if is_certain else (image, rows if is_other else before)
        if not is_other:
            return None
        read, anew = (
            Picture(normalise(low_pass(self._rectify(image, field))), view)
            for field in (before, rows)
        )
        at_start = replace(State.at_start(self._rectify.rig), mount_rad=course.fixed.mount_rad)
        period_s = course.clock.period_s
        outlook = Outlook(np.inf, Pose(), period_s / 2, None, course.motion, None)
        fix = self._locator.locate(Reference(read, at_start), anew, Pose(), outlook)
        return None if fix is None else (fix.pose.x_mm, fix.pose.y_mm)
