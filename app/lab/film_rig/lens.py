"""The lens that is sought: five numbers, what is known of them beforehand, and their camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from vo_core.rig import Camera
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

_STANDARD_DEFINITION = {(720, 480): 0.9, (704, 480): 0.91, (720, 576): 1.08, (704, 576): 1.09}
"""fy / fx of the sizes of analogue television, whose pixels are not square."""

STANDARD_DEFINITION_SIGMA = 0.02
"""The same of a picture in a size of analogue television, or whose film states that its pixels are
not square: digitisers treat them differently."""


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
    def of(cls, model: Model, size_wh: tuple[int, int], pixel_aspect: float = 1.0) -> LensPrior:
        """A usual lens in front of pictures of this size; `pixel_aspect` is what the film states,
        which for analogue television says little if it is 1.
        """
        width, height = size_wh
        aspect = pixel_aspect if pixel_aspect != 1.0 else _STANDARD_DEFINITION.get(size_wh)
        mean = [
            np.log(USUAL_FOCAL[model] * width), 0.0, (width - 1) / 2, (height - 1) / 2,
            np.log(aspect or 1.0),
        ]  # fmt: skip
        centre_px = CENTRE_SIGMA * width
        sigma = [
            FOCAL_SIGMA, BEND_SIGMA[model], centre_px, centre_px,
            STANDARD_DEFINITION_SIGMA if aspect else SQUARE_SIGMA,
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
