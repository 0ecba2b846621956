"""Direct alignment of two normalised pictures under any smooth motion model (Lucas & Kanade 1981).

Gauss-Newton on the picture itself: with r(p) = M(w(p; q)) - R(p) the step in the parameters q
solves (sum J' g g' J) dq = -sum J' g r, where g is the gradient of the reference and J = dw/dq.
The motion model is smooth, so J is constant within a block of pixels, and the sums are made once a
block: a 2x2 tensor g g' of the reference (kept) and the 2-vector g r of each iteration.  A block
is also the unit of trust: water, glare, text and dirt lose their vote because their block does not
agree (its normalised correlation is low), and the covariance comes from the scatter between blocks
(a sandwich estimate), which stays honest although residuals are not white.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np

from vo_core.filters import gradient
from vo_core.resample import resample, resample_mask
from vo_core.types import ByteImage, GrayImage, Matrix
from vo_core.wall import Points

Warp = Callable[[Matrix, Points], Points]
"""w(q, points): where (N, 2) reference pixels lie in the moving picture under parameters q."""

AnyImage = TypeVar("AnyImage", ByteImage, GrayImage)

BLOCK_PX = 16
MAX_STEPS = 8
CONVERGED_PX = 0.005
VARIANCE_FLOOR = 0.02
"""Residual variance, of a texture of variance 1, below which a block earns no more weight."""

LEAST_ENERGY = 1e-3
"""Mean square of a normalised picture that counts as blank: rounding errors agree perfectly."""

CORRELATED_PX = 12.0
"""Pixels that share one independent value after a low-pass of sigma 1 (4 pi sigma^2)."""


@dataclass(frozen=True)
class BlockGrid:
    """Square blocks of pixels, as many as fit, centred in a picture."""

    rows: int
    columns: int
    side_px: int
    top_px: int
    left_px: int

    @classmethod
    def over(cls, shape: tuple[int, ...]) -> BlockGrid:
        """Blocks of `BLOCK_PX`, or half of that in a small picture."""
        side = BLOCK_PX if min(shape) >= 6 * BLOCK_PX else BLOCK_PX // 2
        rows, columns = shape[0] // side, shape[1] // side
        return cls(
            rows, columns, side, (shape[0] - rows * side) // 2, (shape[1] - columns * side) // 2
        )

    def crop(self, image: AnyImage) -> AnyImage:
        """The part of a picture that the blocks cover."""
        height, width = self.rows * self.side_px, self.columns * self.side_px
        return np.ascontiguousarray(
            image[self.top_px : self.top_px + height, self.left_px : self.left_px + width]
        )

    def nodes(self) -> Points:
        """Centres of the blocks and of one ring around them, ((rows + 2) (columns + 2), 2) px."""
        x = (np.arange(-1, self.columns + 1) + 0.5) * self.side_px - 0.5 + self.left_px
        y = (np.arange(-1, self.rows + 1) + 0.5) * self.side_px - 0.5 + self.top_px
        return np.stack(np.meshgrid(x, y), -1).reshape(-1, 2).astype(np.float64)

    def at_nodes(self, values: Points) -> Points:
        """Values at `nodes`, as (rows + 2, columns + 2, ...)."""
        return values.reshape(self.rows + 2, self.columns + 2, *values.shape[1:])

    def dense(self, positions: Points) -> GrayImage:
        """Positions at the nodes to positions of every covered pixel, (H, W, 2), bilinear."""
        coarse = np.nan_to_num(self.at_nodes(positions), nan=-1e4).astype(np.float32)
        side = self.side_px
        size_wh = ((self.columns + 2) * side, (self.rows + 2) * side)
        dense = cv2.resize(coarse, size_wh, interpolation=cv2.INTER_LINEAR)
        return np.ascontiguousarray(dense[side:-side, side:-side])

    def means(self, image: GrayImage) -> Matrix:
        """Mean of each block of a covered picture, (blocks,)."""
        means = cv2.resize(image, (self.columns, self.rows), interpolation=cv2.INTER_AREA)
        return np.asarray(means, np.float64).ravel()

    def pooled(self, values: Matrix) -> Matrix:
        """Block values averaged with their neighbours: one block holds too few texture elements."""
        pooled = cv2.blur(
            values.reshape(self.rows, self.columns), (3, 3), borderType=cv2.BORDER_REPLICATE
        )
        return np.asarray(pooled, np.float64).ravel()


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
    support: float
    """Agreement times overlap: the share of the whole picture that agrees."""
    overlap: float
    """Share of the reference that the moving picture shows."""
    converged: bool
    trust: Matrix
    """(blocks,) normalised correlation around each block, 0 where nothing is seen."""


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
        warp: The motion model.
        start: (n,) parameters to start from; within about 2 px of the truth everywhere.
        scales: (n,) change of each parameter that moves the content by about a pixel.
        prior: (n, n) information about the parameters at `start`; None for none.
    """
    nodes = template.grid.nodes()
    parameters = np.array(start, np.float64)
    information = np.zeros((len(start),) * 2) if prior is None else prior
    jacobian, corner_px = None, np.inf
    fit = _Fit(template, moving, moving_valid)
    for _ in range(MAX_STEPS):
        positions = warp(parameters, nodes)
        if jacobian is None:
            jacobian = _jacobian(template, warp, parameters, nodes, positions, scales)
        fit.evaluate(positions)
        if not fit.weights.any():
            break
        hessian = np.einsum("b,bij,bik,bkl->jl", fit.weights, jacobian, template.tensor, jacobian)
        score = np.einsum("b,bij,bi->j", fit.weights, jacobian, fit.product)
        pull = information @ (parameters - start)
        ridge = np.diag(1e-9 / scales**2) * max(np.trace(hessian * np.outer(scales, scales)), 1e-9)
        step = np.linalg.solve(hessian + information + ridge, -(score + pull))
        parameters = parameters + step
        corner_px = float(np.abs(jacobian @ step).max())
        if corner_px < CONVERGED_PX:
            break
        if corner_px > 2 * template.grid.side_px:
            break
    return fit.result(parameters, jacobian, information, corner_px < 10 * CONVERGED_PX, scales)


