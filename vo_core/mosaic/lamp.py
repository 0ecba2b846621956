"""Divides the light out of a picture, so that the wall keeps its own tones and colours."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vo_core.errors import NoWallInView
from vo_core.image.pattern import FixedPattern
from vo_core.image.resample import reduce_to
from vo_core.mosaic.optics import Optics
from vo_core.types import ByteImage, GrayImage

WALL_GREY = 118.0
"""Grey level of a wall of mean brightness, however it was lit."""

MEMORY = 300
"""Number of pictures over which the light is averaged."""

MOST_TINT = 1.5
"""Largest gain of the colour in a dark picture, where most of it is noise."""

DIRT = 0.15
"""Relative brightness of dirt that removes most of a place's weight."""

_DEGREE = 4
"""Degree of the polynomial in the picture."""


@dataclass(frozen=True)
class Correction:
    """Correction of one picture; both arrays have the size of the reduced picture."""

    factor: GrayImage
    """Factor of the brightness, which brings the wall to about `WALL_GREY`."""
    weight: GrayImage
    """Weight of each place: `Optics.weight`, reduced where dirt hides the wall."""
    tint: float
    """Factor of the colour."""


class Lamp:
    """Model of the brightness by lamp and lens, which moves with the camera.

    A smooth surface (polynomials in the picture, and in the resolution as a measure of the range)
    is fitted to the mean of the logarithms of many pictures, in which tones of the wall average
    out. What else is significant in that mean is dirt: it is divided out too, and gets less weight.

    Raises:
        NoWallInView: The camera shows hardly any wall.
    """

    def __init__(self, optics: Optics) -> None:
        rows, columns = optics.good.shape
        self._size_wh, self._weight = optics.size_wh, optics.weight
        self._cells_wh = (max(4, columns // 2), max(4, rows // 2))
        self._cell_weight = reduce_to(optics.weight, self._cells_wh)
        self._seen = reduce_to(optics.good.astype(np.float32), self._cells_wh) > 0.5
        if not self._seen.any():
            raise NoWallInView(
                "With this rig the camera sees the wall in a few places only. Check which way it "
                "looks, its tilts, and that the lens is that of this film."
            )
        log_resolution = reduce_to(optics.log_resolution.astype(np.float32), self._cells_wh)
        x, y = np.meshgrid(*(np.linspace(-1, 1, side) for side in self._cells_wh))
        terms = [x**i * y**j for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)]
        terms += [log_resolution.astype(np.float64), log_resolution.astype(np.float64) ** 2]
        self._basis = np.stack(terms, -1).reshape(-1, len(terms))
        seen = self._basis * self._seen.reshape(-1, 1)
        ridge = 1e-6 * len(seen) * np.eye(len(terms))  # without uneven optics two terms are 0
        self._project = np.linalg.solve(seen.T @ seen + ridge, seen.T)
        self._mean = np.zeros(self._seen.shape, np.float32)
        self._count = 0
        self._dirt = FixedPattern()

    def learn(self, colour: ByteImage) -> Correction:
        """Add a reduced Y Cr Cb picture to the model, and return its correction."""
        luma = np.ascontiguousarray(colour[..., 0])
        cells = np.log(reduce_to(luma, self._cells_wh) + np.float32(1))
        self._count = min(self._count + 1, MEMORY)
        cv2.accumulateWeighted(cells, self._mean, 1 / self._count)
        light = self._surface()
        self._dirt.add((cells - light) * self._seen)
        clear = self._dirt.remove(np.zeros_like(light))  # minus the brightness that dirt adds
        factor = np.float32(WALL_GREY) * np.exp(clear - light)
        trust = np.exp(-np.square(clear / np.float32(DIRT)))
        usual = float((factor * self._cell_weight).sum() / self._cell_weight.sum())
        return Correction(
            factor=_enlarged(factor, self._size_wh),
            weight=self._weight * _enlarged(trust, self._size_wh),
            tint=min(usual, MOST_TINT),
        )

    def _surface(self) -> GrayImage:
        """Smooth part of the mean, within the range of the values seen."""
        known = self._mean[self._seen]
        surface = self._basis @ (self._project @ (self._mean * self._seen).reshape(-1))
        clipped = np.clip(surface.reshape(self._mean.shape), known.min(), known.max())
        return np.asarray(clipped, np.float32)


def evened(colour: ByteImage, factor: GrayImage, tint: float) -> ByteImage:
    """Multiply the brightness of a Y Cr Cb picture by `factor` and its colour by `tint`.

    The colour has one factor everywhere, because in dark parts it belongs to the recorder and not
    to the wall.
    """
    luma, red, blue = cv2.split(colour)
    grey = 128 * (1 - tint)
    parts = [
        cv2.multiply(luma, factor, dtype=cv2.CV_8U),
        cv2.convertScaleAbs(red, alpha=tint, beta=grey),
        cv2.convertScaleAbs(blue, alpha=tint, beta=grey),
    ]
    return np.asarray(cv2.merge(parts), np.uint8)


def _enlarged(image: GrayImage, size_wh: tuple[int, int]) -> GrayImage:
    return np.asarray(cv2.resize(image, size_wh, interpolation=cv2.INTER_LINEAR), np.float32)
