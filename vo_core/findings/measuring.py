"""Length and width of a crack, by the profile across its line."""

from __future__ import annotations

from math import erf, hypot

import cv2
import numpy as np

from vo_core.findings.finding import Direction, Size
from vo_core.findings.surface import Surface
from vo_core.types import Matrix

REACH_MM = 6.0
"""How far a profile goes to either side of the line."""

GAP_DEPTH, DEPTH_SIGMA = 0.85, 0.1
"""Light that a gap lacks, as a share of the wall's, before its own profile says more."""

SHARPNESS_PX = 0.8
"""Blur of the wall by lens, painting and coding, sigma in its own pixels."""

SMOOTH_MM, SMOOTH_PX = 4.0, 3.0
"""Least sigma along which the steps of pixels are taken out of a line: they would lengthen it."""

END_MM = 3.0
"""Standard uncertainty of where a line ends."""

PATH_SHARE = 0.03
"""Standard uncertainty of a winding line's length, relative."""

OBLIQUE_DEG = 30.0
"""A line within this of an axis runs along it."""


def smoothed(line: Matrix, step_mm: float) -> Matrix:
    """Take the steps of the raster out of a line (n, 2); its ends stay."""
    sigma = max(SMOOTH_MM / step_mm, SMOOTH_PX)
    reach = min(int(3 * sigma), len(line) - 1)
    if reach < 1:
        return line
    kernel = cv2.getGaussianKernel(2 * reach + 1, sigma)[:, 0]
    # Reflected through its ends, so that they stay where they are.
    padded = np.vstack(
        [2 * line[0] - line[reach:0:-1], line, 2 * line[-1] - line[-2 : -reach - 2 : -1]]
    )
    return np.stack([np.convolve(padded[:, k], kernel, "valid") for k in (0, 1)], 1)


def length_of(line_mm: Matrix) -> Size:
    """Length of a line (n, 2) in mm."""
    mm = float(np.hypot(*np.diff(line_mm, axis=0).T).sum())
    return Size(mm, hypot(2**0.5 * END_MM, PATH_SHARE * mm))


def direction_of(line_mm: Matrix) -> Direction:
    """Direction of the chord of a line (n, 2) in mm."""
    along, around = np.abs(line_mm[-1] - line_mm[0]).tolist()
    degrees = float(np.degrees(np.arctan2(around, along)))
    if degrees < OBLIQUE_DEG:
        return "along"
    return "across" if degrees > 90 - OBLIQUE_DEG else "oblique"


def measured(surface: Surface, line_px: Matrix) -> tuple[Matrix, Size]:
    """The part of a line that is dark, and the width of the crack there.

    A filter answers beyond the end of a crack; the line ends where half of the darkness does.

    Args:
        surface: The wall.
        line_px: (n, 2) columns and rows on it.
    """
    step_mm = float(surface.step_mm.mean())
    profiles, offsets_mm = _profiles(surface, line_px)
    core = np.abs(offsets_mm) <= REACH_MM / 2
    wall = np.median(profiles[:, ~core], axis=1, keepdims=True)
    lack = (1 - profiles / np.maximum(wall, 1))[:, core]
    areas = lack.sum(axis=1) * (offsets_mm[1] - offsets_mm[0])
    dark = np.flatnonzero(np.convolve(areas, [1 / 3] * 3, "same") > np.median(areas) / 2)
    if len(dark) > 1:
        kept = slice(int(dark[0]), int(dark[-1]) + 1)
        line_px, lack, areas = line_px[kept], lack[kept], areas[kept]
    darkest = float(np.median(lack.max(axis=1)))
    blur_mm = hypot(SHARPNESS_PX * surface.patch.mm_per_px, step_mm * 12**-0.5)
    area = max(float(np.median(areas)), 0.0)
    return line_px, gap_of(area, _scatter(areas), darkest, blur_mm)


def gap_of(area_mm: float, area_sigma_mm: float, darkest: float, blur_mm: float) -> Size:
    """Width of a gap that lacks `area_mm` of light in all, and `darkest` where it is darkest.

    A gap of width w that lacks the share d of the wall's light lacks w d in all, however blurred
    the picture is. Blurred with sigma s, its darkest place lacks d erf(w / (2 sqrt(2) s)); where
    the gap is wide enough, this tells d, otherwise d is what gaps usually have.
    """
    depth, sigma = GAP_DEPTH, DEPTH_SIGMA
    for _ in range(8):
        resolved = erf(area_mm / depth / (8**0.5 * blur_mm))
        own_sigma = DEPTH_SIGMA / max(resolved, 1e-3) ** 2
        trust = DEPTH_SIGMA**-2 + own_sigma**-2
        own = min(darkest / max(resolved, 1e-3), 1.0)
        depth = (GAP_DEPTH * DEPTH_SIGMA**-2 + own * own_sigma**-2) / trust
        depth, sigma = max(depth, 0.2), trust**-0.5
    width_mm = area_mm / depth
    return Size(width_mm, hypot(area_sigma_mm / depth, width_mm * sigma / depth))


def _scatter(values: Matrix) -> float:
    """Standard uncertainty of a median along a line, of which every 10th value is independent."""
    deviation = 1.4826 * float(np.median(np.abs(values - np.median(values))))
    return float(1.25 * deviation / max(len(values) / 10, 1) ** 0.5)


def _profiles(surface: Surface, line_px: Matrix) -> tuple[Matrix, Matrix]:
    """Brightness (n, m) across the line, and the m offsets in mm."""
    ahead = np.gradient(line_px, axis=0) * surface.step_mm
    ahead /= np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    normal_px = np.stack([-ahead[:, 1], ahead[:, 0]], 1) / surface.step_mm
    offsets_mm = np.linspace(-REACH_MM, REACH_MM, 49)
    places = line_px[:, None] + offsets_mm[:, None] * normal_px[:, None]
    grey = cv2.cvtColor(surface.image, cv2.COLOR_BGR2GRAY)
    profiles = cv2.remap(
        grey,
        places[..., 0].astype(np.float32),
        places[..., 1].astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return profiles.astype(np.float64), offsets_mm
