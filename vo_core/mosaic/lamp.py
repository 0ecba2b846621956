"""The light in a picture, divided out so that the wall keeps its own tones and colours."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vo_core.errors import InvalidRig
from vo_core.image.pattern import FixedPattern
from vo_core.image.resample import reduce_to
from vo_core.mosaic.optics import Optics
from vo_core.types import ByteImage, GrayImage

WALL_GREY = 118.0
"""Of a wall of mean brightness, however well it was lit."""

MEMORY = 300
"""Pictures over which the light is averaged."""

MOST_TINT = 1.5
"""By how much colour may grow in a dark picture: most of it there is noise."""

DIRT = 0.15
"""Relative brightness of dirt that takes a place most of its weight."""

_DEGREE = 4


@dataclass(frozen=True)
class Correction:
    """What to do with a picture; both arrays are of the size of the reduced picture."""

    factor: GrayImage
    """Brings the wall to about `WALL_GREY`."""
    weight: GrayImage
    """How much each place counts: as `Optics.weight`, less where dirt hides the wall."""
    tint: float
    """By how much colour grows."""


class Lamp:
    """Lamp and lens as they brighten the picture: a model that moves with the camera.

    A smooth surface (polynomials in the picture, and the resolution, which stands for the range)
    through the mean of the logarithms of many pictures, so that tones of the wall average out.
    What else is significant in that mean is dirt: it is divided out too, and counts less.

    Raises:
        InvalidRig: The camera shows hardly any wall.
    """

    def __init__(self, optics: Optics) -> None:
        rows, columns = optics.good.shape
        self._size_wh, self._weight = optics.size_wh, optics.weight
        self._cells_wh = (max(4, columns // 2), max(4, rows // 2))
        self._cell_weight = reduce_to(optics.weight, self._cells_wh)
        self._seen = reduce_to(optics.good.astype(np.float32), self._cells_wh) > 0.5
        if not self._seen.any():
            raise InvalidRig(
                "The camera shows the wall in a few places only; check the camera's fx, fy, cx "
                "and cy and the mount's tilts."
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
        """The correction of a reduced Y Cr Cb picture; the model learns from it first."""
        luma = np.ascontiguousarray(colour[..., 0])
        cells = np.log(reduce_to(luma, self._cells_wh) + np.float32(1))
        self._count = min(self._count + 1, MEMORY)
        cv2.accumulateWeighted(cells, self._mean, 1 / self._count)
        light = self._surface()
        self._dirt.add((cells - light) * self._seen)
        clear = self._dirt.remove(np.zeros_like(light))  # minus what dirt adds to the light
        factor = np.float32(WALL_GREY) * np.exp(clear - light)
        trust = np.exp(-np.square(clear / np.float32(DIRT)))
        usual = float((factor * self._cell_weight).sum() / self._cell_weight.sum())
        return Correction(
            factor=_enlarged(factor, self._size_wh),
            weight=self._weight * _enlarged(trust, self._size_wh),
            tint=min(usual, MOST_TINT),
        )

    def _surface(self) -> GrayImage:
        """The smooth part of the mean, no brighter or darker than what was seen."""
        known = self._mean[self._seen]
        surface = self._basis @ (self._project @ (self._mean * self._seen).reshape(-1))
        clipped = np.clip(surface.reshape(self._mean.shape), known.min(), known.max())
        return np.asarray(clipped, np.float32)


def evened(colour: ByteImage, factor: GrayImage, tint: float) -> ByteImage:
    """A Y Cr Cb picture with its brightness times a factor.

    Colour grows alike everywhere: where a picture is dark it is the recorder's, not the wall's.
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
