"""Overlapping patches of the unrolled wall, joined from its tiles.

Block k of the wall is two tiles, k * `BLOCK_TILES` and the next. Its patch goes on into both
neighbours by `OVERLAP_MM`, and beyond the seam if the wall is a ring, so that whatever lies on a
border is whole in one of the patches.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import isclose, pi

import numpy as np

from vo_core.mosaic.layout import UNSEEN_GREY, Layout
from vo_core.mosaic.mosaic import Tile
from vo_core.rig import Rig
from vo_core.types import ByteImage, GrayImage, Matrix

BLOCK_TILES = 2
"""Tiles of a block."""

OVERLAP_MM = 200.0
"""How far a patch goes on beyond its block, along the pipe and beyond the seam of a ring."""


@dataclass(frozen=True)
class WallPatch:
    """A piece of the developed wall; column is the raw axial coordinate, row the arc."""

    image: ByteImage
    """(H, W, 3) BGR."""
    weight: GrayImage
    """(H, W) how well each place was seen, 1 completely, 0 not at all."""
    axial_from_mm: float
    """Raw axial coordinate of the left border: column j covers [j, j + 1) * mm_per_px from it."""
    arc_from_mm: float
    """Arc of the upper border: row i covers [i, i + 1) * arc_mm_per_px from it."""
    mm_per_px: float
    """Along the pipe."""
    arc_mm_per_px: float
    """Around the pipe; within 1 % of mm_per_px."""
    girth_mm: float | None
    """Circumference where the rows are a whole ring (and repeat beyond the seam), else None."""

    def to_mm(self, pixels: Matrix) -> Matrix:
        """Axial and arc (n, 2) of pixels (n, 2) as column and row; pixel centres are integers."""
        step = np.array([self.mm_per_px, self.arc_mm_per_px])
        from_mm = np.array([self.axial_from_mm, self.arc_from_mm])
        return np.asarray(from_mm + (pixels + 0.5) * step)


def girth_of(rig: Rig, layout: Layout) -> float | None:
    """Circumference if the rows of the wall are a whole ring, None otherwise."""
    if rig.pipe.radius_mm is None:
        return None
    girth_mm = 2 * pi * rig.pipe.radius_mm
    return girth_mm if isclose(layout.arc_to_mm - layout.arc_from_mm, girth_mm) else None


def blocks_of(indices: Iterable[int]) -> list[int]:
    """Blocks, in ascending order, that hold any of these tiles."""
    return sorted({index // BLOCK_TILES for index in indices})


def tiles_of(block: int) -> range:
    """Tiles from which the patch of a block is made: its own, and one beyond either end."""
    return range(block * BLOCK_TILES - 1, (block + 1) * BLOCK_TILES + 1)


def patch_of(
    layout: Layout, block: int, read: Callable[[int], Tile | None], *, girth_mm: float | None
) -> WallPatch:
    """Join the patch of a block.

    Args:
        layout: Raster of the tiles.
        block: Its number; `blocks_of`.
        read: Returns a tile by its index, None where nothing was seen. It is asked for `tiles_of`.
        girth_mm: `girth_of` the rig.
    """
    shape = (layout.height_px, layout.width_px)
    images, weights = [], []
    for index in tiles_of(block):
        tile = read(index)
        images.append(np.full((*shape, 3), UNSEEN_GREY, np.uint8) if tile is None else tile.picture)
        weights.append(np.zeros(shape, np.float32) if tile is None else tile.weight)
    beyond = min(round(OVERLAP_MM / layout.mm_per_px), layout.width_px)
    kept = slice(layout.width_px - beyond, (BLOCK_TILES + 1) * layout.width_px + beyond)
    row_mm = (layout.arc_to_mm - layout.arc_from_mm) / layout.height_px
    around = 0 if girth_mm is None else min(round(OVERLAP_MM / row_mm), layout.height_px)
    image, weight = np.hstack(images)[:, kept], np.hstack(weights)[:, kept]
    rows = np.arange(-around, layout.height_px + around) % layout.height_px
    return WallPatch(
        image=np.ascontiguousarray(image[rows]),
        weight=np.ascontiguousarray(weight[rows]),
        axial_from_mm=block * BLOCK_TILES * layout.tile_mm - beyond * layout.mm_per_px,
        arc_from_mm=layout.arc_from_mm - around * row_mm,
        mm_per_px=layout.mm_per_px,
        arc_mm_per_px=row_mm,
        girth_mm=girth_mm,
    )
