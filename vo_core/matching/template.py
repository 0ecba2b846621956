"""Compares a reference picture with a moving one, block by block, at given positions.

A block is the unit of the vote: blocks with water, glare, text or dirt have a low normalised
correlation (NCC) and get no weight.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.geometry.wall import Points
from vo_core.image.filters import exact_gradient
from vo_core.image.resample import even_pixels_of_double, resample_at
from vo_core.matching.blocks import BlockGrid
from vo_core.types import ByteImage, GrayImage, Matrix

INFLATION = 6.0
"""Variance of an alignment over the variance computed from the scatter between its blocks.

The errors of blocks are correlated, as video coding moves many of them alike.  Measured on coded
video."""


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

    @property
    def values_per_block(self) -> float:
        """Number of independent values in a block."""
        # After a low-pass of sigma 1 about 4 pi sigma^2 pixels hold one.
        return self.grid.side_px**2 / 12.0

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
class Comparison:
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
    independent: float
    """Number of independent values that both pictures show."""


def compare(
    template: Template, doubled: GrayImage, whole: ByteImage, positions: Points, fit: Matrix
) -> Comparison:
    """Compare at the positions of the nodes, of which `fit` is the linear fit in each block."""
    pixel_error = 0.01  # displacement error, px, that all blocks share, however good the picture
    # Mean square up to which a normalised picture counts as blank, as rounding errors correlate.
    least_energy = 1e-3
    # Residual variance, for a texture of variance 1, below which a block's weight no longer grows.
    variance_floor = 0.02
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
    energy = np.sqrt(total_own * total_power) + least_energy * len(own)
    vote = ncc * ncc
    weights = vote / (variance + variance_floor) * (template.values_per_block / INFLATION)
    # Information about a displacement of all blocks together, per px^2.  Errors of interpolation,
    # lens and coding do not average out over the blocks, so they must not determine a direction
    # that the picture hardly shows: the information i becomes 1 / (1/i + e^2).
    information = float(weights @ template.texture) / 2
    unshared = 1 / (1 + pixel_error**2 * information)
    voted_own, voted_power, voted_common = (vote @ energies).tolist()
    overlap = float(cover.sum() / max(template.seen.sum(), 1))
    return Comparison(
        picture=seen,
        product=(means[:, :2] - template.own[:, :2]).T,
        weights=unshared * weights,
        shared=1 - unshared,
        ncc=ncc,
        agreement=total_common / energy,
        fidelity=voted_common / (np.sqrt(voted_own * voted_power) + least_energy),
        overlap=overlap,
        independent=overlap * template.seen.sum() * template.values_per_block,
    )


Likeness = tuple[Matrix, float]
"""How two pictures agree at one pose: correlation of each block, and agreement, see `Alignment`."""


def agree(template: Template, doubled: GrayImage, whole: ByteImage, positions: Points) -> Likeness:
    """Compare two pictures where the nodes lie at `positions`."""
    seen = compare(template, doubled, whole, positions, template.grid.linear(positions))
    return seen.ncc, seen.agreement


def common_texture(template: Template, seen: Comparison) -> Matrix:
    """(2, 2) K such that K T K' are the tensors T without the gradients of noise.

    The product of two pictures' gradients averages to that of their common texture. With A the mean
    tensor of the template and C that product, the eigenvalues of A^-1/2 C A^-1/2 are the shares of
    texture in A along two directions. The share expected by chance is subtracted, so that a wall of
    straight lines (the aperture problem) leaves the direction along them open.
    """
    # Common texture counts only beyond this many standard deviations of a chance correlation.
    by_chance = 5.0
    moving = _coarse_gradient(template.grid, seen.picture, template.row_step)
    weighted = (template.coarse_gradient * seen.weights.astype(np.float32)).reshape(2, -1)
    both = (weighted @ moving.reshape(2, -1).T).astype(np.float64)
    xx, xy, yy = (template.coarse_tensor @ seen.weights).tolist()
    least = 1e-9 * (xx + yy) + 1e-12
    root = _root(xx + least, xy, yy + least)
    whitener = np.linalg.inv(root)
    shares, directions = np.linalg.eigh(whitener @ (both + both.T) @ whitener / 2)
    kept = np.clip(shares - by_chance / np.sqrt(max(seen.independent, 1.0)), 0.0, 1.0)
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


def _root(xx: Matrix | float, xy: Matrix | float, yy: Matrix | float) -> Matrix:
    """(2, 2, ...) symmetric square roots of tensors A, after Cayley and Hamilton.

    (A + s I) / sqrt(tr A + 2 s) with s^2 = det A.
    """
    tensor = np.array([[xx, xy], [xy, yy]])
    side: Matrix = np.sqrt(np.abs(tensor[0, 0] * tensor[1, 1] - tensor[0, 1] ** 2))
    tensor[0, 0] += side
    tensor[1, 1] += side
    return np.asarray(tensor / np.sqrt(tensor[0, 0] + tensor[1, 1] + 1e-12))
