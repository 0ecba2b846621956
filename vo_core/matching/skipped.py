"""Skipped blocks: what a coarse coding repeats in the place of coding it.

At low bit rates an encoder skips most blocks of most pictures, and a skipped block keeps the
texture of the picture before at its old place while the robot drives on.  Such a picture is two
walls in one, one that moves and one that stands still; only new pictures (I frames) are free of it.
Measured at crf 38: 56 % of the blocks repeat the picture before, and agree with the wall with a
correlation of 0.2 where the others have 0.6; in I frames 4 %; below crf 32 hardly any.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.matching.blocks import BlockGrid
from vo_core.types import GrayImage, Matrix

LEAST_WAY_PX = 3.0
"""A shorter way from picture to picture does not set what moves apart from what stands."""

UNLIKE = 0.5
"""Difference of two blocks over that of unrelated ones, above which they do not show the same."""

COARSE = 0.25
"""Share of the blocks by which two pictures of a coarsely coded film differ in what they repeat:
dirt on the lens stays where it is in all, skipped blocks are gone with every new picture."""

MOVED = 0.06
"""Share that moves of the blocks that repeat or move, where the robot does not stand."""

STANDS = 0.85
"""Share of the blocks that lie still in a coarsely coded picture when the robot does."""

_SOFT_PX = 2.0
"""Around a blank block the picture fades: an edge would be texture."""

Blocks = NDArray[np.bool_]
"""(blocks,) of a `BlockGrid`."""


class Skipping:
    """Finds the skipped blocks of a film, frame by frame, once its coding proved to be coarse."""

    def __init__(self, grid: BlockGrid) -> None:
        self._grid = grid
        self._before: GrayImage | None = None
        self._least_repeated = 1.0
        """Share of the blocks in the picture that repeated least, of those of a moving robot."""
        self.is_coarse = False
        """Is the film coded so coarsely that blocks are repeated?"""

    def __call__(self, now: GrayImage, way_px: Matrix) -> Blocks:
        """The blocks of the next picture that only repeat the one before.

        Lines along the way look the same moved and not moved; they are not among them.

        Args:
            now: (H, W), on the developed wall, normalised.
            way_px: (2,), how far the camera should have gone since the picture before, along the
                columns and along the rows.
        Returns:
            All false where the coding is not coarse, or the robot stands still.
        """
        before, self._before = self._before, now
        none = np.zeros(self._grid.rows * self._grid.columns, np.bool_)
        if before is None or np.hypot(*way_px) < LEAST_WAY_PX:
            return none
        power, old_power, still = (self._energy(part) for part in (now, before, now - before))
        alike = UNLIKE * (power + old_power)
        lies_still = float((still < alike).mean())
        if lies_still <= COARSE and not self.is_coarse:
            self._least_repeated = min(self._least_repeated, lies_still)
            return none
        moving = self._energy(now - _moved(before, way_px))
        repeats = (still < alike) & (still < UNLIKE * moving)
        moves = (moving < alike) & (moving < UNLIKE * still)
        repeated = float(repeats.mean())
        if moves.sum() > MOVED * (moves.sum() + repeats.sum()):
            self._least_repeated = min(self._least_repeated, repeated)
            self.is_coarse |= repeated > self._least_repeated + COARSE
        return repeats if self.is_coarse and lies_still < STANDS else none

    def _energy(self, picture: GrayImage) -> Matrix:
        """Mean square of each block, of every fourth row."""
        rows = self._grid.crop(picture, 4)
        return self._grid.means(rows * rows)


def _moved(picture: GrayImage, way_px: Matrix) -> GrayImage:
    """As the camera would see it after the way, to the nearest pixel; 0 where that is unknown."""
    matrix = np.array([[1.0, 0.0, way_px[0]], [0.0, 1.0, way_px[1]]])
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(picture, matrix, picture.shape[::-1], flags=flags))


def blank(grid: BlockGrid, picture: GrayImage, blocks: Blocks) -> GrayImage:
    """A picture without the texture of some blocks: what shows nothing has no vote."""
    if not blocks.any():
        return picture
    side = grid.side_px
    kept = np.ones(picture.shape, np.float32)
    shown = np.kron((~blocks).reshape(grid.rows, grid.columns), np.ones((side, side)))
    height, width = shown.shape
    kept[grid.top_px : grid.top_px + height, grid.left_px : grid.left_px + width] = shown
    return np.asarray(picture * cv2.GaussianBlur(kept, (0, 0), _SOFT_PX))
