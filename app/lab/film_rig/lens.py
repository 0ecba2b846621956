"""The lens that is sought: five numbers, what is known of them beforehand, and their camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from vo_core import VideoInfo
from vo_core.rig import Camera
from vo_core.sources import square_size
from vo_core.types import Matrix

Model = Literal["pinhole", "fisheye"]

LENS = 5
"""Number of parameters: logarithm of the focal length, distortion, principal point, logarithm of
fy / fx."""

FOCAL, BEND, CENTRE, ASPECT = 0, 1, slice(2, 4), 4
"""Places of the parameters in their vector."""

USUAL_FOCAL = {"pinhole": 0.8, "fisheye": 0.4}
"""Focal length of a usual lens, as a share of the picture's width: 64 degrees, and 143 degrees."""

FOCAL_SIGMA = 0.3
"""Relative standard deviation of the focal lengths of usual lenses."""

BEND_SIGMA = {"pinhole": 0.15, "fisheye": 0.05}
"""Standard deviation of the distortion k1 of usual lenses."""

CENTRE_SIGMA = 0.03
"""Standard deviation of a principal point from the middle, as a share of the picture's width."""

SQUARE_SIGMA = 0.003
"""Standard deviation of fy / fx of a camera with square pixels."""

STATED_SIGMA = 0.02
"""The same of other films, after their pictures were made square: digitisers of analogue television
treat the shape of the pixels differently."""

_STANDARD_DEFINITION = {(720, 480): 0.9, (704, 480): 0.91, (720, 576): 1.08, (704, 576): 1.09}
"""Width by height of the pixels of analogue television, for films that do not state it."""


@dataclass(frozen=True)
class Pixels:
    """The pixels of a film. The wall is followed in pictures with square ones."""

    size_wh: tuple[int, int]
    aspect: float
    """Width of a pixel by its height."""

    @classmethod
    def of(cls, info: VideoInfo) -> Self:
        """Return what a film states, or what is usual where it states nothing."""
        size_wh = info.width, info.height
        usual = _STANDARD_DEFINITION.get(size_wh, 1.0)
        return cls(size_wh, usual if info.pixel_aspect == 1.0 else info.pixel_aspect)

    @property
    def square_wh(self) -> tuple[int, int]:
        """Size of the pictures with square pixels."""
        return square_size(self.size_wh, self.aspect)

    def camera(self, square: Camera) -> Camera:
        """Return the camera of the film, of one before pictures with square pixels."""
        width, height = self.size_wh
        wide, high = self.square_wh[0] / width, self.square_wh[1] / height
        fields = {
            "width": width,
            "height": height,
            "fx": square.fx / wide,
            "fy": square.fy / high,
            "cx": (square.cx + 0.5) / wide - 0.5,
            "cy": (square.cy + 0.5) / high - 0.5,
        }
        return Camera.parse(square.model_dump() | fields)


@dataclass(frozen=True)
class LensPrior:
    """What is known of a lens before the film is looked at."""

    model: Model
    size_wh: tuple[int, int]
    mean: Matrix
    """(5,) the most probable parameters."""
    sigma: Matrix
    """(5,) their standard deviations, independent of each other."""

    @classmethod
    def of(cls, model: Model, pixels: Pixels) -> LensPrior:
        """A usual lens in front of the pictures with square pixels."""
        width, height = size_wh = pixels.square_wh
        mean = [np.log(USUAL_FOCAL[model] * width), 0.0, (width - 1) / 2, (height - 1) / 2, 0.0]
        centre_px = CENTRE_SIGMA * width
        sigma = [
            FOCAL_SIGMA, BEND_SIGMA[model], centre_px, centre_px,
            SQUARE_SIGMA if pixels.aspect == 1.0 else STATED_SIGMA,
        ]  # fmt: skip
        return cls(model, size_wh, np.array(mean), np.array(sigma))

    def camera(self, lens: Matrix) -> Camera:
        """The camera with these parameters, (5,)."""
        # A step of the fit may go too far; the fit then takes it back.
        focal_px = self.size_wh[0] * float(np.clip(np.exp(lens[FOCAL]) / self.size_wh[0], 0.05, 20))
        cx, cy = np.clip(lens[CENTRE], -8192, 16384).tolist()
        return Camera.parse(
            {
                "model": self.model,
                "width": self.size_wh[0],
                "height": self.size_wh[1],
                "fx": focal_px,
                "fy": focal_px * float(np.clip(np.exp(lens[ASPECT]), 0.5, 2.0)),
                "cx": cx,
                "cy": cy,
                "distortion": [float(np.clip(lens[BEND], -10, 10)), 0.0, 0.0, 0.0],
            }
        )
