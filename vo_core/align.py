"""Direct alignment of two normalised pictures under any smooth motion model (Lucas & Kanade 1981).

Gauss-Newton on the picture itself: with r(p) = M(w(p; q)) - R(p) the step in the parameters q is
the solution of (sum J' g g' J) dq = -sum J' g r, where g is the gradient of the reference and
J = dw/dq.  The motion model is smooth, so J is constant within a block of pixels, and the sums are
made once a block: a 2x2 tensor g g' of the reference (kept) and the 2-vector g r of each
iteration.  A block is also the unit of trust: water, glare, text and dirt lose their vote because
their block does not agree (its normalised correlation is low), and the covariance comes from the
scatter between blocks (a sandwich estimate), which stays honest although residuals are not white.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vo_core.blocks import BlockGrid
from vo_core.filters import gradient
from vo_core.resample import resample, resample_mask
from vo_core.types import ByteImage, GrayImage, Matrix
from vo_core.wall import Points

Warp = Callable[[Matrix], Points]
"""w(q): where the nodes of the reference's blocks lie in the moving picture under parameters q."""

MAX_STEPS = 8
CONVERGED_PX = 0.005
"""A step that moves no block by more ends the iteration."""

DIFFERENCE = 1e-4
"""Step of the numerical derivative in scales: what cannot be seen (the heading on a floor) must
come out as exactly that, and a large step would see it in the curvature."""

VARIANCE_FLOOR = 0.02
"""Residual variance, of a texture of variance 1, below which a block earns no more weight."""

LEAST_COVER = 0.8
"""Share of a block that both pictures must show."""

LEAST_ENERGY = 1e-3
"""Mean square of a normalised picture that counts as blank: rounding errors agree perfectly."""

CORRELATED_PX = 12.0
"""Pixels that share one independent value after a low-pass of sigma 1 (4 pi sigma^2)."""


@dataclass(frozen=True)
class Template:
    """A reference picture with all that its alignments share."""

    grid: BlockGrid
    image: GrayImage
    """The covered part, normalised and low-passed."""
    valid: ByteImage
    """1 where the picture shows the wall."""
    gradient: tuple[GrayImage, GrayImage]
    tensor: Matrix
    """(blocks, 2, 2) mean g g'."""
    energy: Matrix
    """(blocks,) mean square of the picture."""

    @classmethod
    def of(cls, image: GrayImage, valid: ByteImage) -> Template:
        """Prepare a reference from a whole picture."""
        grid = BlockGrid.over(image.shape)
        gx, gy = (grid.crop(g) for g in gradient(image))
        xx, xy, yy = (grid.means(product) for product in (gx * gx, gx * gy, gy * gy))
        covered = grid.crop(image)
        return cls(
            grid=grid,
            image=covered,
            valid=grid.crop(valid),
            gradient=(gx, gy),
            tensor=np.stack([xx, xy, xy, yy], 1).reshape(-1, 2, 2),
            energy=grid.means(covered * covered),
        )


@dataclass(frozen=True)
class Alignment:
    """Where the moving picture fits the reference."""

    parameters: Matrix
    """(n,)"""
    covariance: Matrix
    """(n, n), the prior included."""
    agreement: float
    """Normalised correlation over the overlap, -1 to 1: the share of texture seen again."""
    overlap: float
    """Share of the reference's wall that the moving picture shows."""
    trust: Matrix
    """(blocks,) normalised correlation around each block, 0 where nothing is seen."""
    converged: bool
    significance: float
    """Agreement in standard deviations of what unrelated pictures reach by chance."""

    @property
    def support(self) -> float:
        """Share of the whole picture that agrees."""
        return self.agreement * self.overlap


