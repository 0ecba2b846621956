"""Detects skipped blocks, which a coarse coding repeats instead of coding them.

At low bit rates an encoder skips most blocks of most pictures, and a skipped block keeps the
texture of the picture before at its old place while the robot drives on. Such a picture mixes a
wall that moves with one that stands still; only I frames hold no skipped blocks. Measured at crf
38: 56 % of the blocks repeat the picture before, and agree with the wall with a correlation of 0.2
where the others have 0.6; in I frames 4 %; below crf 32 hardly any.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.matching.blocks import BlockGrid
from vo_core.types import GrayImage, Matrix

LEAST_WAY_PX = 3.0
"""Over a shorter distance between two pictures, moving and standing blocks look alike."""

UNLIKE = 0.5
"""Two blocks show different content above this share of the difference of unrelated ones."""

SAME = 0.4
"""A block is a copy below this share of what two alike ones may differ by: only copies show that
blocks are skipped, because a mixture of two exposures is alike to the picture before."""

COARSE = 0.25
"""A film is coarsely coded if its share of repeated blocks varies by more than this.

Dirt on the lens stays in its place in all pictures; skipped blocks disappear with every I frame."""

MOVED = 0.06
"""The robot moves if more than this share of the repeated and moving blocks move."""

STANDS = 0.85
"""In a coarsely coded film the robot stands still if this share of the blocks does."""

FRESH = 0.1
"""A picture of a coarsely coded film with a smaller share of repeated blocks counts as an I
frame."""

Blocks = NDArray[np.bool_]
"""(blocks,) of a `BlockGrid`."""


class Skipping:
    """Detects the skipped blocks of each frame, once the film has proved to be coarsely coded."""

    def __init__(self, grid: BlockGrid, *, is_coarse: bool = False) -> None:
        """`is_coarse` is whether pictures of the film before these have shown it."""
        self._grid = grid
        self._before: tuple[GrayImage, GrayImage, Matrix] | None = None
        """The last picture, its rows that are compared, and the mean square of their blocks."""
        self._least_repeated = 1.0
        """Smallest share of repeated blocks in a picture so far, while the robot moved."""
        self.is_coarse = is_coarse
        """Whether the film is coded so coarsely that blocks are repeated."""
        self.is_fresh = False
        """Whether the last picture is an I frame of a coarsely coded film.

        It is unknown, and false, where the robot hardly moves."""

    def __call__(self, now: GrayImage, way_px: Matrix) -> Blocks:
        """Detect the blocks of the next picture that only repeat the picture before.

        Blocks that look the same moved and not moved, such as lines along the way, do not count.

        Args:
            now: (H, W), on the developed wall, normalised.
            way_px: (2,), expected motion of the camera since the picture before, along the columns
                and along the rows.
        Returns:
            (blocks,); all false if the coding is not coarse or the robot stands still.
        """
        row_step = 4
        rows = self._grid.crop(now, row_step)
        power = self._grid.means(rows * rows)
        kept, self._before = self._before, (now, rows, power)
        self.is_fresh = False
        none = np.zeros(self._grid.rows * self._grid.columns, np.bool_)
        if kept is None or np.hypot(*way_px) < LEAST_WAY_PX:
            return none
        before, old_rows, old_power = kept
        change = rows - old_rows
        still = self._grid.means(change * change)
        alike = UNLIKE * (power + old_power)
        lies_still = float((still < alike).mean())
        if lies_still <= COARSE and not self.is_coarse:
            self._least_repeated = min(self._least_repeated, lies_still)
            return none
        change = rows - self._grid.crop(_moved(before, way_px), row_step)
        moving = self._grid.means(change * change)
        repeats = (still < alike) & (still < UNLIKE * moving)
        moves = (moving < alike) & (moving < UNLIKE * still)
        repeated = float(repeats.mean())
        if moves.sum() > MOVED * (moves.sum() + repeats.sum()):
            copied = float((repeats & (still < SAME * alike)).mean())
            self._least_repeated = min(self._least_repeated, copied)
            self.is_coarse |= copied > self._least_repeated + COARSE
        if not self.is_coarse or lies_still >= STANDS:
            return none
        self.is_fresh = repeated < FRESH
        return repeats

    def forget(self) -> None:
        """Leave out the next comparison, because the next picture has another vantage."""
        self._before = None


def _moved(picture: GrayImage, way_px: Matrix) -> GrayImage:
    """Shift a picture by the camera's motion, to the nearest pixel; 0 where nothing is known."""
    matrix = np.array([[1.0, 0.0, way_px[0]], [0.0, 1.0, way_px[1]]])
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(picture, matrix, picture.shape[::-1], flags=flags))


def blank(grid: BlockGrid, picture: GrayImage, blocks: Blocks) -> GrayImage:
    """Blank some blocks of a picture, so that they get no weight."""
    # Sigma of the fading around a blank block, because an edge would count as texture.
    soft_px = 2.0
    if not blocks.any():
        return picture
    side = grid.side_px
    kept = np.ones(picture.shape, np.float32)
    shown = np.kron((~blocks).reshape(grid.rows, grid.columns), np.ones((side, side)))
    height, width = shown.shape
    kept[grid.top_px : grid.top_px + height, grid.left_px : grid.left_px + width] = shown
    return np.asarray(picture * cv2.GaussianBlur(kept, (0, 0), soft_px))
