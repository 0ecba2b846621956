"""The fixed pattern, which moves with the camera and not with the wall: dirt, text, lamp edges.

A plain mean of N frames still contains some of the scene, which is itself a fixed pattern and
shifts every registration towards standstill (by about 1/N px). So only the significant part is
removed: the excess of the mean over `SIGNIFICANT` of its own standard errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vo_core.types import GrayImage

SIGNIFICANT = 3.0
"""Standard errors of the mean that are not removed."""

MEMORY_FRAMES = 100
"""Frames over which the pattern is averaged, so that a lens may get wet on the way."""

LEAST_FRAMES = 6
"""Least number of frames before anything is removed, or masked by `Overlay`."""


@dataclass
class FixedPattern:
    """Estimates the fixed pattern from pictures of different parts of the wall."""

    count: int = 0
    _mean: GrayImage | None = None
    _power: GrayImage | None = None
    _pattern: GrayImage | None = None
    _share: float | None = None
    """`share` of the pictures so far; None until it is asked for."""

    def add(self, picture: GrayImage) -> None:
        """Add a normalised picture that shows another part of the wall than those before."""
        self.count, self._share = self.count + 1, None
        if self._mean is None or self._power is None:
            self._mean, self._power = picture.copy(), picture * picture
            return
        frames = min(self.count, MEMORY_FRAMES)
        cv2.accumulateWeighted(picture, self._mean, 1 / frames)
        cv2.accumulateWeighted(picture * picture, self._power, 1 / frames)
        if self.count < LEAST_FRAMES:
            return
        variance = np.abs(self._power - self._mean * self._mean)
        by_chance = SIGNIFICANT * cv2.sqrt(variance / np.float32(frames - 1))
        self._pattern = self._mean - cv2.min(cv2.max(self._mean, -by_chance), by_chance)

    @property
    def share(self) -> float:
        """Share of the pictures' energy that belongs to the pattern.

        Structures along the rows are left out, because a water line or a seam along the pipe stays
        in its place too.
        """
        if self._mean is None or self._power is None or self.count < LEAST_FRAMES:
            return 0.0
        if self._share is None:
            self._share = _share(self._mean, self._power, min(self.count, MEMORY_FRAMES))
        return self._share

    def remove(self, picture: GrayImage) -> GrayImage:
        """Subtract the pattern as estimated so far."""
        return picture if self._pattern is None else picture - self._pattern


def _share(mean: GrayImage, power: GrayImage, frames: int) -> float:
    """Energy of the pattern over that of the pictures, without the share expected by chance."""
    along_px = 65  # structures that are longer along the rows may belong to the wall
    spots = mean - cv2.blur(mean, (along_px, 1))
    own, fixed, apart = (float(cv2.mean(each)[0]) for each in (power, mean * mean, spots * spots))
    return max(apart - (own - fixed) / (frames - 1), 0.0) / max(own, 1e-6)
