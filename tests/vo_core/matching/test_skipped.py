"""Detection of blocks that a coarse coding repeats, among dirt, lines and standstill."""

import numpy as np
import pytest
from textures import texture

from vo_core.matching.blocks import BlockGrid
from vo_core.matching.skipped import Skipping, blank

SHAPE = (160, 240)
GRID = BlockGrid.over(SHAPE)
WAY_PX = 12
WALL = texture((SHAPE[0], 1024), 4, finest_px=2.0).astype(np.float32)
MASKS = np.random.default_rng(1).uniform(size=(40, GRID.rows * GRID.columns)) < 0.5
"""Blocks that are skipped in each picture."""


def view(n, wall=WALL):
    return wall[:, WAY_PX * n : WAY_PX * n + SHAPE[1]].copy()


def pixels(blocks):
    """The pixels of some blocks."""
    mask = np.zeros(SHAPE, bool)
    side = GRID.side_px
    for row, column in np.argwhere(blocks.reshape(GRID.rows, GRID.columns)):
        top, left = GRID.top_px + row * side, GRID.left_px + column * side
        mask[top : top + side, left : left + side] = True
    return mask


def coded(pictures, new_every=5):
    """As a coarse coding shows them: half of the blocks skipped, but in every fifth picture."""
    shown = [pictures[0]]
    for n, picture in enumerate(pictures[1:], start=1):
        skipped = pixels(MASKS[n]) if n % new_every else np.zeros(SHAPE, bool)
        shown.append(np.where(skipped, shown[-1], picture))
    return shown


def found(pictures, way_px=WAY_PX):
    skipping = Skipping(GRID)
    return [skipping(picture, np.array([way_px, 0.0])) for picture in pictures]


def test_skipped_blocks_are_found_once_a_new_picture_was_seen():
    blocks = found(coded([view(n) for n in range(20)]))
    for n in range(6, 20):
        if n % 5 == 0:
            assert blocks[n].mean() < 0.05, "by chance"
        else:
            right = blocks[n] == MASKS[n]
            assert right.mean() > 0.97, "a block at the border may show nothing new"


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_a_film_that_is_coded_well_has_none(noise):
    rng = np.random.default_rng(0)
    pictures = [view(n) + rng.normal(0, noise, SHAPE).astype(np.float32) for n in range(20)]
    assert not any(blocks.any() for blocks in found(pictures))


def test_dirt_repeats_in_every_picture_and_is_not_skipped():
    dirt = pixels(MASKS[0])
    pictures = [np.where(dirt, WALL[:, 500 : 500 + SHAPE[1]], view(n)) for n in range(20)]
    assert not any(blocks.any() for blocks in found(pictures))


def test_lines_along_the_way_are_not_skipped():
    lines = np.repeat(WALL[:, :1], WALL.shape[1], axis=1)
    wall = np.where(np.arange(SHAPE[0])[:, None] < SHAPE[0] // 2, lines, WALL)
    assert not any(blocks.any() for blocks in found([view(n, wall) for n in range(20)]))


def test_a_robot_that_stops_dead_stands_in_all_of_the_picture():
    skipping = Skipping(GRID)
    for picture in coded([view(n) for n in range(12)]):
        skipping(picture, np.array([WAY_PX, 0.0]))
    assert skipping.is_coarse
    skipping(view(12), np.array([WAY_PX, 0.0]))
    assert not skipping(view(12), np.array([WAY_PX, 0.0])).any(), "it should have gone on"


def test_blank_blocks_hold_nothing_and_leave_the_others_alone():
    blocks = np.zeros(GRID.rows * GRID.columns, bool)
    blocks[GRID.columns + 3] = True
    picture = blank(GRID, view(0), blocks)
    changed = picture != view(0)
    rows, columns = np.nonzero(pixels(blocks))
    inside = np.s_[rows.min() + 4 : rows.max() - 3, columns.min() + 4 : columns.max() - 3]
    assert np.abs(picture[inside]).max() < 0.1
    far = np.ones(SHAPE, bool)
    far[rows.min() - 8 : rows.max() + 9, columns.min() - 8 : columns.max() + 9] = False
    assert not changed[far].any()
    assert blank(GRID, view(0), np.zeros_like(blocks)).tolist() == view(0).tolist()


def test_a_picture_of_a_robot_that_hardly_moves_is_no_i_frame():
    pictures = coded([view(n) for n in range(20)])
    skipping = Skipping(GRID)
    is_fresh = []
    for picture in pictures:
        skipping(picture, np.array([WAY_PX, 0.0]))
        is_fresh.append(skipping.is_fresh)
    assert np.flatnonzero(is_fresh).tolist() == [10, 15]
    for _ in range(3):
        assert not skipping(pictures[-1], np.array([0.5, 0.0])).any()
        assert not skipping.is_fresh
