"""Direct alignment of two normalised pictures for any smooth motion model (Lucas & Kanade 1981).

Gauss-Newton on the pictures: with r(p) = M(w(p; q)) - R(p) the step in the parameters q solves
(sum J' g g' J) dq = -sum J' g r, where g is the gradient of the reference and J = dw/dq. The motion
model is smooth, so J is constant within a block of pixels, and the sums are taken per block: a 2x2
tensor g g' of the reference (kept) and a 2-vector g r in each iteration. A block is also the unit
of the vote: blocks with water, glare, text or dirt have a low normalised correlation and get no
weight. The covariance comes from the scatter between blocks (a sandwich estimate), which holds
although residuals are not white.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.geometry.wall import Points
from vo_core.image.filters import exact_gradient
from vo_core.image.resample import even_pixels_of_double, resample_at
from vo_core.matching.blocks import BlockGrid
from vo_core.types import ByteImage, GrayImage, Matrix

Warp = Callable[[Matrix], Points]
"""w(q): where the nodes of the reference's blocks lie in the moving picture under parameters q,
(..., n) to (..., nodes, 2)."""

CONVERGED_PX = 0.02
"""A step that moves no block by more ends the iteration: the remaining error is far smaller."""

SHORT_PX = 0.003
"""Error that a longer last step may leave in a clear picture, a third of `PIXEL_ERROR`.

Noise in the reference's gradients makes each step too short by a share that grows with 1 -
fidelity. A step ends the iteration if that share of it is at most this."""

LONGEST_LAST_PX = 0.3
"""Longest step that may end the iteration in a clear picture.

Measured: up to 0.3 px distance and heading do not change; at 0.5 px the lateral offset under a
rolling shutter does."""

LINEAR_PX = 0.5
"""A step that moves no block by more moves all of them linearly, by the slopes at the start.

What is left out is of second order, a step's square over the size of the patch: 0.001 px."""

LAST_STEP = 60
"""Most steps of any alignment, even one that still converges."""

MOST_STEPS = 8
"""Most steps of an alignment that is extrapolated from the second step on.

Where several motions are tried (wall, water, dirt), a start that needs more steps is not near its
own motion."""

LONGEST_STRIDE = 10.0
"""Largest factor by which a Gauss-Newton step is extrapolated."""

PATIENCE = 5
"""An alignment is given up after this many extrapolated steps without progress."""

DIFFERENCE = 1e-4
"""Step of the numerical derivative, relative to `scales`.

A parameter that the picture does not show (the heading on a floor) must have a slope of 0; with a
larger step the curvature would give it one."""

VARIANCE_FLOOR = 0.02
"""Residual variance, for a texture of variance 1, below which a block's weight no longer grows."""

CLEAR = 0.5
"""A block with a higher correlation agrees clearly: unrelated pictures do not reach it."""

LEAST_ENERGY = 1e-3
"""Mean square up to which a normalised picture counts as blank, as rounding errors correlate."""

INFLATION = 6.0
"""Variance of an alignment over the variance computed from the scatter between its blocks.

The errors of blocks are correlated, as video coding moves many of them alike.  Measured on coded
video."""

START_PX = 100.0
"""Standard deviation of a start without priors: it bounds what the pictures leave open."""

OPEN_END_PX = 1e8
"""The same where the parameters have priors; it only keeps the equations solvable."""

BY_CHANCE = 5.0
"""Common texture counts only beyond this many standard deviations of a chance correlation."""

PIXEL_ERROR = 0.01
"""Displacement error, px, that all blocks share, however good the picture."""

LOCK = 6.0
"""An alignment with at least this significance shows the same wall and no coincidence."""

OPEN_PX = 1.0
"""Above this uncertainty the pictures do not show the motion, as with straight lines."""

CORRELATED_PX = 12.0
"""Pixels per independent value after a low-pass of sigma 1 (4 pi sigma^2)."""