def align(
    template: Template,
    moving: GrayImage,
    moving_valid: ByteImage,
    warp: Warp,
    start: Matrix,
    scales: Matrix,
    *,
    prior: Matrix | None = None,
) -> Alignment:
    """Fit the parameters of a motion model.

    Args:
        template: The reference.
        moving: (H, W), normalised and low-passed like the reference.
        moving_valid: (H, W), 1 where it shows the wall.
        warp: The motion model, at the nodes of the template's blocks.
        start: (n,) parameters to start from; within about 2 px of the truth everywhere.
        scales: (n,) change of each parameter that moves the content by about a pixel.
        prior: (n, n) information about the parameters at `start`; None for none.
    """
    information = np.diag(1e-9 / scales**2) + (0 if prior is None else prior)
    parameters, step_px = np.array(start, np.float64), np.inf
    positions = warp(parameters)
    jacobian = _jacobian(template.grid, warp, parameters, positions, scales)
    for _ in range(MAX_STEPS):
        seen = _compare(template, moving, moving_valid, positions)
        step = -np.linalg.solve(
            _hessian(template, jacobian, seen) + information,
            _scores(jacobian, seen).sum(0) + information @ (parameters - start),
        )
        parameters = parameters + step
        step_px = float(np.abs(jacobian @ step).max())
        if step_px < CONVERGED_PX or step_px > 2 * template.grid.side_px:
            break
        positions = warp(parameters)
    # Sandwich: the bread is the Hessian, the filling what the blocks really scatter.
    scores = _scores(jacobian, seen)
    bread = np.linalg.inv(_hessian(template, jacobian, seen) + information)
    independent = seen.overlap * template.valid.sum() / CORRELATED_PX
    return Alignment(
        parameters=parameters,
        covariance=bread @ (scores.T @ scores + information) @ bread,
        agreement=seen.agreement,
        overlap=seen.overlap,
        trust=seen.trust,
        converged=step_px < 10 * CONVERGED_PX and bool(seen.weights.any()),
        significance=seen.agreement * float(np.sqrt(independent)),
    )


@dataclass(frozen=True)
class _Comparison:
    """The moving picture, brought onto the reference, against it."""

    product: Matrix
    """(blocks, 2) mean g r."""
    weights: Matrix
    """(blocks,) information that a block's means carry."""
    trust: Matrix
    agreement: float
    overlap: float


def _compare(
    template: Template, moving: GrayImage, moving_valid: ByteImage, positions: Points
) -> _Comparison:
    grid = template.grid
    maps = grid.dense(positions)
    mask = (resample_mask(moving_valid, maps) & template.valid).astype(np.float32)
    seen = resample(moving, maps) * mask
    residual = seen - template.image * mask
    cover = grid.means(mask)
    own, power, common = (
        template.energy * cover,
        grid.means(seen * seen),
        grid.means(seen * template.image),
    )
    near_own, near_power, near_common = (grid.pooled(v) for v in (own, power, common))
    correlation = near_common / np.sqrt(np.maximum(near_own * near_power, 1e-12))
    trust = np.where(cover > LEAST_COVER, np.clip(correlation, 0.0, 1.0), 0.0)
    variance = grid.means(residual * residual) / np.maximum(cover, 1e-6)
    energy = np.sqrt(own.sum() * power.sum()) + LEAST_ENERGY * len(own)
    return _Comparison(
        product=np.stack([grid.means(g * residual) for g in template.gradient], 1),
        weights=trust**2 / (variance + VARIANCE_FLOOR) * grid.side_px**2 / CORRELATED_PX,
        trust=trust,
        agreement=float(common.sum() / energy),
        overlap=float(cover.mean() / max(template.valid.mean(), 1e-6)),
    )


def _scores(jacobian: Matrix, seen: _Comparison) -> Matrix:
    """J' g r of each block, weighted, (blocks, n)."""
    weighted = seen.product * seen.weights[:, None]
    return np.asarray((jacobian * weighted[:, :, None]).sum(1))


def _hessian(template: Template, jacobian: Matrix, seen: _Comparison) -> Matrix:
    """Sum of J' g g' J over the blocks, weighted, (n, n)."""
    weighted = template.tensor * seen.weights[:, None, None]
    n = jacobian.shape[2]
    return np.asarray(jacobian.reshape(-1, n).T @ (weighted @ jacobian).reshape(-1, n))


def _jacobian(
    grid: BlockGrid, warp: Warp, parameters: Matrix, positions: Points, scales: Matrix
) -> Matrix:
    """dw/dq a block, (blocks, 2, n), turned into the reference's pixels by (dw/dp)^-1."""
    steps = DIFFERENCE * scales
    columns = [
        (warp(parameters + step) - positions) / size
        for step, size in zip(np.diag(steps), steps, strict=True)
    ]
    dq = grid.at_nodes(np.stack(columns, -1))[1:-1, 1:-1]
    at = grid.at_nodes(positions)
    dx = (at[1:-1, 2:] - at[1:-1, :-2]) / (2 * grid.side_px)
    dy = (at[2:, 1:-1] - at[:-2, 1:-1]) / (2 * grid.side_px)
    dp = np.stack([dx, dy], -1)
    blind = np.isnan(dp).any((-1, -2), keepdims=True) | np.isnan(dq).any((-1, -2), keepdims=True)
    dp = np.where(blind, np.eye(2), dp)
    dq = np.where(blind, 0.0, dq)
    return np.asarray(np.linalg.solve(dp, dq).reshape(-1, 2, len(parameters)))
