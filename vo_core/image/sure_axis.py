"""Decides whether the axis of the pipe is certain in a picture, for a proposal to a person.

A search for the axis (`vo_core.image.axis`) has an answer in most pictures, also where the camera
looks down into the light of a narrow lamp, where mist hides the end, or where the shading of the
near wall outvotes a far end at the border.  So three searches look at the same picture: at what is
nearest to the axis, at its surroundings, and at most of the picture.  They see different gradients,
and a place on which they agree is the axis.  Where the end is too dark to have gradients, its
darkness takes the place of the nearest ones.

Measured on two pictures a second of 24 rendered films with known truth (the forward scenarios and
draws 11 to 13 of their lenses and mounts) and of two real ones: 19 of the 26 films have a sure
picture, 314 of their 442 pictures are sure, with a median error of 0.8 % of the picture's width, a
largest one of 3.8 %, and all within the stated 95 %. The search alone was off by up to 15 % in
these films. No picture is sure out of 242 of cameras that look down, and out of 48 in mist.
"""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np

from vo_core.image.axis import Axis, AxisFinder
from vo_core.image.resample import reduce_to
from vo_core.types import Image

MOST_SIGMA = 0.025
"""Largest standard deviation of a sure axis, and the largest distance of what is nearest to it, as
shares of the picture's width: those of pictures with an error of 15 % begin at 0.034."""

MOST_SIGMA_FAR = 0.12
"""The same of the search in most of the picture; in mist it is at least 0.23."""

MOST_APART_FAR = 0.07
"""Largest distance of its place: the far wall is off the axis if the camera is."""

LEAST_SIGMA = 0.005
"""Part of the standard deviation that does not show in one picture, as a share of the width."""

DARK = 1.0
"""Least logarithm of the wall's brightness over that of a dark end, both above the darkest place.

Towards ends without light it is 1.2 to 1.6."""

_SIDE_PX = 96
_RINGS = ((0.0, 0.05), (0.05, 0.12), (0.12, 0.25), (0.25, 0.4))
"""Rings about the axis in which the brightness is compared, as shares of the longest side."""


class SureAxis:
    """Finds the axis in frames of one size, where it is certain."""

    def __init__(self, frame_wh: tuple[int, int]) -> None:
        self._side_px = max(frame_wh)
        self._nearest = AxisFinder(frame_wh, near=0.05, reach=0.15)
        self._around = AxisFinder(frame_wh)
        self._far = AxisFinder(frame_wh, near=0.2, reach=0.6)

    def __call__(self, image: Image) -> Axis | None:
        """Find the axis in a frame, (H, W) grey; None unless it is certain."""
        found = self.likely(image)
        return None if found is None else self.confirmed(image, found)

    def likely(self, image: Image) -> Axis | None:
        """Find the axis where it probably is, certain or not; None if it does not show."""
        return self._around(image)

    def confirmed(self, image: Image, found: Axis) -> Axis | None:
        """Return what `likely` has found in a frame with its certain interval; None if it is not
        certain.
        """
        far = self._far(image)
        if far is None:
            return None
        is_clear = self._agrees(found, found, MOST_SIGMA, 0.0) and self._agrees(
            found, far, MOST_SIGMA_FAR, MOST_APART_FAR
        )
        if not is_clear:
            return None
        nearest = self._nearest(image)
        if nearest is not None and self._agrees(found, nearest, MOST_SIGMA, MOST_SIGMA):
            return self._with_floor(found)
        return self._with_floor(found) if self._is_dark_at(image, found) else None

    def _agrees(self, found: Axis, other: Axis, most_sigma: float, most_apart: float) -> bool:
        apart_px = math.dist(found.pixel_uv, other.pixel_uv)
        return (
            other.sigma_px <= most_sigma * self._side_px and apart_px <= most_apart * self._side_px
        )

    def _with_floor(self, found: Axis) -> Axis:
        return replace(found, sigma_px=math.hypot(found.sigma_px, LEAST_SIGMA * self._side_px))

    def _is_dark_at(self, image: Image, found: Axis) -> bool:
        """Whether it gets darker and darker towards the axis, as towards an end without light."""
        height, width = image.shape
        scale = min(1.0, _SIDE_PX / self._side_px)
        size_wh = (round(width * scale), round(height * scale))
        black_grey = 8.0  # as in the search: noise in the dark counts little
        grey = reduce_to(image, size_wh)
        grey = np.log(grey - grey.min() + np.float32(black_grey))
        u, v = ((at + 0.5) * scale - 0.5 for at in found.pixel_uv)
        rows, columns = np.ogrid[: size_wh[1], : size_wh[0]]
        share = np.hypot(rows - v, columns - u) / max(size_wh)
        core, rim, wall, near_wall = (
            float(cv2.mean(grey, ((low <= share) & (share < high)).astype(np.uint8))[0])
            for low, high in _RINGS
        )
        return core < rim < wall < near_wall and wall - core >= DARK