@dataclass(frozen=True)
class Template:
    """A reference picture, with what all alignments against it share.

    Pictures are kept as `BlockGrid.tiles`, so that one product with a moving picture gives the sums
    of all blocks.
    """

    grid: BlockGrid
    row_step: int
    basis: GrayImage
    """(blocks, 3, pixels): gradient along the rows and down the columns, and the picture."""
    own: Matrix
    """(blocks, 3) mean products of these with the picture."""
    seen: NDArray[np.bool_]
    """(blocks,) whether the picture shows all of the block."""
    root: Matrix
    """(2, 2, blocks) square root of the mean g g'."""
    texture: Matrix
    """(blocks,) mean square of the gradient."""
    coarse_gradient: GrayImage
    """(2, cells, blocks) gradient at half the resolution, which separates texture from noise."""
    coarse_tensor: Matrix
    """(3, blocks) xx, xy and yy of g g' of the coarse gradient, summed over the cells."""

    @classmethod
    def of(cls, picture: GrayImage, valid: ByteImage, row_step: int = 1) -> Template:
        """Prepare a reference from a picture; `valid` is 1 where it shows the wall.

        With a `row_step` of 2 only every second row is compared, at half the cost; the other rows
        of a low-passed picture add hardly any information.
        """
        image = even_pixels_of_double(picture)
        grid = BlockGrid.over(image.shape)
        basis = np.stack(
            [grid.tiles(part, row_step) for part in (*exact_gradient(image), image)], 1
        )
        coarse = _coarse_gradient(grid, basis[:, 2], row_step)
        gram = np.einsum("bip,bjp->bij", basis, basis).astype(np.float64) / basis.shape[2]
        return cls(
            grid=grid,
            row_step=row_step,
            basis=basis,
            own=gram[:, 2],
            seen=grid.tiles(valid).min(1) > 0,
            root=_root(*gram[:, [0, 0, 1], [0, 1, 1]].T),
            texture=gram[:, 0, 0] + gram[:, 1, 1],
            coarse_gradient=coarse,
            coarse_tensor=(coarse[[0, 0, 1]] * coarse[[0, 1, 1]]).sum(1, dtype=np.float64),
        )


@dataclass(frozen=True)
class Prior:
    """A Gaussian prior of the parameters."""

    mean: Matrix
    """(n,)"""
    information: Matrix
    """(n, n) inverse covariance, 0 where nothing is known beforehand."""

    @property
    def drawn_to(self) -> Matrix:
        """(n,) the mean, times the information."""
        return np.asarray(self.information @ self.mean)


@dataclass(frozen=True)
class Alignment:
    """The result of an alignment."""

    parameters: Matrix
    """(n,)"""
    positions: Points
    """Positions of the nodes of the reference's blocks, before the last step."""
    covariance: Matrix
    """(n, n), priors included."""
    free: Matrix
    """(n,) parameters without the prior of the motion."""
    free_covariance: Matrix
    """(n, n) covariance of `free`."""
    uncertainty_px: Matrix
    """(2,) standard deviation of the content's position, along the rows and along the columns."""
    agreement: float
    """Normalised correlation over the overlap, -1 to 1: the share of common texture."""
    fidelity: float
    """The same over agreeing blocks: noise lowers it, dirt and water do not."""
    overlap: float
    """Share of the reference's wall that the moving picture shows."""
    ncc: Matrix
    """(blocks,) normalised correlation around each block, 0 to 1; 0 where a picture shows
    nothing."""
    converged: bool
    significance: float
    """Agreement in standard deviations of the agreement that unrelated pictures reach by chance.

    It is the larger one of all blocks and of those that agree clearly, so that a few clean blocks
    between much dirt are enough."""

    @property
    def unexplained(self) -> float:
        """Share of the moving picture's energy that is not the reference's."""
        return 1 - self.agreement**2

    def support(self, ncc_weights: Matrix) -> float:
        """Mean normalised correlation, weighted by that which each block usually has, (blocks,)."""
        votes = ncc_weights**2
        return float(votes @ self.ncc / votes.sum())


