"""The unrolled wall against the walls that were rendered: what is where, and how it looks."""

import tracemalloc
from dataclasses import replace

import cv2
import numpy as np
import pytest
from shares import first_of
from textures import make_rig
from worlds import World, floor_rig, glass, small_rig, speckle, stored

from vo_core import Estimate, InvalidRig
from vo_core.geometry.rectify import BOTTOM, TOP
from vo_core.geometry.wall import enclose
from vo_core.mosaic.layout import FINEST_MM, MOST_PX, TILE_MM, UNSEEN_GREY, Layout
from vo_core.mosaic.mosaic import OPEN_S, SHELF, Mosaic
from vo_core.mosaic.optics import NODE_PX

FISHEYE = {"model": "fisheye", "fx": 105.0, "fy": 105.0}
RIGS = {
    "pipe": small_rig(),
    "turned": small_rig(mount={"rotation_deg": 30.0}),
    "floor": floor_rig(),
    "fisheye ahead": small_rig(camera=FISHEYE, mount={"view": "forward"}),
}


def estimate(x_mm, y_mm=0.0, yaw_deg=0.0, *, frame=0, status="ok", sigma_mm=0.0):
    return Estimate(frame, frame / 30, x_mm, y_mm, yaw_deg, x_mm, sigma_mm, 1.0, status, sigma_mm)


def drive(rig, x_mm, light=1.0, mosaic=None, **about):
    """The tiles of a run along true poses, by index; each frame through lamp and sensor."""
    world = World(rig, speckle(3))
    mosaic, tiles = mosaic or Mosaic(rig), {}
    for frame, x in enumerate(np.asarray(x_mm, float)):
        at = estimate(x, 5 * np.sin(x / 90), 2 * np.sin(x / 70), frame=frame, **about)
        if mosaic.wants(at):
            lit = world.view(at.x_mm, at.y_mm, at.yaw_deg) * light
            mosaic.add(stored(lit, frame), at)
        tiles |= {tile.index: tile.picture for tile in mosaic.changed()}
    return tiles | {tile.index: tile.picture for tile in mosaic.finish()}


def truth(rig, layout, index):
    """The rendered wall itself at the pixels of a tile."""
    world = World(rig, speckle(3))
    arc_step = (layout.arc_to_mm - layout.arc_from_mm) / layout.height_px
    arc = layout.arc_from_mm + (np.arange(layout.height_px) + 0.5) * arc_step
    axial = index * TILE_MM + (np.arange(layout.width_px) + 0.5) * layout.mm_per_px
    along, around = np.meshgrid(axial.astype(np.float32), arc.astype(np.float32))
    return world.light((along, around))


def shift_mm(picture, true, seen, mm_per_px):
    """How far a picture lies off the truth, along and around, where it was seen."""
    detail, true_detail = (
        (image - cv2.GaussianBlur(image, (0, 0), 6)) * seen for image in (picture, true)
    )
    (dx, dy), _ = cv2.phaseCorrelate(true_detail.astype(np.float64), detail.astype(np.float64))
    return dx * mm_per_px, dy * mm_per_px


def inner(tile):
    """Grey picture of a tile, and 1 where it was seen but for its border."""
    seen = (tile != UNSEEN_GREY).any(axis=2).astype(np.uint8)
    seen = cv2.morphologyEx(seen, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    return cv2.cvtColor(tile, cv2.COLOR_BGR2GRAY).astype(np.float32), cv2.erode(
        seen, np.ones((9, 9), np.uint8)
    )


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())
def test_a_tile_shows_the_wall_where_it_is(rig):
    layout = Layout.of(rig)
    begin = -400 if rig.mount.view == "forward" else -150
    tile = drive(rig, np.arange(begin, 650, 8), glass(rig, dust=0))[0]
    picture, seen = inner(tile)
    true = truth(rig, layout, 0)
    share = seen.mean()
    assert share > 0.5
    low, high = (cv2.GaussianBlur(image, (0, 0), 1.5) for image in (picture, true))
    assert np.corrcoef(low[seen > 0], high[seen > 0])[0, 1] > 0.85
    assert np.hypot(*shift_mm(picture, true, seen, layout.mm_per_px)) < 0.15


