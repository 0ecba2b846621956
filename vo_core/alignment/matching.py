"""Where a patch of one wall lies on another: correlation with its own measure of chance.

With both textures 0 where nothing was seen, the masked correlation

    c(d) = sum a(x + d) b(x) / sqrt(sum a(x + d)^2 m_b(x) * sum m_a(x + d) b(x)^2)

is compared with what chance gives. The sums run over n(d) places, so sqrt(n) c has the same spread
at every d where nothing matches, however periodic the texture is; that spread is taken from the
surface itself, over all shifts. z = sqrt(n) c / spread is then normal, and

    log odds = z^2 / 2 - ln(number of shifts that were looked at)

of the match against chance. A second peak that is nearly as good makes a match no match, whatever
its odds.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, sqrt

import cv2
import numpy as np

from vo_core.types import GrayImage, Matrix

LEAST_OVERLAP = 0.35
"""Share of the largest overlap of patch and wall that must be left at a shift."""

_LEAST_PX = 400
"""Fewer common pixels say nothing."""

_APART_PX = 5
"""Two peaks are different places if they lie more than this apart."""

_ROOT2_MEDIAN = 0.6745
"""The median of the absolute value of a standard normal variable."""


@dataclass(frozen=True)
class Match:
    """The best place of a patch on a wall."""

    along_px: float
    """Column of the wall at which the first column of the patch lies, with fractions."""
    around_px: float
    """Likewise the row."""
    odds: float
    """Log odds against chance."""
    lead: float
    """Log odds against the next best place, at least some pixels away."""
    sigma_px: tuple[float, float]
    """Standard uncertainty along and around, by noise alone."""


def match(
    wall: tuple[GrayImage, GrayImage],
    patch: tuple[GrayImage, GrayImage],
    *,
    columns: tuple[int, int],
    rows: tuple[int, int],
    is_ring: bool = False,
) -> Match | None:
    """Find a patch on a wall.

    Args:
        wall: Texture and 1 where seen, (H, W).
        patch: Likewise, (h, w).
        columns: First and last shift along that is looked at.
        rows: Likewise around; with `is_ring` a shift is modulo H.
        is_ring: Whether the rows of the wall are a ring.
    Returns:
        None if the patch and the wall have too little in common.
    """
    (a, seen_a), (b, seen_b) = wall, patch
    height = a.shape[0] if is_ring else cv2.getOptimalDFTSize(a.shape[0] + b.shape[0])
    width = cv2.getOptimalDFTSize(a.shape[1] + b.shape[1])
    shape = (height, width)

    def spectrum(image: GrayImage) -> np.ndarray:
        return np.fft.rfft2(image, shape)

    def correlated(of_wall: np.ndarray, of_patch: np.ndarray) -> Matrix:
        return np.asarray(np.fft.irfft2(of_wall * of_patch.conj(), shape))

    mask_a, mask_b = spectrum(seen_a), spectrum(seen_b)
    count = correlated(mask_a, mask_b)
    energy = correlated(spectrum(a * a), mask_b) * correlated(mask_a, spectrum(b * b))
    is_enough = count >= max(LEAST_OVERLAP * float(count.max()), _LEAST_PX)
    with np.errstate(divide="ignore", invalid="ignore"):
        surface = np.where(
            is_enough & (energy > 1e-6),
            correlated(spectrum(a), spectrum(b)) * np.sqrt(count) / np.sqrt(energy),
            0.0,
        )
    values = np.abs(surface[is_enough])
    if values.size < 16 or not values.any():
        return None
    spread = float(np.median(values)) / _ROOT2_MEDIAN
    spread = max(spread, float(np.sqrt(np.mean(np.square(values)))) / 2, 1e-9)
    z = surface / spread
    at_row, at_column = (
        np.arange(low, high + 1) % size for (low, high), size in ((rows, height), (columns, width))
    )
    window = z[np.ix_(at_row, at_column)]
    r, c = (int(i) for i in np.unravel_index(int(np.argmax(window)), window.shape))
    best = float(window[r, c])
    if best <= 0:
        return None
    rival = window.copy()
    rival[max(0, r - _APART_PX) : r + _APART_PX + 1, max(0, c - _APART_PX) : c + _APART_PX + 1] = 0
    second = max(float(rival.max()), 0.0)
    (dr, sigma_r), (dc, sigma_c) = _refined(z, int(at_row[r]), int(at_column[c]))
    return Match(
        along_px=columns[0] + c + dc,
        around_px=rows[0] + r + dr,
        odds=best * best / 2 - log(window.size),
        lead=(best * best - second * second) / 2,
        sigma_px=(sigma_c, sigma_r),
    )


def _refined(z: Matrix, row: int, column: int) -> tuple[tuple[float, float], tuple[float, float]]:
    """Place of the peak between the pixels by a parabola, with its sigma: around, along.

    Noise with the spectrum of the texture moves a peak of height z and curvature k by
    1 / sqrt(z k).
    """
    height, width = z.shape
    peak = z[row, column]
    found = []
    for before, after in (
        (z[(row - 1) % height, column], z[(row + 1) % height, column]),
        (z[row, (column - 1) % width], z[row, (column + 1) % width]),
    ):
        curvature = max(2 * peak - before - after, 1e-6)
        shift = float(np.clip((after - before) / (2 * curvature), -0.5, 0.5))
        found.append((shift, float(1 / sqrt(peak * curvature))))
    return found[0], found[1]
