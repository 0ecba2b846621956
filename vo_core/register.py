"""Rigid registration of two pictures: phase correlation, then direct alignment."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vo_core.align import LOCK, OPEN_PX, Template, align
from vo_core.blocks import BlockGrid
from vo_core.correlate import (
    LOCK_PSR,
    Peak,
    best_peaks,
    correlation,
    polar_spectrum,
    rotation_between,
    spectrum,
)
from vo_core.errors import ShapeMismatch
from vo_core.filters import low_pass, normalise, taper
from vo_core.resample import double, reduce_to, to_grey
from vo_core.types import ByteImage, GrayImage, Image, Matrix
from vo_core.wall import Points

COARSE_SIDE_PX = 320
"""Longest side of the pictures that are correlated; the refinement runs at full size."""

LONGEST_PX = 16000
"""OpenCV resamples pictures below 32768 px only, and they are doubled."""

BORDER_PX = 8


@dataclass(frozen=True, slots=True)
class Shift:
    """Motion of the content about the image centre c.

    moving(p) = reference(R^-1 (p - c - d) + c).
    """

    dx_px: float
    """To the right."""
    dy_px: float
    """Down."""
    rotation_rad: float
    """Positive from x (right) to y (down)."""
    quality: float
    """Share of the texture that is seen again, 0 (no lock) to 1."""


def register(reference: Image, moving: Image) -> Shift:
    """Rigid motion of the image content between two pictures.

    Phase correlation (Kuglin & Hines 1975) on locally normalised pictures gives the shift and the
    polar spectrum the rotation; Gauss-Newton on the pictures refines all three together.

    Args:
        reference, moving: (H, W) or (H, W, 3), the same shape, at least 32x32; uint8, uint16 or
            float. They are left unchanged.
    Returns:
        Shift: quality is 0 when the two do not show the same wall (no texture, no overlap) or
            leave a direction open (straight lines).
    Raises:
        ShapeMismatch: The arrays differ in shape, are no pictures or above `LONGEST_PX`.
    """
    if np.shape(reference) != np.shape(moving):
        raise ShapeMismatch(
            "Both pictures must have one shape; found "
            f"{np.shape(reference)} and {np.shape(moving)}."
        )
    if max(np.shape(reference)) > LONGEST_PX:
        raise ShapeMismatch(
            f"A picture has at most {LONGEST_PX} px a side; found {np.shape(reference)}."
        )
    full = [np.asarray(to_grey(image), np.float32) for image in (reference, moving)]
    reduction = max(1.0, max(full[0].shape) / COARSE_SIDE_PX)
    coarse_wh = tuple(max(1, round(side / reduction)) for side in full[0].shape[::-1])
    coarse = [normalise(reduce_to(image, coarse_wh)) for image in full]
    start, peak = _coarse_shift(*coarse)
    if peak.psr < LOCK_PSR:
        return Shift(0.0, 0.0, 0.0, 0.0)
    start[:2] *= np.array(full[0].shape[::-1]) / np.array(coarse[0].shape[::-1])
    doubled = [double(normalise(low_pass(image))) for image in full]
    grid = BlockGrid.over(full[0].shape)
    valid, nodes = _inner(full[0].shape), grid.nodes()
    template = Template.of(doubled[0], valid)
    fit = align(
        template,
        doubled[1],
        grid.whole(valid),
        lambda q: rigid(q, nodes, full[0].shape),
        start,
        np.array([1.0, 1.0, 2 / max(full[0].shape)]),
    )
    is_open = np.linalg.eigvalsh(fit.covariance[:2, :2])[-1] > OPEN_PX**2
    if not fit.converged or is_open or fit.significance < LOCK:
        return Shift(0.0, 0.0, 0.0, 0.0)
    dx, dy, rotation = fit.parameters.tolist()
    return Shift(dx, dy, rotation, float(np.clip(fit.agreement, 0.0, 1.0)))


def _inner(shape: tuple[int, ...]) -> ByteImage:
    """1 but for a border, where the neighbourhood of the normalisation lies half outside.

    A small picture can spare none.
    """
    valid = np.ones(shape, np.uint8)
    if min(shape) >= 12 * BORDER_PX:
        valid[:BORDER_PX] = valid[-BORDER_PX:] = 0
        valid[:, :BORDER_PX] = valid[:, -BORDER_PX:] = 0
    return valid


def rigid(q: Matrix, points: Points, shape: tuple[int, ...]) -> Points:
    """w(q, p) = R (p - c) + c + d with q = (dx, dy, rotation), c the centre of the picture.

    Parameters (..., 3) and points (N, 2) give (..., N, 2).
    """
    centre = (np.array(shape[1::-1]) - 1) / 2
    cos, sin = np.cos(q[..., 2, None]), np.sin(q[..., 2, None])
    x, y = (points - centre).T
    turned = np.stack([cos * x - sin * y, sin * x + cos * y], -1)
    return np.asarray(turned + centre + q[..., None, :2])


def _coarse_shift(reference: GrayImage, moving: GrayImage) -> tuple[Matrix, Peak]:
    """Where to start: the best peak without rotation and with that of the polar spectrum."""
    shape = reference.shape
    everywhere = np.ones(shape, np.uint8)
    window = taper(everywhere, min(shape) // 2)
    before, now = (polar_spectrum(image, window) for image in (reference, moving))
    target = spectrum(moving, window)
    rotation = rotation_between(before, now)
    candidates = []
    for angle in (0.0, rotation):
        turned = _moved(reference, np.array([0.0, 0.0, angle])) if angle else reference
        (peak,) = best_peaks(correlation(spectrum(turned, window), target))
        candidates.append((np.array([peak.dx_px, peak.dy_px, angle]), peak))
    best = max(candidates, key=lambda candidate: candidate[1].psr)
    return _on_overlap(reference, moving, *best)


def _on_overlap(
    reference: GrayImage, moving: GrayImage, start: Matrix, peak: Peak
) -> tuple[Matrix, Peak]:
    """Correlate once more, the reference moved by the start, on what both then show."""
    seen = _moved(np.ones_like(reference), start)
    window = taper(seen, max(8, min(reference.shape) // 6))
    (again,) = best_peaks(
        correlation(spectrum(_moved(reference, start), window), spectrum(moving, window))
    )
    if again.psr <= peak.psr:
        return start, peak
    return start + (again.dx_px, again.dy_px, 0.0), again


def _moved(image: GrayImage, q: Matrix) -> GrayImage:
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    to = rigid(q, corners, image.shape)
    matrix = np.column_stack([to[1] - to[0], to[2] - to[0], to[0]])
    return np.asarray(cv2.warpAffine(image, matrix, image.shape[::-1], flags=cv2.INTER_LINEAR))
