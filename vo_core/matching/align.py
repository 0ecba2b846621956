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

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vo_core.geometry.wall import Points
from vo_core.matching.blocks import BlockGrid
from vo_core.matching.template import INFLATION, Comparison, Template, common_texture, compare
from vo_core.types import ByteImage, GrayImage, Matrix

CONVERGED_PX = 0.02
"""A step that moves no block by more ends the iteration: the remaining error is far smaller."""

MOST_STEPS = 8
"""Most steps of an alignment that is extrapolated from the second step on.

Where several motions are tried (wall, water, dirt), a start that needs more steps is not near its
own motion."""

START_PX = 100.0
"""Standard deviation of a start without priors: it bounds what the pictures leave open."""

LOCK = 6.0
"""An alignment with at least this significance shows the same wall and no coincidence."""

OPEN_PX = 1.0
"""Above this uncertainty the pictures do not show the motion, as with straight lines."""


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

    def extended(self, further: Prior) -> Prior:
        """The prior with that of further parameters."""
        count = len(self.mean)
        wide = np.zeros((count + len(further.mean),) * 2)
        wide[:count, :count], wide[count:, count:] = self.information, further.information
        return Prior(np.append(self.mean, further.mean), wide)


class Motion(Protocol):
    """A smooth motion model w(q): where the nodes of the reference's blocks lie in a picture."""

    def positions(self, q: Matrix) -> Points:
        """w(q), (nodes, 2) px."""

    def linearise(self, q: Matrix) -> tuple[Points, Matrix]:
        """w(q) and dw/dq, (n, 2, nodes)."""


@dataclass(frozen=True)
class Unknowns:
    """What an alignment has to find: the parameters of a motion model."""

    motion: Motion
    start: Matrix
    """(n,) parameters to start from, within about 2 px of the truth everywhere."""
    scales: Matrix
    """(n,) change of each parameter that moves the content by about a pixel."""
    known: Prior | None = None
    """What is known about the parameters."""
    usual: Prior | None = None
    """Their usual values, a prior that `Alignment.free` leaves out."""

    def with_further(self, motion: Motion, prior: Prior, scales: Matrix) -> Unknowns:
        """The same with further parameters, of which no value is usual."""
        nothing = Prior(prior.mean, 0 * prior.information)
        return Unknowns(
            motion,
            np.append(self.start, prior.mean),
            np.append(self.scales, scales),
            self.known and self.known.extended(prior),
            self.usual and self.usual.extended(nothing),
        )


@dataclass(frozen=True)
class _Beforehand:
    """The priors of an alignment as parts of its normal equations."""

    information: Matrix
    """(n, n)"""
    without_motion: Matrix
    """(n, n) the same without the usual values."""
    drawn_to: Matrix
    """(n,) the means, times their information."""
    usual: Prior

    @classmethod
    def of(cls, unknowns: Unknowns) -> _Beforehand:
        # Where the parameters have priors, it only keeps the equations solvable.
        start_px = START_PX if unknowns.known is None else 1e6
        loose = np.diag(1 / (start_px * unknowns.scales) ** 2)
        nothing = Prior(unknowns.start, np.zeros_like(loose))
        known, usual = unknowns.known or nothing, unknowns.usual or nothing
        without_motion = loose + known.information
        return cls(
            information=without_motion + usual.information,
            without_motion=without_motion,
            drawn_to=loose @ unknowns.start + known.drawn_to + usual.drawn_to,
            usual=usual,
        )


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
    unknowns: Unknowns,
    *,
    settled: int | None = None,
    enough_px: float = CONVERGED_PX,
) -> Alignment:
    """Fit the parameters of a motion model to two pictures.

    Args:
        template: The reference.
        doubled: (2 H, 2 W), the moving picture, normalised and low-passed like the reference, then
            doubled, which reduces the error of bilinear samples from up to 0.01 px to 0.001.
        whole: (H, W), 1 where the moving picture shows all of a block, by `BlockGrid.whole`.
        unknowns: The parameters, and what is known of them.
        settled: Number of steps after which steps are extrapolated (see `_stride`) as long as they
            shrink; None for the first of at most `MOST_STEPS`.
        enough_px: The iteration ends once no block moves by more.
    """
    patience = 5  # an alignment is given up after this many extrapolated steps without progress
    last_step = 60  # most steps of any alignment, even one that still converges
    # A step that moves no block by more moves all of them linearly, by the slopes at the start.
    # What is left out is of second order, a step's square over the size of the patch: 0.001 px.
    linear_px = 0.5
    # Longest step that may end the iteration in a clear picture. Measured: up to 0.3 px distance
    # and heading do not change; at 0.5 px the lateral offset under a rolling shutter does.
    longest_last_px = 0.3
    # Error that a longer last step may leave in a clear picture, a third of what all blocks share.
    # Noise in the reference's gradients makes each step too short by a share that grows with 1 -
    # fidelity. A step ends the iteration if that share of it is at most this.
    short_px = 0.003
    parameters, beforehand = np.array(unknowns.start, np.float64), _Beforehand.of(unknowns)
    positions, slopes = unknowns.motion.linearise(parameters)
    fit = template.grid.linear(positions)
    jacobian = _on_reference(template.grid, fit, slopes)
    rooted = _rooted(template.root, jacobian)
    stride, moved, left_px, waited = 1.0, np.zeros(0), np.inf, 0
    for taken in range(1, last_step + 1):
        seen = compare(template, doubled, whole, positions, fit)
        scores = (jacobian * (seen.product * seen.weights)).sum(1)
        step = -np.linalg.solve(
            _hessian(rooted, seen.weights) + beforehand.information,
            scores.sum(1) + beforehand.information @ parameters - beforehand.drawn_to,
        )
        last, moved = moved, step @ jacobian.reshape(len(step), -1)
        extrapolated = taken > (settled or 1)
        if extrapolated:
            stride = _stride(stride, last, moved)
        parameters = parameters + stride * step
        before_px, left_px = left_px, stride * float(np.abs(moved).max())
        waited += extrapolated and left_px >= before_px
        if settled is None:
            clear_px = short_px / max(1 - seen.fidelity, 1e-3)
            enough_px = max(enough_px, min(clear_px, longest_last_px))
        if taken == (settled or MOST_STEPS):
            enough_px *= 2
        out_of_steps = waited == patience or (settled is None and taken == MOST_STEPS)
        if left_px < enough_px or left_px > 2 * template.grid.side_px or out_of_steps:
            break
        if left_px > linear_px:
            positions = unknowns.motion.positions(parameters)
        else:
            change = stride * step @ slopes.reshape(len(step), -1)
            positions = positions + change.reshape(2, -1).T
        fit = template.grid.linear(positions)
    covariance, free_covariance = _covariances(template, seen, jacobian, scores, beforehand)
    usual = beforehand.usual
    return Alignment(
        parameters=parameters,
        positions=positions,
        covariance=covariance,
        free=parameters + free_covariance @ (usual.information @ parameters - usual.drawn_to),
        free_covariance=free_covariance,
        uncertainty_px=_spread_px(jacobian, template.seen, covariance),
        agreement=seen.agreement,
        fidelity=seen.fidelity,
        overlap=seen.overlap,
        ncc=seen.ncc,
        converged=left_px < enough_px and bool(seen.weights.any()),
        significance=_significance(template, seen),
    )


