"""Filters on pictures: local normalisation, low-pass, gradient, window."""

from __future__ import annotations

import cv2
import numpy as np

from vo_core.image.resample import reduce_to
from vo_core.types import ByteImage, GrayImage

BLACK_GREY = 2.0
"""Grey levels added to the light, so that black areas get no contrast."""

LIGHT_PX = 24.0
"""Sigma of the Gaussian that separates the light from the texture."""

NEIGHBOURHOOD_PX = 8.0
"""Sigma of the neighbourhood in which contrast is normalised."""


def normalise(image: GrayImage) -> GrayImage:
    """Remove gain, shading and lamp spot, and give the texture the same strength everywhere.

    n = d / (sqrt(G d^2) + floor) with d = r - G r and r = I / light, G a Gaussian.  The light is
    divided out first because it is a factor: otherwise its slope would displace the slow part of
    the texture by sigma^2 times the relative slope, a third of a pixel towards standstill.

    Args:
        image: (H, W), grey levels, low-passed; left unchanged.
    Returns:
        (H, W), about zero mean and unit deviation where there is texture.
    """
    floor = 0.003  # added to the local contrast, so that noise in flat areas is not amplified
    light = _enlarged(_slow(image, LIGHT_PX) + np.float32(BLACK_GREY), image.shape)
    # In place, because allocating whole pictures costs more than the arithmetic.
    detail = np.divide(image, light, out=light)
    detail -= smooth(detail, NEIGHBOURHOOD_PX)
    deviation = np.sqrt(_slow(detail * detail, NEIGHBOURHOOD_PX)) + np.float32(floor)
    detail *= _enlarged(np.reciprocal(deviation), image.shape)
    return detail


def low_pass(image: GrayImage) -> GrayImage:
    """Smooth with a Gaussian of 1 px: bilinear samples are accurate on smooth pictures only."""
    return np.asarray(cv2.GaussianBlur(image, (7, 7), 1.0), np.float32)


def gradient(image: GrayImage) -> tuple[GrayImage, GrayImage]:
    """Gradient along the rows and along the columns, per px (Scharr)."""
    along, down = (
        cv2.Scharr(image, cv2.CV_32F, dx, 1 - dx, scale=1 / 32, borderType=cv2.BORDER_REFLECT_101)
        for dx in (1, 0)
    )
    return np.asarray(along, np.float32), np.asarray(down, np.float32)


def exact_gradient(image: GrayImage) -> tuple[GrayImage, GrayImage]:
    """Gradient along the rows and along the columns, per px, for displacements.

    The derivative is of sixth order, so that it is right for the finest texture, too: by Scharr's
    a displacement reads 8 % too large. Across it is smoothed as there, which noise needs.
    """
    slope = np.array([-1, 9, -45, 0, 45, -9, 1], np.float32) / 60
    smooth = np.array([3, 10, 3], np.float32) / 16
    along, down = (
        cv2.sepFilter2D(image, cv2.CV_32F, *kernels)
        for kernels in ((slope, smooth), (smooth, slope))
    )
    return np.asarray(along, np.float32), np.asarray(down, np.float32)


def magnitude(along: GrayImage, down: GrayImage) -> GrayImage:
    """Length of vectors, of which two pictures hold the components.

    `cv2.magnitude` rounds by where its pictures lie in memory (OpenCV 5.0), and a film that is
    tracked again must have the same track.
    """
    return np.asarray(np.sqrt(along * along + down * down), np.float32)


def smooth(image: GrayImage, sigma_px: float) -> GrayImage:
    """Wide Gaussian, computed at a quarter of the size: equal to 1 %, at a tenth of the cost."""
    return _enlarged(_slow(image, sigma_px), image.shape)


def _slow(image: GrayImage, sigma_px: float) -> GrayImage:
    """Wide Gaussian of a picture, at a quarter of its size."""
    reduction = 4
    height, width = image.shape
    small_wh = (max(width // reduction, 1), max(height // reduction, 1))
    small = cv2.resize(image, small_wh, interpolation=cv2.INTER_AREA)
    slow = cv2.GaussianBlur(small, (0, 0), sigma_px / reduction, borderType=cv2.BORDER_REFLECT)
    return np.asarray(slow, np.float32)


def _enlarged(small: GrayImage, shape: tuple[int, ...]) -> GrayImage:
    return np.asarray(cv2.resize(small, shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)


def taper(valid: ByteImage | GrayImage, margin_px: int) -> GrayImage:
    """Window that is 1 inside and falls to 0 within `margin_px` of borders and invalid parts.

    The share of valid pixels around a pixel falls from 1 to a half at a straight border; a smooth
    step (3 r^2 - 2 r^3) maps it to the window.
    """
    inside = (valid > 0.5).astype(np.float32)
    side = 2 * margin_px + 1
    share = cv2.blur(inside, (side, side), borderType=cv2.BORDER_CONSTANT)
    ramp = np.maximum(2 * share - 1, 0) * inside
    return np.asarray(ramp * ramp * (3 - 2 * ramp), np.float32)


def parabola_peak(left: float, middle: float, right: float) -> float:
    """Offset of the maximum of the parabola through three neighbours, within half a step."""
    curvature = left - 2 * middle + right
    if curvature >= 0:
        return 0.0
    return float(np.clip((left - right) / (2 * curvature), -0.5, 0.5))


def contrast(image: GrayImage) -> float:
    """Standard deviation in grey levels at an eighth of the size, where noise averages out."""
    rows, columns = (max(side // 8, 1) for side in image.shape)
    small = reduce_to(image[: rows * 8, : columns * 8], (columns, rows))
    return float(cv2.meanStdDev(small)[1].item())
