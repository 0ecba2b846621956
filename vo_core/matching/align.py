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
from numpy.typing import NDArray

from vo_core.geometry.wall import Points
from vo_core.image.filters import gradient
from vo_core.image.resample import reduce_to, resample
from vo_core.matching.blocks import BlockGrid
from vo_core.types import ByteImage, GrayImage, Matrix

Warp = Callable[[Matrix], Points]
"""w(q): where the nodes of the reference's blocks lie in the moving picture under parameters q,
(..., n) to (..., nodes, 2)."""

CONVERGED_PX = 0.02
"""A step that moves no block by more ends the iteration: what is left is far smaller."""

SHORT_PX, LONGEST_LAST_PX = 0.001, 0.1
"""In a clear picture a longer step ends it too.  The noise in the reference's gradients makes each
step fall short by a share that grows with 1 - fidelity; that share of a step is below `SHORT_PX`.
Measured on coded film: up to 0.1 px distance and heading stay as they are, at 0.2 px a keyframe's
link is off by 0.01 px with one sign."""

LAST_STEP = 60
"""Of any alignment, however slowly it leads nearer."""

MOST_STEPS = 8
"""Of an alignment that is not extrapolated: where several motions are tried (wall, water, dirt), a
start that needs more is not near its own."""

LONGEST_STRIDE = 10.0
"""Most Gauss-Newton steps taken at once."""

PATIENCE = 5
"""Steps of the series that lead no nearer before an alignment is given up."""

DIFFERENCE = 1e-4
"""Step of the numerical derivative in scales: what cannot be seen (the heading on a floor) must
come out as exactly that, and a large step would see it in the curvature."""

VARIANCE_FLOOR = 0.02
"""Residual variance, of a texture of variance 1, below which a block earns no more weight."""

CLEAR = 0.5
"""Correlation around a block that unrelated pictures do not reach."""

LEAST_ENERGY = 1e-3
"""Mean square of a normalised picture that counts as blank: rounding errors agree perfectly."""

INFLATION = 6.0
"""Blocks do not err independently (video coding moves many of them alike): by how much the variance
of an alignment exceeds what the scatter between its blocks says. Measured on coded video."""

START_PX = 100.0
"""How far off a start can be, one sigma: what a picture leaves open stays within that."""

OPEN_END_PX = 1e8
"""The same where the parameters have priors of their own: so that equations can be solved."""

BY_CHANCE = 5.0
"""Standard deviations of two gradients' correlation that do not count as common texture."""

PIXEL_ERROR = 0.01
"""Displacement, px, that all blocks err by together, however good the picture."""

LOCK = 6.0
"""Significance from which an alignment shows the same wall and not a chance."""

OPEN_PX = 1.0
"""Above this uncertainty the pictures do not show the motion (straight lines)."""

CORRELATED_PX = 12.0
"""Pixels that share one independent value after a low-pass of sigma 1 (4 pi sigma^2)."""


@dataclass(frozen=True)
class Template:
    """A reference picture with all that its alignments share."""

    grid: BlockGrid
    row_step: int
    image: GrayImage
    """The covered part, normalised and low-passed, every `row_step`-th row."""
    seen: NDArray[np.bool_]
    """(blocks,) does the picture show all of the block? (`cover` below: do both pictures?)"""
    gradient: tuple[GrayImage, GrayImage]
    root: Matrix
    """(blocks, 2, 2) square root of the mean g g'."""
    texture: Matrix
    """(blocks,) mean square of the gradient."""
    coarse_gradient: tuple[GrayImage, GrayImage]
    """Of the picture at half the resolution: enough to tell texture from noise."""
    coarse_tensor: Matrix
    """(blocks, 3) mean xx, xy and yy of that g g'."""
    energy: Matrix
    """(blocks,) mean square of the picture."""

    @classmethod
    def of(cls, doubled: GrayImage, valid: ByteImage, row_step: int = 1) -> Template:
        """Prepare a reference from a doubled picture; `valid` is 1 where it shows the wall.

        With a `row_step` of 2 every second row is compared, at half the cost: between them a
        low-passed picture holds hardly more.
        """
        image = np.ascontiguousarray(doubled[::2, ::2])
        grid = BlockGrid.over(image.shape)
        gx, gy = (grid.crop(g, row_step) for g in gradient(image))
        xx, xy, yy = (grid.means(product) for product in (gx * gx, gx * gy, gy * gy))
        covered = grid.crop(image, row_step)
        rx, ry = coarse = gradient(_coarse(covered, row_step))
        return cls(
            grid=grid,
            row_step=row_step,
            image=covered,
            seen=grid.means(grid.crop(valid).astype(np.float32)) == 1,
            gradient=(gx, gy),
            root=_root(np.stack([xx, xy, xy, yy], 1).reshape(-1, 2, 2)),
            texture=xx + yy,
            coarse_gradient=coarse,
            coarse_tensor=np.stack([grid.means(p) for p in (rx * rx, rx * ry, ry * ry)], 1),
            energy=grid.means(covered * covered),
        )


