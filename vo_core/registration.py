"""Rigid registration of two pictures: phase correlation, then direct alignment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from vo_core.errors import ShapeMismatch
from vo_core.geometry.wall import Points
from vo_core.image.filters import normalise, taper
from vo_core.image.resample import double, reduce_to, to_grey
from vo_core.matching.align import LOCK, OPEN_PX, Alignment, Unknowns, align
from vo_core.matching.blocks import BlockGrid
from vo_core.matching.correlate import (
    LOCK_PSR,
    Peak,
    best_peaks,
    correlation,
    polar_spectrum,
    rotation_between,
    spectrum,
)
from vo_core.matching.template import Template
from vo_core.types import ByteImage, GrayImage, Image, Matrix

COARSE_SIDE_PX = 320
"""Longest side of the reduced pictures, which are correlated and aligned first."""

LONGEST_PX = 16000
"""Longest side of a picture; OpenCV resamples only below 32768 px, and pictures are doubled."""

BORDER_PX = 8
"""Width of the border that is left out of the alignment."""

COARSE_SIGMA_PX = 1.0
"""Low-pass of the reduced pictures, which are aligned from farther away."""

FINE_SIGMA_PX = 0.5
"""Low-pass of the full pictures, where the finest texture shows the motion best."""

SETTLED = 2
"""See `align`: any texture determines three parameters, so extrapolation can start early."""

NEAR_PX = 0.02
"""Step at which the alignment of the reduced pictures ends, in pixels of the full ones."""

ENOUGH_PX = 0.004
"""Step at which the alignment of the full pictures ends."""

NEARLY_PX = 0.02
"""Passes end once the picture is shifted back to within this distance of the reference."""

MOST_PASSES = 3
"""Most alignments of the full pictures."""

LEAST_COMMON_PX = 16
"""Shortest side of the common part of two pictures."""

SINC_REACH_PX = 10
"""Reach of the interpolation, which is exact to 0.0003 px up to 0.4 cycles per px."""

SINC_BETA = 8.0
"""Shape of the Kaiser window of the interpolation."""


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
    """Share of common texture, 0 (no lock) to 1."""


NO_LOCK = Shift(0.0, 0.0, 0.0, 0.0)
Pair = tuple[GrayImage, GrayImage]
Window = tuple[slice, ...]


def register(reference: Image, moving: Image) -> Shift:
    """Measure the rigid motion of the image content between two pictures.

    Phase correlation (Kuglin & Hines 1975) on locally normalised pictures gives the shift and the
    polar spectrum the rotation; Gauss-Newton on the pictures refines all three together. Where two
    parts of the picture move differently (a step in depth), the larger part counts.

    Args:
        reference, moving: (H, W) or (H, W, 3), the same shape, at least 32x32; uint8, uint16 or
            float. They are left unchanged.
    Returns:
        Shift: quality is 0 if the pictures do not show the same wall (no texture, no overlap) or
            leave a direction open (straight lines).
    Raises:
        ShapeMismatch: The arrays differ in shape, are not pictures or exceed `LONGEST_PX`.
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
    full = _each(lambda image: np.asarray(to_grey(image), np.float32), (reference, moving))
    size_wh = np.array(full[0].shape[::-1])
    reduction = max(1.0, size_wh.max() / COARSE_SIDE_PX)
    coarse_wh = np.maximum(np.rint(size_wh / reduction).astype(int), 1)
    coarse = _each(lambda image: normalise(_reduced(image, coarse_wh)), full)
    start = _best_start(coarse, _starts(*coarse), NEAR_PX / reduction)
    if start is None:
        return NO_LOCK
    parameters, agreement = start * [*size_wh / coarse_wh, 1.0], 0.0
    whole_px = np.rint(parameters[:2]).astype(int)
    reference, moving = _each(lambda image: _low_pass(image, FINE_SIGMA_PX), full)
    here, there = _common(reference.shape, whole_px)
    if min(reference[here].shape) < LEAST_COMMON_PX:
        return NO_LOCK
    template = _template(normalise(reference[here]))
    centre = (size_wh - 1) / 2 - [here[1].start, here[0].start]
    for _ in range(MOST_PASSES):
        shift_px, start = parameters[:2], np.array([0.0, 0.0, parameters[2]])
        back = _shifted_back(moving, shift_px - whole_px)[there]
        fit = _fitted(template, normalise(back), start, centre, ENOUGH_PX)
        if fit is None:
            return NO_LOCK
        parameters, agreement = fit.parameters + [*shift_px, 0.0], fit.agreement
        if np.abs(fit.parameters[:2]).max() < NEARLY_PX:
            break
    dx, dy, rotation = parameters.tolist()
    return Shift(dx, dy, rotation, float(np.clip(agreement, 0.0, 1.0)))