def _covariances(
    template: Template,
    seen: Comparison,
    jacobian: Matrix,
    scores: Matrix,
    beforehand: _Beforehand,
) -> tuple[Matrix, Matrix]:
    """(n, n) covariances of the parameters, with and without the prior of the motion.

    The first is a sandwich estimate: the bread is the Hessian, the filling the actual scatter of
    the blocks.
    """
    common = common_texture(template, seen)
    seen_information = _hessian(_rooted(common @ template.root, jacobian), seen.weights)
    bread = inverse(seen_information + beforehand.information)
    filling = INFLATION * scores @ scores.T + seen.shared * seen_information
    filling = filling + beforehand.information
    free = inverse(seen_information + beforehand.without_motion)
    return bread @ filling @ bread, free


def _significance(template: Template, seen: Comparison) -> float:
    """See `Alignment.significance`."""
    of_all = seen.agreement * float(np.sqrt(seen.independent))
    clear = seen.ncc > 0.5  # unrelated pictures do not reach it
    if not clear.any():
        return max(of_all, 0)
    independent = clear.sum() * template.values_per_block
    return max(of_all, float(seen.ncc[clear].mean() * np.sqrt(independent)))


def _stride(stride: float, last: Matrix, moved: Matrix) -> float:
    """Factor that extrapolates a step to its limit (Aitken's method; Irons & Tuck 1969).

    Noise in the gradients of the reference makes every step too short by the same share.  So each
    step is a fixed part of the one before, and the sum of the series is known.  `last` and `moved`
    are the displacements of all blocks by the last step and of this one, each taken once.
    """
    # Steps that swing to and fro, as blocks come in sight and leave it, are shortened.
    shortest, longest = 0.25, 10.0
    left = float((moved * last).sum() / max((last * last).sum(), 1e-12))
    return float(np.clip(stride / max(1 - left, 0.1), shortest, longest))


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


def _rooted(root: Matrix, jacobian: Matrix) -> Matrix:
    """(n, 2, blocks) products of roots, (2, 2, blocks), and Jacobians, (n, 2, blocks)."""
    return np.asarray(root[:, 0] * jacobian[:, :1] + root[:, 1] * jacobian[:, 1:])


def _hessian(rooted: Matrix, weights: Matrix) -> Matrix:
    """Sum of w J' g g' J, (n, n), of roots times Jacobians."""
    rows = (rooted * np.sqrt(weights)).reshape(len(rooted), -1)
    return np.asarray(rows @ rows.T)


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
