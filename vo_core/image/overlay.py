"""What the picture shows besides the wall: burnt-in text and the robot's own parts.

A film that looks along the pipe carries a counter, a date and often a bumper or a lamp.  They stay
in their place while the wall moves, so the mean of their gradients over some frames is as large as
the gradients themselves; the gradients of a moving wall average out.  Digits that change share
their box and most of their strokes.
"""

from __future__ import annotations

import cv2
import numpy as np

from vo_core.image.filters import gradient
from vo_core.image.resample import reduce_to
from vo_core.types import ByteImage, GrayImage, Image

SIDE_PX = 320
"""Longest side of the picture in which the overlay is searched: thin strokes survive."""

LEAST = 6
"""Least number of frames before anything is masked."""

MEMORY = 60
"""Frames over which gradients are averaged."""

FIXED = 0.5
"""Share of its gradients' energy that a fixed edge keeps in their mean."""

LEAST_GREY = 6.0
"""Gradients below this rms, grey levels per px, may belong to the lamp's light."""

MARGIN_PX = 3
"""Margin around a fixed edge, in which a stroke blurs or a digit changes."""


class Overlay:
    """Finds what is fixed in the pictures of a film whose wall moves."""

    def __init__(self, frame_wh: tuple[int, int]) -> None:
        scale = min(1.0, SIDE_PX / max(frame_wh))
        self._size_wh = (round(frame_wh[0] * scale), round(frame_wh[1] * scale))
        self.count = 0
        self._mean: list[GrayImage] = []
        """Mean gradient along the rows and along the columns."""
        self._power: GrayImage | None = None
        """Mean squared gradient."""

    def add(self, image: Image) -> None:
        """Add a frame, (H, W) grey, whose wall has moved since the one before."""
        parts = gradient(reduce_to(image, self._size_wh))
        power = parts[0] * parts[0] + parts[1] * parts[1]
        self.count += 1
        if self._power is None:
            self._mean, self._power = [*parts], power
            return
        share = 1 / min(self.count, MEMORY)
        for mean, part in zip([*self._mean, self._power], [*parts, power], strict=True):
            cv2.accumulateWeighted(part, mean, share)

    @property
    def is_due(self) -> bool:
        """Whether the mask has changed enough since it was last due, ever more rarely."""
        return self.count >= LEAST and (self.count < MEMORY or self.count % MEMORY == 0) and (
            self.count & (self.count - 1) == 0 or self.count % 10 == 0
        )

    @property
    def mask(self) -> ByteImage | None:
        """(h, w), 1 where something fixed hides the wall; None if nothing does."""
        if self._power is None or self.count < LEAST:
            return None
        fixed = self._mean[0] ** 2 + self._mean[1] ** 2
        # Of N unrelated gradients the mean keeps 1 / N of the energy.
        share = FIXED + (1 - FIXED) / self.count
        edges = (fixed > share * self._power) & (self._power > LEAST_GREY**2)
        # Single pixels are chance; strokes and edges are longer.
        near = cv2.boxFilter(edges.astype(np.float32), -1, (5, 5), normalize=False)
        edges &= near >= 5
        if not edges.any():
            return None
        side = 2 * MARGIN_PX + 1
        return np.asarray(cv2.dilate(edges.astype(np.uint8), np.ones((side, side), np.uint8)))
