"""Removes the bands of a pulsed lamp, which lights each row of a rolling shutter differently.

A lamp with pulse width modulation flickers faster than the rows are read, so every row has a gain
of its own, and the bands run over the picture like a texture that moves otherwise than the wall.
"""

from __future__ import annotations

import cv2
import numpy as np

from vo_core.image.filters import BLACK_GREY
from vo_core.types import GrayImage, Image

PARTS = 8
"""Parts of a row that are compared: a gain of the row is the same in all of them."""

RECENT_FRAMES = 30
"""Frames over which profiles and variances are averaged.

Bands that hardly move in that time are no motion, and count with the dirt on the lens."""


class RowGains:
    """Divides out the gains of the rows in films that have them.

    The logarithm of the part j of row v is l_j(v) = shading_j(v) + g(v) + e_j(v), with the gain g
    of the row and the texture e.  The median over the parts is the gain plus what the texture of
    the parts has in common by chance.  The film has bands if the median varies more than a part
    deviates from it: then equal gains of the parts are likelier than equal texture.

    Two things tell bands from a joint, a line of text or a part of the robot across the picture:
    they change from frame to frame, so one frame alone does not show them, and they are in all
    rows, which the upper quartile over the rows shows.
    """

    def __init__(self) -> None:
        self._frames = self._searched = 0
        self._mean: GrayImage = np.zeros((1, 1), np.float32)
        """(rows, PARTS) mean of l without the shading."""
        self._common = self._own = 0.0
        """Mean squares of what the parts of a row have in common and what each has for itself."""

    @property
    def has_bands(self) -> bool:
        """Whether the film has bands, by the frames so far."""
        return self._common > self._own

    def learn(self, image: Image) -> None:
        """Look for bands in the next frame, (H, W) grey."""
        # Sigma of the Gaussian that separates the lamp's shading, over the height of the picture.
        shading = 1 / 24
        searched_rows = 120  # approximate, spread over the picture
        self._frames += 1
        # Later only every fourth frame is searched: a lamp is seldom changed on the way.
        if self._searched >= RECENT_FRAMES and self._frames % 4:
            return
        level = _level(image[:: max(1, image.shape[0] // searched_rows)])
        level -= cv2.GaussianBlur(
            level, (1, 0), 1.0, sigmaY=shading * len(level), borderType=cv2.BORDER_REFLECT
        )
        if self._searched > 0:
            change = level - self._mean
            common = _median(change)
            share = 1 / min(self._searched, RECENT_FRAMES)
            self._common += share * (_square(common) - self._common)
            self._own += share * (_square(change - common) - self._own)
        self._searched += 1
        share = 1 / min(self._searched, RECENT_FRAMES)
        self._mean = self._mean + (level - self._mean) * np.float32(share)

    def divide_out(self, image: Image) -> Image:
        """Divide a frame, (H, W) grey, by the gains of its rows; without bands it is returned."""
        if not self.has_bands:
            return image
        level = _level(image)
        gain = _median(level - level.mean(0))
        return np.asarray(image * np.exp(-gain), np.float32)


def _level(image: Image) -> GrayImage:
    """(H, PARTS) logarithm of the mean grey level of each part of each row."""
    height, width = image.shape
    part = width // PARTS
    parts = np.ascontiguousarray(image[:, : part * PARTS]).reshape(-1, part)
    means = cv2.reduce(parts, 1, cv2.REDUCE_AVG, dtype=cv2.CV_32F).reshape(height, PARTS)
    return np.asarray(np.log(means + np.float32(BLACK_GREY)))


def _median(level: GrayImage) -> GrayImage:
    """(H, 1) median over the parts, an even number; `np.median` costs many times as much."""
    middle = np.sort(level, axis=1)[:, PARTS // 2 - 1 : PARTS // 2 + 1]
    return np.asarray((middle[:, :1] + middle[:, 1:]) / 2)


def _square(values: GrayImage) -> float:
    """Mean square of most values, by their upper quartile: a joint is in fewer rows than that."""
    size = np.abs(values).ravel()
    quartile = len(size) * 3 // 4
    return float(np.partition(size, quartile)[quartile] ** 2)