@dataclass(frozen=True)
class Prior:
    """What is known of the parameters before the pictures are compared."""

    mean: Matrix
    """(n,)"""
    information: Matrix
    """(n, n) inverse covariance, 0 where nothing is known."""


@dataclass(frozen=True)
class Alignment:
    """Where the moving picture fits the reference."""

    parameters: Matrix
    """(n,)"""
    positions: Points
    """Where the nodes of the reference's blocks lie, to within the last step."""
    covariance: Matrix
    """(n, n), the prior included."""
    free: Matrix
    """(n,) without the habit."""
    free_covariance: Matrix
    """(n, n)"""
    uncertainty_px: Matrix
    """(2,) of where the reference's content lies, along the rows and along the columns."""
    agreement: float
    """Normalised correlation over the overlap, -1 to 1: the share of texture seen again."""
    fidelity: float
    """The same over the blocks that agree, so that dirt and water do not count but noise does."""
    overlap: float
    """Share of the reference's wall that the moving picture shows."""
    trust: Matrix
    """(blocks,) normalised correlation around each block, 0 where nothing is seen."""
    converged: bool
    significance: float
    """Agreement in standard deviations of what unrelated pictures reach by chance; of all blocks,
    or of those that agree clearly: a few clean ones between much dirt are enough."""

    def support(self, reliability: Matrix) -> float:
        """Share of what usually shows the wall, block by block, that agrees."""
        votes = reliability**2
        return float(votes @ self.trust / votes.sum())


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
    habit: Prior | None = None,
    settled: int | None = None,
    enough_px: float = CONVERGED_PX,
) -> Alignment:
    """Fit the parameters of a motion model.

    Args:
        template: The reference.
        doubled: (2 H, 2 W), the moving picture, normalised and low-passed like the reference and
            then doubled: between two pixels bilinear samples err by up to 0.01 px, there by 0.001.
        whole: (H, W), 1 where the moving picture shows all of a block, by `BlockGrid.whole`.
        warp: The motion model, at the nodes of the template's blocks.
        start: (n,) parameters to start from; within about 2 px of the truth everywhere.
        scales: (n,) change of each parameter that moves the content by about a pixel.
        linearise: w(q) and dw/dq, (nodes, 2, n); taken by differences if there is none.
        prior: What is known of the parameters beforehand.
        habit: What they usually are; `Alignment.free` is without it.
        settled: Steps after which what is left is extrapolated (see `_stride`) and goes on while it
            shrinks; None for at most `MOST_STEPS`, each as it is.
        enough_px: The iteration ends where no block has further to go.
    """
    loose = np.diag(1 / ((START_PX if prior is None else OPEN_END_PX) * scales) ** 2)
    nothing = Prior(start, np.zeros_like(loose))
    known, usual = prior or nothing, habit or nothing
    information = loose + known.information + usual.information
    parameters = np.array(start, np.float64)
    positions, slopes = (linearise or _differences(warp, scales))(parameters)
    jacobian = _on_reference(template.grid, positions, slopes)
    rooted = template.root @ jacobian
    stride, moved, left_px, waited = 1.0, np.zeros(0), np.inf, 0
    for taken in range(1, LAST_STEP + 1):
        seen = _compare(template, doubled, whole, positions)
        scores = _scores(jacobian, seen)
        step = -np.linalg.solve(
            _hessian(rooted, seen.weights) + information,
            scores.sum(0)
            + loose @ (parameters - start)
            + known.information @ (parameters - known.mean)
            + usual.information @ (parameters - usual.mean),
        )
        last, moved = moved, jacobian @ step
        extrapolated = settled is not None and taken > settled
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
        positions = warp(parameters)
    # Sandwich: the bread is the Hessian, the filling what the blocks really scatter.
    per_block = template.grid.side_px**2 / CORRELATED_PX
    independent = seen.overlap * template.seen.sum() * per_block
    clear = seen.trust > CLEAR
    observed = template.root @ _common_texture(template, seen, independent).T @ jacobian
    seen_information = _hessian(observed, seen.weights)
    hessian = seen_information + information
    bread = inverse(hessian)
    pull = usual.information @ (parameters - usual.mean)
    unforced = inverse(seen_information + loose + known.information)
    filling = INFLATION * scores.T @ scores + seen.shared * seen_information + information
    covariance = bread @ filling @ bread
    return Alignment(
        parameters=parameters,
        positions=positions,
        covariance=covariance,
        free=parameters + unforced @ pull,
        free_covariance=unforced,
        uncertainty_px=_spread_px(jacobian[template.seen], covariance),
        agreement=seen.agreement,
        fidelity=seen.fidelity,
        overlap=seen.overlap,
        trust=seen.trust,
        converged=left_px < enough_px and bool(seen.weights.any()),
        significance=max(
            seen.agreement * float(np.sqrt(independent)),
            float(seen.trust[clear].mean() * np.sqrt(clear.sum() * per_block))
            if clear.any()
            else 0,
        ),
    )