def _each(change: Callable[[Image], GrayImage], pair: tuple[Image, Image]) -> Pair:
    return change(pair[0]), change(pair[1])


def _best_start(pair: Pair, starts: list[Matrix], enough_px: float) -> Matrix | None:
    """Align from each start, and return the result for which more of the picture agrees."""
    reference, moving = pair
    template, centre = _template(reference), (np.array(moving.shape[::-1]) - 1) / 2
    fits = [_fitted(template, moving, start, centre, enough_px) for start in starts]
    locked = [fit for fit in fits if fit]
    return max(locked, key=lambda fit: fit.ncc.sum()).parameters if locked else None


def _template(reference: GrayImage) -> Template:
    return Template.of(reference, _inner(reference.shape))


def _fitted(
    template: Template, moving: GrayImage, start: Matrix, centre: Matrix, enough_px: float
) -> Alignment | None:
    """Align a normalised picture; None if it does not show the wall of the template."""
    everywhere = np.ones(moving.shape, np.uint8)
    scales = np.array([1.0, 1.0, 2 / max(moving.shape)])
    motion = _RigidMotion(template.grid, centre, scales)
    # The border can be compared only if nothing moves in from beyond it.
    stays = np.abs(motion.positions(start) - motion.nodes).max() < 1
    fit = align(
        template,
        double(moving),
        everywhere if stays else template.grid.whole(everywhere),
        Unknowns(motion, start, scales),
        settled=SETTLED,
        enough_px=enough_px,
    )
    is_open = np.linalg.eigvalsh(fit.covariance[:2, :2])[-1] > OPEN_PX**2
    return None if not fit.converged or is_open or fit.significance < LOCK else fit


def _common(shape: tuple[int, ...], whole_px: Matrix) -> tuple[Window, Window]:
    """The common part after a shift by whole pixels, in the reference and in the moving picture.

    Cropped to it, both pictures are normalised with the same neighbourhood, even at the border.
    """
    shift = whole_px[::-1]
    size = np.maximum(np.array(shape) - np.abs(shift), 0)
    here, there = (
        tuple(slice(at, at + side) for at, side in zip(corner, size, strict=True))
        for corner in (np.maximum(-shift, 0), np.maximum(shift, 0))
    )
    return here, there


def _shifted_back(image: GrayImage, part_px: Matrix) -> GrayImage:
    """Shift by a part of a pixel, so that samples between pixels are not biased to either."""
    along, down = (_sinc_kernel(part) for part in part_px.tolist())
    back = cv2.sepFilter2D(image, cv2.CV_32F, along, down, borderType=cv2.BORDER_REFLECT_101)
    return np.asarray(back, np.float32)


def _reduced(image: GrayImage, size_wh: Matrix) -> GrayImage:
    width, height = size_wh.tolist()
    return _low_pass(reduce_to(image, (width, height)), COARSE_SIGMA_PX)


def _low_pass(image: GrayImage, sigma_px: float) -> GrayImage:
    return np.asarray(cv2.GaussianBlur(image, (7, 7), sigma_px), np.float32)


def _sinc_kernel(part_px: float) -> GrayImage:
    """Filter that turns f(n) into f(n + part), for a part of a pixel."""
    x = np.arange(-SINC_REACH_PX, SINC_REACH_PX + 1) - part_px
    window = np.i0(SINC_BETA * np.sqrt(np.maximum(1 - (x / (SINC_REACH_PX + 1)) ** 2, 0)))
    kernel = np.sinc(x) * window
    return np.asarray(kernel / kernel.sum(), np.float32)


