"""The relief of a corrugated metal pipe: where rays first meet it, and how its slopes are lit.

The depth beyond the crests is d / 2 (1 - cos(2 pi x / p)), so that a crest stands at x = 0.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from vo_core.rig import Corrugation

FloatImage = NDArray[np.float32]

_STEPS = 16
"""Places looked at on the way of a ray through the relief; the flattest crosses 1.3 waves."""

_HALVINGS = 9
"""Of the last step, down to a hundredth of a millimetre."""

_LAMP_BEHIND_MM = 60.0
"""How far the lamp stands behind the camera, so that one side of a crest is brighter."""

_DIRECT = 0.8
"""Share of the light that comes straight from the lamp."""


def range_to_relief(
    corrugation: Corrugation,
    radius_mm: float,
    crests_mm: FloatImage,
    *,
    eye_mm: tuple[NDArray[np.float64], np.float32, np.float32],
    towards: tuple[FloatImage, FloatImage, FloatImage],
) -> FloatImage:
    """Range at which each ray first meets the wall, (H, W).

    Args:
        corrugation: The waves.
        radius_mm: Radius at the crests.
        crests_mm: Range of the cylinder through the crests, (H, W).
        eye_mm: Camera along the pipe, (1, 1) or (H, 1), and to the right of its axis and below it.
        towards: Directions of the rays: along the pipe, to the right and down.
    """
    (x_mm, y0, z0), (dx, dy, dz) = eye_mm, towards
    start = np.float32(x_mm % corrugation.pitch_mm)
    k = np.float32(2 * pi / corrugation.pitch_mm)
    middle_mm = np.float32(radius_mm + corrugation.depth_mm / 2)
    half_mm = np.float32(corrugation.depth_mm / 2)
    # Squared distance from the axis: c + 2 b t + a t^2.
    a, b, c = dy * dy + dz * dz, y0 * dy + z0 * dz, y0 * y0 + z0 * z0
    np.maximum(a, np.float32(1e-9), out=a)

    def is_beyond(t: FloatImage) -> NDArray[np.bool_]:
        wall_mm = middle_mm - half_mm * np.cos(k * (start + t * dx))
        return np.asarray((a * t + 2 * b) * t + c >= wall_mm * wall_mm)

    valleys_mm = (np.sqrt(b * b - a * (c - (middle_mm + half_mm) ** 2)) - b) / a
    step = np.asarray((valleys_mm - crests_mm) / np.float32(_STEPS), np.float32)
    inside_mm = crests_mm.copy()
    is_inside = np.ones(crests_mm.shape, bool)
    for number in range(1, _STEPS):
        t = np.asarray(crests_mm + np.float32(number) * step, np.float32)
        is_inside &= ~is_beyond(t)
        inside_mm[is_inside] = t[is_inside]
    for _ in range(_HALVINGS):
        step *= np.float32(0.5)
        t = inside_mm + step
        inside_mm = np.where(is_beyond(t), inside_mm, t)
    return np.asarray(inside_mm + step / 2, np.float32)


def shade(
    corrugation: Corrugation,
    x_mm: NDArray[np.float64],
    ahead_mm: FloatImage,
    range_mm: FloatImage,
) -> FloatImage:
    """Light on the relief over that on a smooth wall, for a camera at `x_mm`, (H, W).

    Lambert's law for a lamp behind the camera, for which the wall's tilt lies in the plane of the
    ray and the axis.
    """
    phase = np.float32(2 * pi / corrugation.pitch_mm) * (
        ahead_mm + np.float32(x_mm % corrugation.pitch_mm)
    )
    slope = np.float32(pi * corrugation.depth_mm / corrugation.pitch_mm) * np.sin(phase)
    out_mm = np.sqrt(np.maximum(range_mm * range_mm - ahead_mm * ahead_mm, 1))
    along_mm = ahead_mm + np.float32(_LAMP_BEHIND_MM)
    lit_mm = np.maximum(out_mm - slope * along_mm, 0) / np.sqrt(1 + slope * slope)
    relative = (lit_mm - out_mm) / np.hypot(out_mm, along_mm)
    return np.asarray(1 + np.float32(_DIRECT) * relative, np.float32)
