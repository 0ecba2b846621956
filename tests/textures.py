"""Synthetic textures and rigs with known truth: shifts by the Fourier theorem, without
resampling.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.lab.simulation import SCENARIOS
from vo_core import Rig

Texture = NDArray[np.float64]


def rig_fields(**parts: dict[str, Any]) -> dict[str, Any]:
    """The rig of the design document and of the nominal scenario, with some parts changed."""
    fields = SCENARIOS["nominal"].rig.model_dump(exclude_unset=True)
    for part, changed in parts.items():
        fields[part] = fields[part] | changed
    return fields


def make_rig(**parts: dict[str, Any]) -> Rig:
    return Rig.parse(rig_fields(**parts))


def texture(shape: tuple[int, int], seed: int, finest_px: float = 1.5) -> Texture:
    """Return periodic noise of four octaves, zero mean, unit deviation."""
    rng = np.random.default_rng(seed)
    fy, fx = np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None, :]
    layers = []
    for sigma_px in finest_px * np.array([1, 2, 4, 8]):
        filtered = np.exp(-2 * (np.pi * sigma_px) ** 2 * (fx**2 + fy**2))
        layer = np.fft.irfft2(np.fft.rfft2(rng.normal(size=shape)) * filtered, shape)
        layers.append(layer / layer.std())
    total = sum(layers)
    return np.asarray(total / np.std(total))


def shifted(image: Texture, dx_px: float, dy_px: float) -> Texture:
    """Return the content moved by (dx, dy), exactly, wrapping at the border."""
    fy, fx = np.fft.fftfreq(image.shape[0])[:, None], np.fft.rfftfreq(image.shape[1])[None, :]
    phase = np.exp(-2j * np.pi * fx * dx_px) * np.exp(-2j * np.pi * fy * dy_px)
    return np.asarray(np.fft.irfft2(np.fft.rfft2(image) * phase, image.shape))


def pair(
    shape: tuple[int, int],
    shift_px: tuple[float, float],
    *,
    seed: int = 0,
    contrast_grey: float = 25.0,
    noise_grey: float = 0.0,
    finest_px: float = 1.5,
) -> tuple[Texture, Texture]:
    """Return two views, grey levels about 110, of one texture moved by `shift_px`, without a
    visible wrap.
    """
    margin = 8 + int(max(abs(shift_px[0]), abs(shift_px[1])))
    whole = texture((shape[0] + 2 * margin, shape[1] + 2 * margin), seed, finest_px)
    inside = np.s_[margin : margin + shape[0], margin : margin + shape[1]]
    rng = np.random.default_rng(seed + 1000)
    views = (whole, shifted(whole, *shift_px))
    a, b = (110 + contrast_grey * v[inside] + noise_grey * rng.normal(size=shape) for v in views)
    return a, b