def _inner(shape: tuple[int, ...]) -> ByteImage:
    """Mask without the border, where half of the normalisation's neighbourhood is missing.

    A small picture keeps its border.
    """
    valid = np.ones(shape, np.uint8)
    if min(shape) >= 12 * BORDER_PX:
        valid[:BORDER_PX] = valid[-BORDER_PX:] = 0
        valid[:, :BORDER_PX] = valid[:, -BORDER_PX:] = 0
    return valid


def rigid(q: Matrix, points: Points, centre: Matrix) -> Points:
    """w(q, p) = R (p - c) + c + d with q = (dx, dy, rotation) about a centre c.

    Parameters (..., 3) and points (N, 2) give (..., N, 2).
    """
    cos, sin = np.cos(q[..., 2, None]), np.sin(q[..., 2, None])
    x, y = (points - centre).T
    turned = np.stack([cos * x - sin * y, sin * x + cos * y], -1)
    return np.asarray(turned + centre + q[..., None, :2])


class _RigidMotion:
    """The motion model `rigid` at the nodes of blocks."""

    def __init__(self, grid: BlockGrid, centre: Matrix, scales: Matrix) -> None:
        self.nodes, self.scales, self._centre = grid.nodes(), scales, centre

    def positions(self, q: Matrix) -> Points:
        """w(q), (nodes, 2) px."""
        return rigid(q, self.nodes, self._centre)

    def linearise(self, q: Matrix) -> tuple[Points, Matrix]:
        """w(q) and dw/dq, (3, 2, nodes), by differences over a ten-thousandth of a pixel."""
        steps = 1e-4 * self.scales
        at, *moved = self.positions(q + np.vstack([np.zeros_like(steps), np.diag(steps)]))
        return at, np.asarray((np.stack(moved) - at).swapaxes(1, 2) / steps[:, None, None])


def _starts(reference: GrayImage, moving: GrayImage) -> list[Matrix]:
    """Starts: the best peaks without rotation and with the rotation by polar spectra."""
    shape = reference.shape
    everywhere = np.ones(shape, np.uint8)
    window = taper(everywhere, min(shape) // 2)
    before, now = (polar_spectrum(image, window) for image in (reference, moving))
    target = spectrum(moving, window)
    rotation = rotation_between(before, now)
    candidates = []
    # A rotation that moves no corner by a pixel does not change the correlation.
    for angle in (0.0, rotation) if abs(rotation) * max(shape) / 2 > 1 else (0.0,):
        turned = _moved(reference, np.array([0.0, 0.0, angle])) if angle else reference
        (peak,) = best_peaks(correlation(spectrum(turned, window), target))
        candidates.append((np.array([peak.dx_px, peak.dy_px, angle]), peak))
    start, peak = max(candidates, key=lambda candidate: candidate[1].psr)
    on_overlap = _on_overlap(reference, moving, start)
    if peak.psr > max(peak.psr for _, peak in on_overlap):
        on_overlap.append((start, peak))
    return [start for start, peak in on_overlap if peak.psr >= LOCK_PSR]


def _on_overlap(
    reference: GrayImage, moving: GrayImage, start: Matrix
) -> list[tuple[Matrix, Peak]]:
    """Correlate once more on the common part, with the reference moved by the start."""
    seen = _moved(np.ones_like(reference), start)
    window = taper(seen, max(8, min(reference.shape) // 6))
    surface = correlation(spectrum(_moved(reference, start), window), spectrum(moving, window))
    return [(start + (peak.dx_px, peak.dy_px, 0.0), peak) for peak in best_peaks(surface, 2)]


def _moved(image: GrayImage, q: Matrix) -> GrayImage:
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    to = rigid(q, corners, (np.array(image.shape[::-1]) - 1) / 2)
    matrix = np.column_stack([to[1] - to[0], to[2] - to[0], to[0]])
    return np.asarray(cv2.warpAffine(image, matrix, image.shape[::-1], flags=cv2.INTER_LINEAR))
