"""The fixed pattern: dirt, burnt-in text, lamp edges: what moves with the camera, not the wall.

A mean over frames would do, but what is left of the scene in a mean of few frames is itself a
fixed pattern and pulls every registration towards standstill (about 1/N px).  So only what is
significant is removed: where the mean of N frames exceeds `SIGNIFICANT` of its own standard
errors, and by that excess only.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vo_core.types import GrayImage

SIGNIFICANT = 3.0
MEMORY = 100
"""Frames over which the pattern is averaged: a lens that gets wet on the way is followed."""

LEAST = 6
"""Frames before anything is removed."""

ALONG_PX = 65
"""What is longer than that along the rows may well be the wall's."""


@dataclass
class FixedPattern:
    """Running mean and mean square, pixel by pixel, of pictures of different parts of the wall."""

    count: int = 0
    _mean: GrayImage | None = None
    _power: GrayImage | None = None
    _pattern: GrayImage | None = None

    def add(self, picture: GrayImage) -> None:
        """Learn from a normalised picture; its wall must differ from that of those before."""
        self.count += 1
        if self._mean is None or self._power is None:
            self._mean, self._power = picture.copy(), picture * picture
            return
        frames = min(self.count, MEMORY)
        cv2.accumulateWeighted(picture, self._mean, 1 / frames)
        cv2.accumulateWeighted(picture * picture, self._power, 1 / frames)
        if self.count < LEAST:
            return
        variance = np.maximum(self._power - self._mean * self._mean, 0)
        excess = np.abs(self._mean) - SIGNIFICANT * cv2.sqrt(variance / np.float32(frames - 1))
        self._pattern = np.copysign(np.maximum(excess, 0), self._mean)

    @property
    def share(self) -> float:
        """Of the pictures' energy that is the pattern's.

        What runs along the rows is left out, because a water line or a seam along the pipe stays
        in its place too.
        """
        if self._mean is None or self._power is None or self.count < LEAST:
            return 0.0
        return _share(self._mean, self._power, min(self.count, MEMORY))

    def remove(self, picture: GrayImage) -> GrayImage:
        """The picture without the pattern known so far."""
        return picture if self._pattern is None else picture - self._pattern


def _share(mean: GrayImage, power: GrayImage, frames: int) -> float:
    """Energy of the pattern over that of the pictures, free of what chance leaves in a mean."""
    spots = mean - cv2.blur(mean, (ALONG_PX, 1))
    chance = (power.mean() - (mean * mean).mean()) / (frames - 1)
    energy = float((spots * spots).mean() - chance)
    return max(energy, 0.0) / max(float(power.mean()), 1e-6)