@pytest.mark.parametrize("first", first_of(1, [BOTTOM, TOP]))
def test_of_an_interlaced_picture_the_field_of_its_pose_is_painted(first):
    """The other field shows the wall elsewhere, so that a woven picture shows everything twice."""
    rig = RIGS["pipe"]
    world, woven, still = World(rig, speckle(3)), Mosaic(rig), Mosaic(rig)
    for frame, x in enumerate(np.arange(-150.0, 650.0, 8.0)):
        picture, later = (stored(world.view(at), frame) for at in (x, x + 4.0))
        still.add(picture, estimate(x, frame=frame))
        picture[1 - first.first :: 2] = later[1 - first.first :: 2]
        woven.add(picture, estimate(x, frame=frame), first)
    (found, seen), (wanted, _) = (
        inner({tile.index: tile.picture for tile in mosaic.finish()}[0])
        for mosaic in (woven, still)
    )
    assert np.corrcoef(found[seen > 0], wanted[seen > 0])[0, 1] > 0.9


def test_the_lamp_leaves_no_bands_and_the_wall_keeps_its_tones():
    rig = RIGS["pipe"]
    wall_tone = 1 + 0.3 * np.sin(np.arange(speckle(3).shape[1]) / 400)
    world = World(rig, (1 + 0.05 * speckle(3)) * wall_tone.astype(np.float32), contrast_grey=60)
    mosaic = Mosaic(rig)
    for frame, x in enumerate(np.arange(-200, 700, 8.0)):
        mosaic.add(stored(world.view(x) * glass(rig, dust=0), frame), estimate(x, frame=frame))
    tiles = {tile.index: tile.picture for tile in mosaic.finish()}
    picture, seen = inner(tiles[0])
    middle = slice(*np.flatnonzero(seen.mean(axis=1) > 0.99)[[0, -1]])
    along = picture[middle].mean(axis=0)
    layout = mosaic.layout
    axial = (np.arange(layout.width_px) + 0.5) * layout.mm_per_px
    true = world.light(np.meshgrid(axial.astype(np.float32), np.zeros(1, np.float32)))[0]
    smooth = [
        cv2.GaussianBlur(row[None].astype(np.float32), (0, 0), 12)[0] for row in (along, true)
    ]
    ratio = smooth[0] / smooth[1]
    assert np.corrcoef(*smooth)[0, 1] > 0.9
    assert ratio.std() / ratio.mean() < 0.05
    around = picture[middle].mean(axis=1)
    assert around.std() / around.mean() < 0.04, "the lamp's spot and the vignette are gone"


def test_colour_comes_through():
    rig = RIGS["floor"]
    world, mosaic = World(rig, speckle(3)), Mosaic(rig)
    for frame, x in enumerate(np.arange(0, 300, 8.0)):
        grey = stored(world.view(x), frame)
        rust = np.stack([grey * 0.6, grey * 0.8, grey], -1).astype(np.uint8)
        mosaic.add(rust, estimate(x, frame=frame))
    (tile,) = [tile.picture for tile in mosaic.finish() if tile.index == 0]
    blue, green, red = tile[:, 100:500][inner(tile[:, 100:500])[1] > 0].mean(axis=0)
    assert red > 1.15 * green > 1.3 * blue


def test_there_and_back_the_first_picture_stays():
    rig, x_mm = RIGS["pipe"], np.arange(-200, 900, 8.0)
    mosaic = Mosaic(rig)
    there = drive(rig, x_mm, mosaic=mosaic)
    back = {}
    for frame, x in enumerate(x_mm[::-1]):  # out of focus, and a few millimetres off
        at = estimate(x + 3, frame=500 + frame, sigma_mm=2.0)
        if mosaic.wants(at):
            blurred = cv2.GaussianBlur(World(rig, speckle(3)).view(x), (0, 0), 8)
            mosaic.add(stored(blurred, frame), at)
        back |= {tile.index: tile.picture for tile in mosaic.changed()}
    back |= {tile.index: tile.picture for tile in mosaic.finish()}
    assert 0 in there
    assert 0 not in back, "a tile that is whole is not touched again"
    kept = inner(there[1])[1] > 0
    kept[:, -100:] = False  # where the first run ended there was a border
    difference = back.get(1, there[1]).astype(float) - there[1]
    assert np.abs(difference[kept]).mean() < 2