@dataclass(frozen=True)
class _Comparison:
    """The moving picture, brought onto the reference, against it."""

    picture: GrayImage
    product: Matrix
    """(blocks, 2) mean g r."""
    weights: Matrix
    """(blocks,) information that a block's means carry, free of what they share."""
    shared: float
    """Share of the variance of a displacement that all blocks have in common."""
    trust: Matrix
    agreement: float
    fidelity: float
    overlap: float


def _compare(
    template: Template, doubled: GrayImage, whole: ByteImage, positions: Points
) -> _Comparison:
    grid = template.grid
    cover = template.seen & grid.look_up(whole, positions)
    seen = resample(doubled, grid.dense(2 * positions, template.row_step))
    residual = seen - template.image
    own, power, common = (
        cover * energy
        for energy in (template.energy, grid.means(seen * seen), grid.means(seen * template.image))
    )
    near_own, near_power, near_common = (grid.pooled(v) for v in (own, power, common))
    correlation = near_common / np.sqrt(np.maximum(near_own * near_power, 1e-12))
    trust = np.where(cover, np.clip(correlation, 0.0, 1.0), 0.0)
    variance = own + power - 2 * common
    energy = np.sqrt(own.sum() * power.sum()) + LEAST_ENERGY * len(own)
    vote = trust**2
    weights = vote / (variance + VARIANCE_FLOOR) * grid.side_px**2 / CORRELATED_PX / INFLATION
    # Information about a displacement alike in all blocks, per px^2.  What interpolation, lens and
    # coding leave does not average out over the blocks, so a direction that the picture hardly
    # shows must not be told by it: information of 1 / (1/i + e^2) in the place of i.
    information = float(weights @ template.texture) / 2
    unshared = 1 / (1 + PIXEL_ERROR**2 * information)
    agreeing = np.sqrt((vote @ own) * (vote @ power)) + LEAST_ENERGY
    return _Comparison(
        picture=seen,
        product=np.stack([grid.means(g * residual) for g in template.gradient], 1),
        weights=unshared * weights,
        shared=1 - unshared,
        trust=trust,
        agreement=float(common.sum() / energy),
        fidelity=float(vote @ common / agreeing),
        overlap=float(cover.sum() / max(template.seen.sum(), 1)),
    )


def _stride(stride: float, last: Matrix, moved: Matrix) -> float:
    """How many Gauss-Newton steps there are to go (Aitken's extrapolation; Irons & Tuck 1969).

    The gradients of the reference hold its noise too, which makes every step fall short by the
    same share: each is then a fixed part of the one before, and the sum of all is known. `last`
    and `moved` are the displacements (blocks, 2) of the last step and of this one, taken once.
    """
    left = float((moved * last).sum() / max((last * last).sum(), 1e-12))
    return float(np.clip(stride / max(1 - left, 0.1), 1.0, LONGEST_STRIDE))


def _scores(jacobian: Matrix, seen: _Comparison) -> Matrix:
    """J' g r of each block, weighted, (blocks, n)."""
    weighted = seen.product * seen.weights[:, None]
    return np.asarray((jacobian * weighted[:, :, None]).sum(1))


def inverse(matrix: Matrix) -> Matrix:
    """Of a positive definite matrix whose rows have different units: its diagonal is made 1."""
    size = np.sqrt(np.diag(matrix))
    return np.asarray(np.linalg.inv(matrix / np.outer(size, size)) / np.outer(size, size))