def align(
    template: Template,
    doubled: GrayImage,
    whole: ByteImage,
    warp: Warp,
    start: Matrix,
    scales: Matrix,
    *,
    linearise: Callable[[Matrix], tuple[Points, Matrix]] | None = None,
    prior: Prior | None = None,
    motion: Prior | None = None,
    settled: int | None = None,
    enough_px: float = CONVERGED_PX,
) -> Alignment:
    """Fit the parameters of a motion model to two pictures.

    Args:
        template: The reference.
        doubled: (2 H, 2 W), the moving picture, normalised and low-passed like the reference, then
            doubled, which reduces the error of bilinear samples from up to 0.01 px to 0.001.
        whole: (H, W), 1 where the moving picture shows all of a block, by `BlockGrid.whole`.
        warp: The motion model, at the nodes of the template's blocks.
        start: (n,) parameters to start from, within about 2 px of the truth everywhere.
        scales: (n,) change of each parameter that moves the content by about a pixel.
        linearise: Returns w(q) and dw/dq, (n, 2, nodes); numerical differences by default.
        prior: What is known about the parameters.
        motion: Their usual values, a prior that `Alignment.free` leaves out.
        settled: Number of steps after which steps are extrapolated (see `_stride`) as long as they
            shrink; None for the first of at most `MOST_STEPS`.
        enough_px: The iteration ends once no block moves by more.
    """
    parameters = np.array(start, np.float64)
    loose = np.diag(1 / ((START_PX if prior is None else OPEN_END_PX) * scales) ** 2)
    nothing = Prior(parameters, np.zeros_like(loose))
    known, usual = prior or nothing, motion or nothing
    without_motion = loose + known.information
    information = without_motion + usual.information
    drawn_to = loose @ parameters + known.drawn_to + usual.drawn_to
    positions, slopes = (linearise or _differences(warp, scales))(parameters)
    fit = template.grid.linear(positions)
    jacobian = _on_reference(template.grid, fit, slopes)
    rooted = _rooted(template.root, jacobian)
    stride, moved, left_px, waited = 1.0, np.zeros(0), np.inf, 0
    for taken in range(1, LAST_STEP + 1):
        seen = _compare(template, doubled, whole, positions, fit)
        scores = (jacobian * (seen.product * seen.weights)).sum(1)
        step = -np.linalg.solve(
            _hessian(rooted, seen.weights) + information,
            scores.sum(1) + information @ parameters - drawn_to,
        )
        last, moved = moved, step @ jacobian.reshape(len(step), -1)
        extrapolated = taken > (settled or 1)
        if extrapolated:
            stride = _stride(stride, last, moved)
        parameters = parameters + stride * step
        before_px, left_px = left_px, stride * float(np.abs(moved).max())
        waited += extrapolated and left_px >= before_px
        if settled is None:
            clear_px = SHORT_PX / max(1 - seen.fidelity, 1e-3)
            enough_px = max(enough_px, min(clear_px, LONGEST_LAST_PX))
        if taken == (settled or MOST_STEPS):
            enough_px *= 2
        out_of_steps = waited == PATIENCE or (settled is None and taken == MOST_STEPS)
        if left_px < enough_px or left_px > 2 * template.grid.side_px or out_of_steps:
            break
        if left_px > LINEAR_PX:
            positions = warp(parameters)
        else:
            change = stride * step @ slopes.reshape(len(step), -1)
            positions = positions + change.reshape(2, -1).T
        fit = template.grid.linear(positions)
    # Sandwich estimate: the bread is the Hessian, the filling the actual scatter of the blocks.
    per_block = template.grid.side_px**2 / CORRELATED_PX
    independent = seen.overlap * template.seen.sum() * per_block
    clear = seen.ncc > CLEAR
    common = _common_texture(template, seen, independent)
    seen_information = _hessian(_rooted(common @ template.root, jacobian), seen.weights)
    hessian = seen_information + information
    bread = inverse(hessian)
    unforced = inverse(seen_information + without_motion)
    filling = INFLATION * scores @ scores.T + seen.shared * seen_information + information
    covariance = bread @ filling @ bread
    return Alignment(
        parameters=parameters,
        positions=positions,
        covariance=covariance,
        free=parameters + unforced @ (usual.information @ parameters - usual.drawn_to),
        free_covariance=unforced,
        uncertainty_px=_spread_px(jacobian, template.seen, covariance),
        agreement=seen.agreement,
        fidelity=seen.fidelity,
        overlap=seen.overlap,
        ncc=seen.ncc,
        converged=left_px < enough_px and bool(seen.weights.any()),
        significance=max(
            seen.agreement * float(np.sqrt(independent)),
            float(seen.ncc[clear].mean() * np.sqrt(clear.sum() * per_block)) if clear.any() else 0,
        ),
    )


Likeness = tuple[Matrix, float]
"""How two pictures agree at one pose: correlation of each block, and agreement, see `Alignment`."""


def agree(template: Template, doubled: GrayImage, whole: ByteImage, positions: Points) -> Likeness:
    """Compare two pictures where the nodes lie at `positions`."""
    seen = _compare(template, doubled, whole, positions, template.grid.linear(positions))
    return seen.ncc, seen.agreement