class _Fit:
    """Residuals, block weights and the result of one alignment."""

    def __init__(self, template: Template, moving: GrayImage, moving_valid: ByteImage) -> None:
        self.template, self.moving, self.moving_valid = template, moving, moving_valid
        blocks = len(template.energy)
        self.weights = np.zeros(blocks)
        self.trust = np.zeros(blocks)
        self.product = np.zeros((blocks, 2))
        self.agreement, self.overlap = 0.0, 0.0

    def evaluate(self, positions: Points) -> None:
        t = self.template
        maps = t.grid.dense(positions)
        seen = resample(self.moving, maps)
        mask = resample_mask(self.moving_valid, maps) & t.valid
        mask32 = mask.astype(np.float32)
        seen *= mask32
        covered = t.grid.means(mask32)
        power, common = t.grid.means(seen * seen), t.grid.means(seen * t.image)
        own = t.energy * covered
        near_power, near_common, near_own = map(t.grid.pooled, (power, common, own))
        residual = seen - t.image * mask32
        self.product = np.stack([t.grid.means(g * residual) for g in t.gradient], 1)
        variance = t.grid.means(residual * residual) / np.maximum(covered, 1e-6)
        correlation = near_common / np.sqrt(np.maximum(near_own * near_power, 1e-12))
        self.trust = np.where(covered > 0.8, np.clip(correlation, 0.0, 1.0), 0.0)
        self.weights = self.trust**2 / (variance + VARIANCE_FLOOR)
        self.weights *= t.grid.side_px**2 / CORRELATED_PX
        energy = np.sqrt(own.sum() * power.sum()) + LEAST_ENERGY * len(own)
        self.agreement = float(common.sum() / energy)
        self.overlap = float(covered.mean())

    def result(
        self,
        parameters: Matrix,
        jacobian: Matrix | None,
        information: Matrix,
        converged: bool,
        scales: Matrix,
    ) -> Alignment:
        n = len(parameters)
        if jacobian is None or not self.weights.any():
            return Alignment(
                parameters, np.diag(1e6 * scales**2), 0.0, 0.0, self.overlap, False, self.trust
            )
        weighted = jacobian * self.weights[:, None, None]
        hessian = np.einsum("bij,bik,bkl->jl", weighted, self.template.tensor, jacobian)
        scores = np.einsum("bij,bi->bj", weighted, self.product)
        scatter = scores.T @ scores
        inverse = np.linalg.inv(hessian + information + np.diag(1e-9 / scales**2))
        covariance = inverse @ (scatter + information) @ inverse + np.zeros((n, n))
        return Alignment(
            parameters,
            covariance,
            self.agreement,
            self.agreement * self.overlap,
            self.overlap,
            converged,
            self.trust,
        )


def _jacobian(
    template: Template,
    warp: Warp,
    parameters: Matrix,
    nodes: Points,
    positions: Points,
    scales: Matrix,
) -> Matrix:
    """dw/dq a block, (blocks, 2, n), turned into the reference's pixels by (dw/dp)^-1."""
    steps = np.diag(0.1 * scales)
    moved = [
        (warp(parameters + step, nodes) - warp(parameters - step, nodes)) / (0.2 * scale)
        for step, scale in zip(steps, scales, strict=True)
    ]
    dq = template.grid.at_nodes(np.stack(moved, -1))[1:-1, 1:-1]
    at = template.grid.at_nodes(positions)
    dx = (at[1:-1, 2:] - at[1:-1, :-2]) / (2 * template.grid.side_px)
    dy = (at[2:, 1:-1] - at[:-2, 1:-1]) / (2 * template.grid.side_px)
    dp = np.stack([dx, dy], -1)
    blind = np.isnan(dp).any((-1, -2), keepdims=True) | np.isnan(dq).any((-1, -2), keepdims=True)
    dp = np.where(blind, np.eye(2), dp)
    dq = np.where(blind, 0.0, dq)
    return np.asarray(np.linalg.solve(dp, dq).reshape(-1, 2, len(parameters)))