def test_a_tile_with_a_gap_is_filled_on_the_way_back():
    rig = RIGS["pipe"]
    mosaic = Mosaic(rig)
    there = np.concatenate([np.arange(-200, 100, 8.0), np.arange(400, 1800, 8.0)])
    first = inner(drive(rig, there, mosaic=mosaic)[0])[1]
    again = inner(drive(rig, np.arange(1800, -200, -8.0), mosaic=mosaic)[0])[1]
    assert first[:, 430:570].mean() < 0.1
    assert again[:, 430:570].mean() > 0.6


def test_lost_frames_are_not_painted():
    rig = RIGS["pipe"]
    assert drive(rig, np.arange(0, 300, 8.0), status="lost") == {}


def test_a_picture_that_stands_still_is_painted_once():
    mosaic = Mosaic(RIGS["pipe"])
    picture = stored(World(RIGS["pipe"], speckle(3)).view(), 0)
    assert mosaic.wants(estimate(0.0))
    mosaic.add(picture, estimate(0.0))
    assert not mosaic.wants(estimate(0.5, frame=1))


def test_growing_tiles_are_published_once_a_second_and_left_ones_at_once():
    rig = RIGS["floor"]
    picture, mosaic = stored(World(rig, speckle(3)).view(), 0), Mosaic(rig)
    mosaic.add(picture, estimate(250.0))
    assert [tile.index for tile in mosaic.changed()] == [0]
    later = replace(estimate(300.0, frame=1), time_s=0.5 * OPEN_S)
    mosaic.add(picture, later)
    assert mosaic.changed() == []
    mosaic.add(picture, replace(estimate(350.0, frame=2), time_s=1.1 * OPEN_S))
    assert [tile.index for tile in mosaic.changed()] == [0]
    mosaic.add(picture, replace(estimate(380.0, frame=3), time_s=1.2 * OPEN_S))
    mosaic.add(picture, replace(estimate(2250.0, frame=4), time_s=1.3 * OPEN_S))
    assert [tile.index for tile in mosaic.changed()] == [0]


def test_a_long_way_takes_no_more_memory_than_a_short_one():
    rig = RIGS["floor"]
    picture, mosaic = stored(World(rig, speckle(3)).view(), 0), Mosaic(rig)
    held = []
    tracemalloc.start()
    for frame, x in enumerate(np.arange(0, 20_000, 80.0)):
        mosaic.add(picture, estimate(x, frame=frame))
        mosaic.changed()
        held.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert max(held[-80:]) < max(held[:80]) + 100_000


def test_many_gaps_are_kept_within_bounds():
    rig = RIGS["floor"]
    picture, mosaic = stored(World(rig, speckle(3)).view(), 0), Mosaic(rig)
    tracemalloc.start()
    held = []
    for frame in range(2 * SHELF):  # one frame a tile: none is ever whole
        mosaic.add(picture, estimate(3 * TILE_MM * frame, frame=frame))
        mosaic.changed()
        held.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert max(held[-8:]) < max(held[: SHELF + 8]) + 200_000


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())
def test_the_raster_is_as_fine_as_sensible_and_fits_the_pipe(rig):
    layout = Layout.of(rig)
    assert layout.width_px * layout.mm_per_px == pytest.approx(TILE_MM)
    assert layout.mm_per_px >= FINEST_MM
    assert layout.width_px * layout.height_px <= 1.05 * MOST_PX
    assert layout.height_px % NODE_PX == 0
    row_mm = (layout.arc_to_mm - layout.arc_from_mm) / layout.height_px
    assert row_mm == pytest.approx(layout.mm_per_px, rel=0.05)
    if rig.mount.view == "forward":
        ends = enclose(rig, np.array([[0, layout.arc_from_mm], [0, layout.arc_to_mm]]))
        assert ends[0] == pytest.approx(ends[1], abs=1), "the ring closes at the crown"


def test_a_view_with_hardly_any_wall_is_refused():
    up = make_rig(
        camera={"model": "fisheye", "fx": 105.0, "fy": 400.0},
        mount={"height_mm": 150.0, "pitch_deg": -79.0, "lateral_mm": 30.0, "rotation_deg": 90.0},
        pipe={"shape": "flat", "diameter_mm": None},
    )
    with pytest.raises(InvalidRig, match="in a few places only"):
        Mosaic(up)
