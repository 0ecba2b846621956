"""Divides pictures into square blocks: smooth fields at their centres, and means over each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.geometry.wall import Points
from vo_core.image.resample import resample_mask
from vo_core.types import AnyImage, ByteImage, GrayImage, Matrix


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
        """Blocks of 16 px, or smaller ones where fewer than six would fit along a side."""
        side = next((side for side in (16, 8) if min(shape) >= 6 * side), 4)
        rows, columns = shape[0] // side, shape[1] // side
        return cls(
            rows, columns, side, (shape[0] - rows * side) // 2, (shape[1] - columns * side) // 2
        )

    def crop(self, image: AnyImage, row_step: int = 1) -> AnyImage:
        """Crop a picture to the part that the blocks cover, and keep every `row_step`-th row."""
        height, width = self.rows * self.side_px, self.columns * self.side_px
        bottom, right = self.top_px + height, self.left_px + width
        return np.ascontiguousarray(image[self.top_px : bottom : row_step, self.left_px : right])

    def nodes(self) -> Points:
        """Centres of the blocks and of one ring around them, ((rows + 2) (columns + 2), 2) px."""
        x = (np.arange(-1, self.columns + 1) + 0.5) * self.side_px - 0.5 + self.left_px
        y = (np.arange(-1, self.rows + 1) + 0.5) * self.side_px - 0.5 + self.top_px
        return np.stack(np.meshgrid(x, y), -1).reshape(-1, 2).astype(np.float64)

    def at_nodes(self, values: Points) -> Points:
        """Reshape values at `nodes` to (rows + 2, columns + 2, ...)."""
        return values.reshape(self.rows + 2, self.columns + 2, *values.shape[1:])

    def centres(self, values: Points) -> Points:
        """Select the values at the blocks' centres from those at `nodes`, (blocks, ...)."""
        return self.at_nodes(values)[1:-1, 1:-1].reshape(-1, *values.shape[1:])

    def dense(self, positions: Points) -> GrayImage:
        """Interpolate positions at the nodes to every pixel of a `crop`, (H, W, 2), bilinear."""
        coarse = _finite(self.at_nodes(positions))
        side = self.side_px
        size_wh = ((self.columns + 2) * side, (self.rows + 2) * side)
        dense = cv2.resize(coarse, size_wh, interpolation=cv2.INTER_LINEAR)
        return np.ascontiguousarray(dense[side:-side, side:-side])

    def tiles(self, image: AnyImage, row_step: int = 1) -> AnyImage:
        """Cut a `crop` into blocks, (blocks, pixels of a block)."""
        side, high = self.side_px, self.side_px // row_step
        tiles = self.crop(image, row_step).reshape(self.rows, high, self.columns, side)
        return np.ascontiguousarray(tiles.swapaxes(1, 2)).reshape(-1, high * side)

    def linear(self, positions: Points) -> Matrix:
        """Linear fit to positions at the nodes in each block, (2, blocks, 3).

        The column and the row at its centre, then their slopes along the rows and down the columns.
        """
        at, step_px = self.at_nodes(positions).T.swapaxes(1, 2), 2 * self.side_px
        fit = np.empty((2, self.rows, self.columns, 3))
        fit[..., 0] = at[:, 1:-1, 1:-1]
        fit[..., 1] = (at[:, 1:-1, 2:] - at[:, 1:-1, :-2]) / step_px
        fit[..., 2] = (at[:, 2:, 1:-1] - at[:, :-2, 1:-1]) / step_px
        return fit.reshape(2, -1, 3)

    def spread(self, fit: Matrix, row_step: int = 1) -> GrayImage:
        """Positions of the pixels of all `tiles` by a `linear` fit, (2, blocks, pixels)."""
        places = _finite(fit).reshape(-1, 3) @ _offsets(self.side_px, row_step)
        return np.asarray(places).reshape(2, self.rows * self.columns, -1)

    def whole(self, valid: ByteImage) -> ByteImage:
        """(H, W) mask: 1 around which a whole block, even a little turned, fits into `valid`."""
        side = self.side_px + self.side_px // 8 + 1
        return np.asarray(
            cv2.erode(valid, np.ones((side, side), np.uint8), borderValue=0), np.uint8
        )

    def look_up(self, mask: ByteImage, positions: Points) -> NDArray[np.bool_]:
        """Look up a mask at the positions of the blocks' centres, nearest pixel, (blocks,)."""
        centres = _finite(self.at_nodes(positions)[1:-1, 1:-1])
        return resample_mask(mask, centres).ravel() > 0

    def means(self, image: GrayImage) -> Matrix:
        """Mean of each block of a `crop` of any resolution, (blocks,)."""
        means = cv2.resize(image, (self.columns, self.rows), interpolation=cv2.INTER_AREA)
        return np.asarray(means, np.float64).ravel()

    def pooled(self, values: Matrix) -> Matrix:
        """Average values of blocks, (blocks, n), over each block and its neighbours.

        A single block holds too little texture.
        """
        pooled = cv2.blur(
            values.reshape(self.rows, self.columns, -1), (3, 3), borderType=cv2.BORDER_REPLICATE
        )
        return np.asarray(pooled, np.float64).reshape(values.shape)


def _finite(positions: Points) -> GrayImage:
    """Positions in single precision; far outside of any picture where there are none."""
    return np.fmax(positions, -1e4).astype(np.float32)


@lru_cache(maxsize=16)
def _offsets(side_px: int, row_step: int) -> GrayImage:
    """(3, pixels) 1, column and row of each pixel of a block, from its centre."""
    row, column = np.mgrid[:side_px:row_step, :side_px].reshape(2, -1) - (side_px - 1) / 2
    return np.stack([np.ones_like(row), column, row]).astype(np.float32)
