"""Divides pictures into square blocks: smooth fields at their centres, and means over each."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.geometry.wall import Points
from vo_core.image.resample import resample_mask
from vo_core.types import AnyImage, ByteImage, GrayImage, Matrix

BLOCK_PX = 16


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
        """Blocks of `BLOCK_PX`, or smaller ones where fewer than six would fit along a side."""
        side = next((s for s in (BLOCK_PX, BLOCK_PX // 2) if min(shape) >= 6 * s), BLOCK_PX // 4)
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

    def dense(self, positions: Points, row_step: int = 1) -> GrayImage:
        """Interpolate positions at the nodes to every pixel of a `crop`, (H, W, 2), bilinear."""
        coarse = np.nan_to_num(self.at_nodes(positions), nan=-1e4).astype(np.float32)
        side = self.side_px
        size_wh = ((self.columns + 2) * side, (self.rows + 2) * side)
        dense = cv2.resize(coarse, size_wh, interpolation=cv2.INTER_LINEAR)
        return np.ascontiguousarray(dense[side:-side:row_step, side:-side])

    def whole(self, valid: ByteImage) -> ByteImage:
        """(H, W) mask: 1 around which a whole block, even a little turned, fits into `valid`."""
        side = self.side_px + self.side_px // 8 + 1
        return np.asarray(
            cv2.erode(valid, np.ones((side, side), np.uint8), borderValue=0), np.uint8
        )

    def look_up(self, mask: ByteImage, positions: Points) -> NDArray[np.bool_]:
        """Look up a mask at the positions of the blocks' centres, nearest pixel, (blocks,)."""
        centres = np.nan_to_num(self.at_nodes(positions)[1:-1, 1:-1], nan=-1e4)
        return resample_mask(mask, centres.astype(np.float32)).ravel() > 0

    def means(self, image: GrayImage) -> Matrix:
        """Mean of each block of a `crop` of any resolution, (blocks,)."""
        means = cv2.resize(image, (self.columns, self.rows), interpolation=cv2.INTER_AREA)
        return np.asarray(means, np.float64).ravel()

    def pooled(self, values: Matrix) -> Matrix:
        """Average block values with their neighbours: a single block holds too little texture."""
        pooled = cv2.blur(
            values.reshape(self.rows, self.columns), (3, 3), borderType=cv2.BORDER_REPLICATE
        )
        return np.asarray(pooled, np.float64).ravel()
