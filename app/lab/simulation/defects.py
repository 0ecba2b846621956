"""Draws defects onto the wall of a scenario at known places."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

_Image = NDArray[np.float32]

_CRACK_REFLECTANCE = 0.05
_SILT_REFLECTANCE = 0.55
_MUD_REFLECTANCE = 0.3
_WET_SHARE = 0.45
"""Reflectance of a wet stain, relative to the dry wall."""


@dataclass(frozen=True)
class Defect:
    """A defect that an inspector would tag."""

    kind: Literal["crack", "roots", "leak", "silt", "mud", "hole", "stain"]
    x_mm: float
    """Axial position of its centre; `arc_mm` is its position along the wall, 0 at the invert."""
    arc_mm: float
    length_mm: float
    """Extent along the pipe; `width_mm` is the extent across it."""
    width_mm: float


def draw_defects(
    reflectance: _Image,
    defects: tuple[Defect, ...],
    *,
    x0_mm: float,
    arc0_mm: float,
    texel_mm: float,
    seed: int,
) -> None:
    """Draw defects onto `reflectance`, whose first texel lies at (x0_mm, arc0_mm)."""
    for number, defect in enumerate(defects):
        rng = np.random.default_rng([seed, 5, number])
        window = _window(reflectance, defect, x0_mm, arc0_mm, texel_mm)
        if window.size:
            _DRAW[defect.kind](window, texel_mm, rng)


def _window(
    reflectance: _Image, defect: Defect, x0_mm: float, arc0_mm: float, texel_mm: float
) -> _Image:
    """The drawn part of the wall that the defect covers."""
    left = round((defect.x_mm - defect.length_mm / 2 - x0_mm) / texel_mm)
    top = round((defect.arc_mm - defect.width_mm / 2 - arc0_mm) / texel_mm)
    right = left + round(defect.length_mm / texel_mm)
    bottom = top + round(defect.width_mm / texel_mm)
    return reflectance[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)]


def _crack(window: _Image, texel_mm: float, rng: np.random.Generator) -> None:
    """Draw a winding gap of about 2 mm along the pipe, with two branches."""
    rows, columns = window.shape
    steps = max(columns // max(round(6 / texel_mm), 1), 2)
    gap = np.zeros(window.shape, np.float32)
    wander = np.cumsum(rng.normal(0, 1, steps))
    wander -= np.linspace(wander[0], wander[-1], steps)
    wander -= wander[steps // 2]  # the middle of the crack is the place of the defect
    vs = rows / 2 + wander * (rows / 3 / max(float(np.abs(wander).max()), 1e-9))
    us = np.linspace(0, columns - 1, steps)
    _line(gap, us, vs, 2.0 / texel_mm)
    for start in (steps // 3, 2 * steps // 3):
        along = np.arange(steps // 5 + 2)
        side = rng.choice([-1.0, 1.0])
        branch_us = us[start] + along * columns / steps
        branch_vs = vs[start] + side * along * 3.5 / texel_mm + rng.normal(0, 1, along.size)
        _line(gap, branch_us, branch_vs, 1.0 / texel_mm)
    _cover(window, _soft(gap, 0.25 / texel_mm), np.float32(_CRACK_REFLECTANCE))


def _roots(window: _Image, texel_mm: float, rng: np.random.Generator) -> None:
    """Draw threads that hang out of a joint in the middle of the window, over their shadow."""
    rows, columns = window.shape
    threads = np.zeros(window.shape, np.float32)
    shade = np.zeros(window.shape, np.float32)
    tone = np.zeros(window.shape, np.float32)
    for _ in range(round(rows * texel_mm)):
        steps = int(rng.integers(8, 26))
        heading = rng.choice([0.0, pi]) + rng.normal(0, 0.5)
        turns = heading + np.cumsum(rng.normal(0, 0.25, steps))
        reach = rng.uniform(0.3, 0.95) * columns / 2 / steps
        us = columns / 2 + np.cumsum(np.cos(turns)) * reach
        vs = rows / 2 + rng.normal(0, 0.08) * rows + np.cumsum(np.sin(turns)) * reach
        thickness = rng.uniform(0.6, 1.8) / texel_mm
        _line(shade, us + 1.2 / texel_mm, vs + 1.2 / texel_mm, thickness * 1.6)
        _line(threads, us, vs, thickness)
        _line(tone, us, vs, thickness, rng.uniform(0.12, 0.5))
    window *= 1 - 0.75 * _soft(shade, 1.0 / texel_mm)
    _cover(window, _soft(threads, 0.2 / texel_mm), _soft(tone, 0.2 / texel_mm))


def _leak(window: _Image, texel_mm: float, rng: np.random.Generator) -> None:
    """Draw wet streaks down to the invert, with a crust of lime on their border."""
    rows, columns = window.shape
    wet = np.zeros(window.shape, np.float32)
    run = np.linspace(0, rows - 1, 24)
    for _ in range(7):
        us = columns * rng.uniform(0.3, 0.7) + np.cumsum(rng.normal(0, 1.2 / texel_mm, run.size))
        _line(wet, us, run, rng.uniform(5, 14) / texel_mm)
    fade = np.clip(4 * (0.5 - np.abs(np.linspace(-0.5, 0.5, rows, dtype=np.float32))), 0, 1)
    wet = (_soft(wet, 2.5 / texel_mm) * fade[:, None]).astype(np.float32)
    window *= 1 - (1 - _WET_SHARE) * wet
    crust = np.exp(-(((wet - 0.4) / 0.2) ** 2)) * (
        0.4 + 0.3 * _noise(rng, window.shape, 6 / texel_mm)
    )
    _cover(window, np.clip(crust, 0, 0.8).astype(np.float32), np.float32(0.75))


def _silt(window: _Image, texel_mm: float, rng: np.random.Generator) -> None:
    """Draw a bank of light sand with ripples across it and a ragged edge."""
    rows, columns = window.shape
    across = np.linspace(-1, 1, rows, dtype=np.float32)[:, None]
    along = np.linspace(-1, 1, columns, dtype=np.float32)[None, :]
    ragged = 0.1 * _noise(rng, window.shape, 14 / texel_mm)
    cover = 1 / (1 + np.exp(-np.clip((0.7 - np.hypot(across, along**3) + ragged) * 25, -30, 30)))
    ripples = np.sin(along * (columns * texel_mm / 9) + _noise(rng, window.shape, 40 / texel_mm))
    grain = 0.05 * rng.standard_normal(window.shape, dtype=np.float32)
    sand = _SILT_REFLECTANCE + 0.06 * ripples + _soft(grain, 0.6)
    _cover(window, cover.astype(np.float32), sand.astype(np.float32))


def _mud(window: _Image, texel_mm: float, rng: np.random.Generator) -> None:
    """Smear the whole window with mud that shows nothing of the wall, with a ragged edge."""
    rows, columns = window.shape
    to_edge_mm = texel_mm * np.minimum(
        np.minimum(np.arange(rows), np.arange(rows)[::-1])[:, None],
        np.minimum(np.arange(columns), np.arange(columns)[::-1])[None, :],
    ).astype(np.float32)
    ragged_mm = 12 + 5 * _noise(rng, window.shape, 30 / texel_mm)
    cover = 1 / (1 + np.exp(-np.clip((to_edge_mm - ragged_mm) / 2, -30, 30)))
    shades = _MUD_REFLECTANCE + 0.01 * _noise(rng, window.shape, 150 / texel_mm)
    _cover(window, cover.astype(np.float32), shades.astype(np.float32))


def _hole(window: _Image, texel_mm: float, rng: np.random.Generator) -> None:
    """Break a hole into the wall, with a ragged edge; behind it is darkness."""
    _cover(window, _ragged(window.shape, texel_mm, rng, edge_mm=0.7), np.float32(0.04))


def _stain(window: _Image, texel_mm: float, rng: np.random.Generator) -> None:
    """Darken the wall, whose texture stays."""
    window *= 1 - 0.4 * _ragged(window.shape, texel_mm, rng, edge_mm=6.0)


def _ragged(
    shape: tuple[int, int], texel_mm: float, rng: np.random.Generator, *, edge_mm: float
) -> _Image:
    """An ellipse that fills most of the window, 1 inside, with an uneven edge."""
    rows, columns = shape
    across = np.linspace(-1, 1, rows, dtype=np.float32)[:, None]
    along = np.linspace(-1, 1, columns, dtype=np.float32)[None, :]
    away = np.hypot(across, along) + 0.06 * _noise(rng, shape, 10 / texel_mm)
    steep = min(rows, columns) * texel_mm / (2 * edge_mm)
    return np.asarray(1 / (1 + np.exp(np.clip((away - 0.85) * steep, -30, 30))), np.float32)


_DRAW = {
    "crack": _crack,
    "roots": _roots,
    "leak": _leak,
    "silt": _silt,
    "mud": _mud,
    "hole": _hole,
    "stain": _stain,
}


def _line(
    canvas: _Image,
    us: NDArray[np.float64],
    vs: NDArray[np.float64],
    width_px: float,
    value: float = 1,
) -> None:
    points = np.rint(np.stack([us, vs], axis=-1) * 16).astype(np.int32)
    cv2.polylines(canvas, [points], False, value, max(1, round(width_px)), cv2.LINE_8, 4)


def _soft(mask: _Image, sigma_px: float) -> _Image:
    return np.asarray(cv2.GaussianBlur(mask, (0, 0), max(sigma_px, 0.3)), np.float32)


def _noise(rng: np.random.Generator, shape: tuple[int, int], cell_px: float) -> _Image:
    """Smooth noise of about unit variance."""
    rows, columns = shape
    size = (int(rows / cell_px) + 2, int(columns / cell_px) + 2)
    coarse = rng.standard_normal(size, dtype=np.float32)
    return np.asarray(cv2.resize(coarse, (columns, rows), interpolation=cv2.INTER_CUBIC))


def _cover(window: _Image, share: _Image, reflectance: np.float32 | _Image) -> None:
    window *= 1 - share
    window += share * reflectance