@dataclass(frozen=True)
class _Comparison:
    """The moving picture, resampled onto the reference and compared with it."""

    picture: GrayImage
    """(blocks, pixels), as `BlockGrid.tiles`."""
    product: Matrix
    """(2, blocks) mean g r."""
    weights: Matrix
    """(blocks,) information of a block's means, without the error that all blocks share."""
    shared: float
    """Share of a displacement's variance that all blocks have in common."""
    ncc: Matrix
    agreement: float
    fidelity: float
    overlap: float


def _compare(
    template: Template, doubled: GrayImage, whole: ByteImage, positions: Points, fit: Matrix
) -> _Comparison:
    """Compare at the positions of the nodes, of which `fit` is the linear fit in each block."""
    grid = template.grid
    cover = template.seen & grid.look_up(whole, positions)
    seen = resample_at(doubled, *grid.spread(2 * fit, template.row_step))
    # (blocks, 4) means of gx s, gy s, the reference times s, and s s.
    means = np.empty((len(seen), 4))
    means[:, :3] = np.einsum("bkp,bp->bk", template.basis, seen)
    means[:, 3] = np.einsum("bp,bp->b", seen, seen)
    means /= seen.shape[1]
    energies = np.stack([template.own[:, 2], means[:, 3], means[:, 2]], 1) * cover[:, None]
    own, power, common = energies.T
    near_own, near_power, near_common = grid.pooled(energies).T
    correlation = near_common / np.sqrt(np.maximum(near_own * near_power, 1e-12))
    ncc = np.clip(correlation, 0.0, 1.0) * cover
    variance = own + power - 2 * common
    total_own, total_power, total_common = energies.sum(0).tolist()
    energy = np.sqrt(total_own * total_power) + LEAST_ENERGY * len(own)
    vote = ncc * ncc
    weights = vote / (variance + VARIANCE_FLOOR) * (grid.side_px**2 / CORRELATED_PX / INFLATION)
    # Information about a displacement of all blocks together, per px^2.  Errors of interpolation,
    # lens and coding do not average out over the blocks, so they must not determine a direction
    # that the picture hardly shows: the information i becomes 1 / (1/i + e^2).
    information = float(weights @ template.texture) / 2
    unshared = 1 / (1 + PIXEL_ERROR**2 * information)
    voted_own, voted_power, voted_common = (vote @ energies).tolist()
    return _Comparison(
        picture=seen,
        product=(means[:, :2] - template.own[:, :2]).T,
        weights=unshared * weights,
        shared=1 - unshared,
        ncc=ncc,
        agreement=total_common / energy,
        fidelity=voted_common / (np.sqrt(voted_own * voted_power) + LEAST_ENERGY),
        overlap=float(cover.sum() / max(template.seen.sum(), 1)),
    )


def _stride(stride: float, last: Matrix, moved: Matrix) -> float:
    """Factor that extrapolates a step to its limit (Aitken's method; Irons & Tuck 1969).

    Noise in the gradients of the reference makes every step too short by the same share.  So each
    step is a fixed part of the one before, and the sum of the series is known.  `last` and `moved`
    are the displacements of all blocks by the last step and of this one, each taken once.
    """
    left = float((moved * last).sum() / max((last * last).sum(), 1e-12))
    return float(np.clip(stride / max(1 - left, 0.1), 1.0, LONGEST_STRIDE))


def inverse(matrix: Matrix) -> Matrix:
    """Invert a positive definite matrix of mixed units, after scaling its diagonal to 1."""
    scale = 1 / np.sqrt(matrix.diagonal())
    scales = scale[:, None] * scale
    return np.asarray(np.linalg.inv(matrix * scales) * scales)


def _spread_px(jacobian: Matrix, seen: NDArray[np.bool_], covariance: Matrix) -> Matrix:
    """(2,) standard deviation of the displacements J q along each axis, rms over the blocks seen.

    `jacobian` is (n, 2, blocks).  The mean of the variances j' C j over the rows j of J is the
    trace of C J' J, over their number.
    """
    along, down = (jacobian * seen).swapaxes(0, 1)
    variances = np.array([(rows @ rows.T * covariance).sum() for rows in (along, down)])
    return np.asarray(np.sqrt(np.maximum(variances, 0.0) / max(np.count_nonzero(seen), 1)))


