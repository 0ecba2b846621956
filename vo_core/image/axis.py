"""Finds the axis of the pipe in a picture that looks along it.

A lamp at the camera lights the wall less the farther it is, and joints are rings: so brightness
changes towards the end of the pipe and away from it, and hardly around it.  The axis is the point
that most gradients near it point to or from, whether the end is dark or daylight (a fast radial
symmetry transform, Loy & Zelinsky 2003, with a soft window).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vo_core.image.filters import gradient, magnitude, parabola_peak
from vo_core.image.resample import reduce_to
from vo_core.types import GrayImage, Image

LEAST_SCORE = 0.25
"""A score from which the axis is in the picture: 1 if all gradients point to it, 0 if as many lie
across."""


EVIDENCE = 100.0
"""Number of independent gradients that a score is worth: n of them that agree by a score s have
the likelihood (1 - s^2)^(-n/2).

The axis of clear pictures is then uncertain by a degree or two, and by 10 to 20 degrees in mist,
whose clouds make axes of their own."""


@dataclass(frozen=True, slots=True)
class Axis:
    """Where the axis of the pipe appears in a picture."""

    pixel_uv: tuple[float, float]
    score: float
    sigma_px: float
    """Standard deviation of the place, along each side of the picture, by all places whose scores
    come near."""


class AxisFinder:
    """Finds the axis in frames of one size."""

    def __init__(self, frame_wh: tuple[int, int], *, near: float = 0.1, reach: float = 0.4) -> None:
        """Prepare the search.

        Args:
            frame_wh: Size of the frames, px.
            near: Gradients count fully up to here, as a share of the longest side, because farther
                rings are off the axis if the camera is.
            reach: Beyond it they do not count at all.
        """
        side_px = 96  # longest side of the picture in which the axis is searched: shading is smooth
        outside = 0.15  # share of that side by which the axis may lie outside
        least_support = 0.35  # share of the window within the picture below which the score falls
        self._scale = min(1.0, side_px / max(frame_wh))
        self._size_wh = (round(frame_wh[0] * self._scale), round(frame_wh[1] * self._scale))
        reach_px, near_px = int(reach * side_px), near * side_px
        x, y = np.meshgrid(*[np.arange(-reach_px, reach_px + 1, dtype=np.float32)] * 2)
        square = x * x + y * y
        window = (1 + square / near_px**2) ** -1.5 * (square > 2)
        square = np.maximum(square, 1)
        self._kernels = [
            np.asarray(window * part, np.float32)
            for part in (2 * x * x / square - 1, 4 * x * y / square, 2 * y * y / square - 1)
        ]
        self._border_px = round(outside * side_px)
        area = cv2.filter2D(self._padded(np.ones(self._size_wh[::-1], np.float32)), -1, window)
        self._area = np.maximum(area, least_support * window.sum())

    def __call__(self, image: Image) -> Axis | None:
        """Find the axis in a frame, (H, W) grey; None if it does not show."""
        least_slope = 0.01  # gradient of the logarithm, per px, that counts half
        # Grey levels added before the logarithm, so that noise in the dark counts little.
        black_grey = 8.0
        grey = np.log(reduce_to(image, self._size_wh) + np.float32(black_grey))
        along, down = gradient(np.asarray(cv2.GaussianBlur(grey, (0, 0), 1.0), np.float32))
        slope = magnitude(along, down)
        # Unit gradients, those of noise less: a bright lamp must not outvote the shading.
        weight = 1 / (np.maximum(slope, 1e-9) * (slope + np.float32(least_slope)))
        parts = (weight * along * along, weight * along * down, weight * down * down)
        votes = np.zeros_like(self._area)
        for part, kernel in zip(parts, self._kernels, strict=True):
            votes += cv2.filter2D(
                self._padded(part), cv2.CV_32F, kernel, borderType=cv2.BORDER_CONSTANT
            )
        score = votes / self._area
        row, column = divmod(int(score.argmax()), score.shape[1])
        if score[row, column] < LEAST_SCORE:
            return None
        offset = [
            _peak(line)
            for line in (score[row, column - 1 : column + 2], score[row - 1 : row + 2, column])
        ]
        u, v = (
            (at - self._border_px + off + 0.5) / self._scale - 0.5
            for at, off in zip((column, row), offset, strict=True)
        )
        # Outside the picture there are gradients on one side only, and the axis seems nearer.
        width, height = (side / self._scale for side in self._size_wh)
        if not (0 <= u < width and 0 <= v < height):
            return None
        clear = 1 - np.square(np.maximum(score, 0))
        likely = (clear[row, column] / clear) ** (EVIDENCE / 2)
        rows, columns = np.ogrid[: score.shape[0], : score.shape[1]]
        square = np.square(rows - row) + np.square(columns - column)
        sigma = float(np.sqrt((likely * square).sum() / likely.sum() / 2))
        return Axis((float(u), float(v)), float(score[row, column]), sigma / self._scale)

    def _padded(self, image: GrayImage) -> GrayImage:
        n = self._border_px
        return np.asarray(cv2.copyMakeBorder(image, n, n, n, n, cv2.BORDER_CONSTANT, value=0))


def _peak(three: GrayImage) -> float:
    """Offset of the maximum of the parabola through three neighbours; 0 at a border."""
    if len(three) < 3:
        return 0.0
    left, middle, right = (float(value) for value in three)
    return parabola_peak(left, middle, right)
