"""What the picture shows besides the wall: burnt-in text and the robot's own parts.

A film that looks along the pipe carries a counter, a date and often a bumper or a lamp.  They stay
in their place while the wall moves, so the mean of their gradients over some frames is as large as
the gradients themselves; the gradients of a moving wall average out.  Digits that change share
their box and most of their strokes.
"""

from __future__ import annotations

import cv2
import numpy as np

from vo_core.image.filters import gradient, magnitude
from vo_core.image.pattern import LEAST_FRAMES
from vo_core.image.resample import reduce_to
from vo_core.types import ByteImage, GrayImage, Image

FIXED = 0.5
"""Share of its gradients' energy that a fixed edge keeps in their mean."""

STILL = 0.5
"""A picture has moved once the directions of its gradients agree by less: the mean cosine."""


class Overlay:
    """Finds what is fixed in the pictures of a film whose wall moves."""

    def __init__(self, frame_wh: tuple[int, int]) -> None:
        # Longest side of the picture in which the overlay is searched: thin strokes survive.
        side_px = 320
        scale = min(1.0, side_px / max(frame_wh))
        self._size_wh = (round(frame_wh[0] * scale), round(frame_wh[1] * scale))
        self._count = 0
        self._last: tuple[GrayImage, GrayImage] | None = None
        """Directions of the gradients in the last frame that counted, along rows and columns."""
        self._mean: list[GrayImage] = []
        """Mean gradient along the rows and along the columns."""
        self._power: GrayImage | None = None
        """Mean squared gradient."""
        self.mask: ByteImage | None = None
        """(h, w), 1 where something fixed hides the wall; None if nothing does."""

    def add(self, image: Image) -> bool:
        """Add the next frame, (H, W) grey; return whether it changes the mask.

        Only frames count in which most of the picture has moved: a camera that stands shows nothing
        but fixed edges.
        """
        # Least share of the picture with gradients in both of two frames, to see whether it has
        # moved.
        least_shown = 0.02
        least_texture = 1.0  # gradients below this, grey levels per px, are noise
        memory = 60  # frames over which gradients are averaged
        along, down = gradient(reduce_to(image, self._size_wh))
        size = magnitude(along, down)
        shown = size > least_texture
        scale = shown / np.maximum(size, least_texture)
        now = (along * scale).astype(np.float32), (down * scale).astype(np.float32)
        if self._last is not None:
            both = np.count_nonzero(shown & ((self._last[0] != 0) | (self._last[1] != 0)))
            alike = float((now[0] * self._last[0] + now[1] * self._last[1]).sum())
            if both < least_shown * size.size or alike > STILL * both:
                return False
        self._last = now
        power = size * size
        self._count += 1
        if self._power is None:
            self._mean, self._power = [along, down], power
            return False
        share = 1 / min(self._count, memory)
        for mean, part in zip([*self._mean, self._power], [along, down, power], strict=True):
            cv2.accumulateWeighted(part, mean, share)
        if self._count < LEAST_FRAMES or (
            self._count > 2 * LEAST_FRAMES and self._count % LEAST_FRAMES
        ):
            return False
        before, self.mask = self.mask, self._fixed()
        return before is not None or self.mask is not None

    def _fixed(self) -> ByteImage | None:
        margin_px = 3  # margin around a fixed edge, in which a stroke blurs or a digit changes
        long_px = 5  # least number of pixels of an edge within 5 by 5
        least_grey = 6.0  # rms gradients below this, per px, may belong to the lamp's light
        assert self._power is not None  # noqa: S101  (frames have been added)
        kept = self._mean[0] ** 2 + self._mean[1] ** 2
        # Of N unrelated gradients the mean keeps 1 / N of the energy.
        share = FIXED + (1 - FIXED) / self._count
        edges = (kept > share * self._power) & (self._power > least_grey**2)
        # Single pixels are chance; strokes and edges are longer.
        near = cv2.boxFilter(edges.astype(np.float32), -1, (5, 5), normalize=False)
        edges &= near >= long_px
        if not edges.any():
            return None
        side = 2 * margin_px + 1
        return np.asarray(cv2.dilate(edges.astype(np.uint8), np.ones((side, side), np.uint8)))