def _root(xx: Matrix | float, xy: Matrix | float, yy: Matrix | float) -> Matrix:
    """(2, 2, ...) symmetric square roots of tensors A, after Cayley and Hamilton.

    (A + s I) / sqrt(tr A + 2 s) with s^2 = det A.
    """
    tensor = np.array([[xx, xy], [xy, yy]])
    side: Matrix = np.sqrt(np.abs(tensor[0, 0] * tensor[1, 1] - tensor[0, 1] ** 2))
    tensor[0, 0] += side
    tensor[1, 1] += side
    return np.asarray(tensor / np.sqrt(tensor[0, 0] + tensor[1, 1] + 1e-12))


def _rooted(root: Matrix, jacobian: Matrix) -> Matrix:
    """(n, 2, blocks) products of roots, (2, 2, blocks), and Jacobians, (n, 2, blocks)."""
    return np.asarray(root[:, 0] * jacobian[:, :1] + root[:, 1] * jacobian[:, 1:])


def _hessian(rooted: Matrix, weights: Matrix) -> Matrix:
    """Sum of w J' g g' J, (n, n), of roots times Jacobians."""
    rows = (rooted * np.sqrt(weights)).reshape(len(rooted), -1)
    return np.asarray(rows @ rows.T)


def _common_texture(template: Template, seen: _Comparison, independent: float) -> Matrix:
    """(2, 2) K such that K T K' are the tensors T without the gradients of noise.

    The product of two pictures' gradients averages to that of their common texture. With A the mean
    tensor of the template and C that product, the eigenvalues of A^-1/2 C A^-1/2 are the shares of
    texture in A along two directions. The share expected by chance is subtracted, so that a wall of
    straight lines (the aperture problem) leaves the direction along them open.
    """
    moving = _coarse_gradient(template.grid, seen.picture, template.row_step)
    weighted = (template.coarse_gradient * seen.weights.astype(np.float32)).reshape(2, -1)
    both = (weighted @ moving.reshape(2, -1).T).astype(np.float64)
    xx, xy, yy = (template.coarse_tensor @ seen.weights).tolist()
    least = 1e-9 * (xx + yy) + 1e-12
    root = _root(xx + least, xy, yy + least)
    whitener = np.linalg.inv(root)
    shares, directions = np.linalg.eigh(whitener @ (both + both.T) @ whitener / 2)
    kept = np.clip(shares - BY_CHANCE / np.sqrt(max(independent, 1.0)), 0.0, 1.0)
    return np.asarray(root @ (directions * np.sqrt(kept)) @ directions.T @ whitener)


def _coarse_gradient(grid: BlockGrid, tiles: GrayImage, row_step: int) -> GrayImage:
    """(2, cells, blocks) gradient of tiles between the pixels of half the resolution."""
    half, down = grid.side_px // 2, 2 // row_step
    # The blocks come last, because sums along a long axis are many times faster.
    pixels = np.asarray(cv2.transpose(tiles), np.float32).reshape(half, down, half, 2, -1)
    pixels = (pixels[:, :, :, 0] + pixels[:, :, :, 1]).sum(1)
    above, below = pixels[:-1], pixels[1:]
    sums, steps = above + below, below - above
    cells = np.stack([sums[:, 1:] - sums[:, :-1], steps[:, 1:] + steps[:, :-1]])
    return cells.reshape(2, -1, len(tiles))


def _differences(warp: Warp, scales: Matrix) -> Callable[[Matrix], tuple[Points, Matrix]]:
    steps = DIFFERENCE * scales

    def linearise(parameters: Matrix) -> tuple[Points, Matrix]:
        at, *moved = warp(parameters + np.vstack([np.zeros_like(steps), np.diag(steps)]))
        return at, np.asarray((np.stack(moved) - at).swapaxes(1, 2) / steps[:, None, None])

    return linearise


def _on_reference(grid: BlockGrid, fit: Matrix, slopes: Matrix) -> Matrix:
    """(n, 2, blocks) dw/dq of each block in the reference's pixels, by (dw/dp)^-1.

    It is computed once, at the start, because it changes little within the two pixels of an
    alignment.
    """
    at_nodes = slopes.reshape(-1, 2, grid.rows + 2, grid.columns + 2)
    dq = np.ascontiguousarray(at_nodes[..., 1:-1, 1:-1]).reshape(len(slopes), 2, -1)
    # (dw/dp)^-1 of the columns of dw/dp: their cofactors over the determinant.
    (a, b), (c, d) = fit[..., 1:].swapaxes(1, 2)
    inverted = np.array([[d, -b], [-c, a]]) / (a * d - b * c)
    moved = _rooted(inverted, dq)
    moved[~np.isfinite(moved)] = 0.0
    return np.asarray(moved)
