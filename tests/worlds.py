"""Walls of synthetic texture, seen by any rig from any pose: the truth comes from ray casting
alone.

The rays are the renderer's (`app.lab.simulation.camera`), not those of `vo_core`. The texture is
drawn three times finer than the picture and sampled bilinearly, which moves nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from textures import make_rig, texture

from app.lab.simulation.camera import WallCaster
from vo_core import Odometry, Pose, Rig, Track

FloatImage = NDArray[np.float32]

FINER = 3
WALL_SHAPE = (1024, 2048)
"""Texels around and along; beyond that the wall repeats."""

MEAN_GREY = 110.0
FRAME_S = 1 / 30

SMALL = {"width": 320, "height": 240, "fx": 266.0, "fy": 266.0, "cx": 159.5, "cy": 119.5}
"""A quarter of VGA, 62 degrees wide: what the odometry reduces larger pictures to."""


def small_rig(**parts: dict[str, Any]) -> Rig:
    """Return a small camera 150 mm above the invert of a 300 mm pipe, with some parts changed."""
    mount = {"height_mm": 150.0} | parts.pop("mount", {})
    return make_rig(camera=SMALL | parts.pop("camera", {}), mount=mount, **parts)


def floor_rig(**parts: dict[str, Any]) -> Rig:
    """Return the camera above a flat floor: 0.56 mm a pixel everywhere."""
    return small_rig(pipe={"shape": "flat", "diameter_mm": None}, **parts)


@lru_cache(maxsize=4)
def speckle(seed: int) -> FloatImage:
    """A wall of zero mean and unit deviation whose smallest grains measure a few pixels."""
    return texture(WALL_SHAPE, seed, finest_px=FINER).astype(np.float32)


class World:
    """A wall and a camera in front of it."""

    def __init__(self, rig: Rig, wall: FloatImage, contrast_grey: float = 20.0) -> None:
        self.rig = rig
        self.wall = wall
        """(around, along), of unit deviation."""
        self.contrast_grey = contrast_grey
        self._caster = WallCaster(rig)

    @property
    def mm_per_px(self) -> float:
        """Scale of the picture's centre on the wall below the camera."""
        return self.rig.mount.height_mm / self.rig.camera.fx

    def places_mm(
        self, x_mm: float = 0.0, y_mm: float = 0.0, yaw_deg: float = 0.0
    ) -> tuple[FloatImage, FloatImage]:
        """Return wall coordinates (along, around) under each pixel from a pose."""
        ahead, arc, _ = self._caster.cast(Pose(x_mm, y_mm, float(np.radians(yaw_deg))))
        return ahead + np.float32(x_mm), arc

    def light(self, places_mm: tuple[FloatImage, FloatImage]) -> FloatImage:
        """Return the grey levels of those places."""
        per_mm = np.float32(FINER / self.mm_per_px)
        along, around = (place * per_mm for place in places_mm)
        seen = cv2.remap(self.wall, along, around, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        return np.float32(MEAN_GREY) + np.float32(self.contrast_grey) * seen

    def view(self, x_mm: float = 0.0, y_mm: float = 0.0, yaw_deg: float = 0.0) -> FloatImage:
        """Return the light on the sensor at a pose."""
        return self.light(self.places_mm(x_mm, y_mm, yaw_deg))


def glass(rig: Rig, *, dust: int = 25, seed: int = 0) -> FloatImage:
    """Return the transmission of lamp spot, vignette and dust, fixed to the picture: 0 to 1."""
    height, width = rig.camera.height, rig.camera.width
    v, u = np.indices((height, width), np.float32) / np.float32(width)
    spot = 0.4 + 0.6 * np.exp(-((u - 0.55) ** 2 + (v - 0.33) ** 2) / (2 * 0.3**2))
    vignette = 1 - 0.8 * ((u - 0.5) ** 2 + (v - 0.37) ** 2)
    rng = np.random.default_rng(seed)
    specks = np.zeros((height, width), np.float32)
    for _ in range(dust):
        centre = rng.integers((0, 0), (width, height)).tolist()
        cv2.circle(specks, centre, int(rng.integers(1, 5)), float(rng.uniform(0.2, 0.6)), -1)
    return np.asarray(spot * vignette * (1 - cv2.GaussianBlur(specks, (0, 0), 1.0)), np.float32)


def stored(light: FloatImage, seed: int, noise_grey: float = 1.5) -> NDArray[np.uint8]:
    """Return the picture that a noisy sensor makes of the light."""
    noise = np.random.default_rng(seed).standard_normal(light.shape, np.float32)
    return np.clip(np.rint(light + np.float32(noise_grey) * noise), 0, 255).astype(np.uint8)


def follow(rig: Rig, images: Iterable[Any], times_s: Iterable[float] | None = None) -> Track:
    """Return the track of a sequence of pictures, at even times if none are given."""
    odometry = Odometry(rig)
    if times_s is None:
        return Track.from_estimates(
            [odometry.step(image, n * FRAME_S) for n, image in enumerate(images)]
        )
    return Track.from_estimates(
        [odometry.step(image, t_s) for image, t_s in zip(images, times_s, strict=True)]
    )


def rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