def _spread_px(jacobian: Matrix, covariance: Matrix) -> Matrix:
    """(2,) standard deviation of the displacements J q along each axis, rms over the blocks.

    The mean of the variances j' C j over the rows j of J is the trace of C J' J, over their number.
    """
    variances = [float((rows.T @ rows * covariance).sum()) for rows in np.moveaxis(jacobian, 1, 0)]
    return np.asarray(np.sqrt(np.maximum(variances, 0.0) / max(len(jacobian), 1)))


def _root(tensor: Matrix) -> Matrix:
    """Symmetric square roots of (blocks, 2, 2) tensors A, after Cayley and Hamilton.

    (A + s I) / sqrt(tr A + 2 s) with s^2 = det A.
    """
    side = np.sqrt(np.maximum(np.linalg.det(tensor), 0.0))
    size = np.sqrt(np.maximum(np.trace(tensor, axis1=1, axis2=2) + 2 * side, 1e-12))
    return np.asarray((tensor + side[:, None, None] * np.eye(2)) / size[:, None, None])


def _hessian(rooted: Matrix, weights: Matrix) -> Matrix:
    """Sum of w J' g g' J, (n, n), of roots times Jacobians, (blocks, 2, n)."""
    rows = (rooted * np.sqrt(weights)[:, None, None]).reshape(-1, rooted.shape[-1])
    return np.asarray(rows.T @ rows)


def _common_texture(template: Template, seen: _Comparison, independent: float) -> Matrix:
    """(2, 2) K for which K T K' are the tensors without the gradients of noise, which say nothing.

    The product of two pictures' gradients averages to that of their common texture: with A the mean
    tensor of the template and C that product, the eigenvalues of A^-1/2 C A^-1/2 are the shares of
    A that are texture in two directions.  What they reach by chance is taken off, so that a wall
    of straight lines (the aperture problem) leaves the direction along them open.
    """
    (rx, ry), (sx, sy) = (
        template.coarse_gradient,
        gradient(_coarse(seen.picture, template.row_step)),
    )

    products = (rx * sx, np.float32(0.5) * (rx * sy + ry * sx), ry * sy)
    tensor = np.stack([template.grid.means(product) for product in products], 1)
    both, alone = (
        (seen.weights @ each)[[[0, 1], [1, 2]]] for each in (tensor, template.coarse_tensor)
    )
    alone += (1e-9 * np.trace(alone) + 1e-12) * np.eye(2)
    values, vectors = np.linalg.eigh(alone)
    root = vectors * np.sqrt(values) @ vectors.T
    whitener = vectors / np.sqrt(values) @ vectors.T
    shares, directions = np.linalg.eigh(whitener @ both @ whitener)
    kept = np.clip(shares - BY_CHANCE / np.sqrt(max(independent, 1.0)), 0.0, 1.0)
    return np.asarray(root @ (directions * np.sqrt(kept)) @ directions.T @ whitener)


def _coarse(image: GrayImage, row_step: int) -> GrayImage:
    """Half the resolution, of a crop with that step between its rows."""
    height, width = image.shape
    return reduce_to(image, (width // 2, height * row_step // 2))


def _differences(warp: Warp, scales: Matrix) -> Callable[[Matrix], tuple[Points, Matrix]]:
    steps = DIFFERENCE * scales

    def linearise(parameters: Matrix) -> tuple[Points, Matrix]:
        at, *moved = warp(parameters + np.vstack([np.zeros_like(steps), np.diag(steps)]))
        return at, np.asarray((np.stack(moved, -1) - at[..., None]) / steps)

    return linearise


def _on_reference(grid: BlockGrid, positions: Points, slopes: Matrix) -> Matrix:
    """dw/dq a block, (blocks, 2, n), in the reference's pixels: by (dw/dp)^-1.

    Taken once, at the start: it changes little within the two pixels of an alignment.
    """
    dq = grid.at_nodes(slopes)[1:-1, 1:-1]
    at = grid.at_nodes(positions)
    dx = (at[1:-1, 2:] - at[1:-1, :-2]) / (2 * grid.side_px)
    dy = (at[2:, 1:-1] - at[:-2, 1:-1]) / (2 * grid.side_px)
    # (dw/dp)^-1 of the columns dx, dy: their cofactors over the determinant.
    (a, c), (b, d) = np.moveaxis(dx, -1, 0), np.moveaxis(dy, -1, 0)
    cofactors = np.stack([d, -b, -c, a], -1).reshape(*a.shape, 2, 2)
    on_reference = cofactors / (a * d - b * c)[..., None, None] @ dq
    return np.asarray(np.nan_to_num(on_reference).reshape(-1, 2, slopes.shape[-1]))
