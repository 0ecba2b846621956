"""Interlaced films: found in the pictures alone, and measured on the field of the frame's time."""

import pickle
from functools import lru_cache

import cv2
import numpy as np
import pytest
from textures import texture
from worlds import World, floor_rig, follow, speckle, stored

from vo_core.geometry.rectify import BOTTOM, TOP, WHOLE, Rectifier
from vo_core.matching.fields import Interlacing

SHAPE = (240, 320)
STEP_PX = 10.0
"""From field to field, along the rows or down."""
ORDERS = pytest.mark.parametrize("first", [TOP, BOTTOM], ids=["top first", "bottom first"])


@lru_cache(maxsize=8)
def moments(count, *, along=STEP_PX, down=0.0, still=2, lines_px=None):
    """Pictures of a wall that begins to pass by, half a frame apart, (H, W) uint8 each."""
    wall = texture((512, 1024), 3, finest_px=2.0).astype(np.float32)
    row, column = np.indices(SHAPE, np.float32)
    travelled = np.cumsum([0.0] * still + [min(1.0, (n + 1) / 12) for n in range(count)])
    pictures = []
    for n, way in enumerate(travelled[:count].astype(np.float32)):
        seen = cv2.remap(
            wall,
            column + np.float32(along) * way,
            row + np.float32(down) * way,
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_WRAP,
        )
        light = np.float32(110) + 20 * seen
        if lines_px is not None:
            light += 15 * np.cos(2 * np.pi * (row + np.float32(down) * way) / lines_px)
        pictures.append(stored(light, n))
    return pictures


def woven(pictures, first):
    """Every two of the pictures as one frame of two fields."""
    frames = []
    for early, late in zip(pictures[::2], pictures[1::2], strict=True):
        frame = late.copy()
        frame[first.first :: 2] = first.of(early)
        frames.append(frame)
    return frames


def read(frames):
    """The rows that each frame is read by."""
    interlacing = Interlacing(Rectifier(floor_rig()))
    return [interlacing(frame) for frame in frames]


def coded(pictures, quality):
    """Through JPEG, which has 8x8 blocks as video has."""
    options = [cv2.IMWRITE_JPEG_QUALITY, quality]
    return [
        cv2.imdecode(cv2.imencode(".jpg", picture, options)[1], cv2.IMREAD_GRAYSCALE)
        for picture in pictures
    ]


@ORDERS
@pytest.mark.parametrize("way", [(STEP_PX, 0.0), (0.0, STEP_PX), (-3.0, 1.0)])
def test_both_orders_of_the_fields_are_found_in_any_direction(first, way):
    frames = woven(moments(40, along=way[0], down=way[1]), first)
    assert read(frames)[-1] == first


@ORDERS
@pytest.mark.parametrize("quality", [90, 50, 25])
def test_the_order_survives_coding(first, quality):
    assert read(coded(woven(moments(30), first), quality))[-1] == first


@ORDERS
def test_a_film_that_begins_in_the_middle_of_a_drive_is_read_by_its_fields(first):
    seen = read(woven(moments(50, still=0)[20:], first))
    assert seen[0] == TOP, "what most films are, until the second frame shows more"
    assert seen[-1] == first


@pytest.mark.parametrize("lines_px", [None, 3.0, 5.0])
@pytest.mark.parametrize("way", [(2 * STEP_PX, 0.0), (0.0, 2 * STEP_PX), (0.0, 3.3)])
def test_progressive_films_keep_all_rows(lines_px, way):
    assert set(read(moments(20, along=way[0], down=way[1], lines_px=lines_px))) == {WHOLE}


def test_noise_and_text_do_not_comb():
    rng = np.random.default_rng(0)
    pictures = [stored(np.full(SHAPE, 60, np.float32), n, noise_grey=6) for n in range(20)]
    for picture in pictures:
        words = "".join(chr(c) for c in rng.integers(65, 91, 14))
        cv2.putText(picture, words, (8, 40), cv2.FONT_HERSHEY_SIMPLEX, 0.9, 255, 2)
    assert set(read(pictures)) == {WHOLE}


def test_a_lamp_that_flickers_from_field_to_field_is_no_motion():
    """The rows comb, standing and moving, but both fields show one moment."""
    pictures = [picture.copy() for picture in moments(40, along=2 * STEP_PX)]
    for picture in pictures:
        picture[::2] = cv2.LUT(picture[::2], np.minimum(np.arange(256) * 1.1, 255).astype(np.uint8))
    assert read(pictures)[-1] == WHOLE


@ORDERS
def test_dirt_text_and_drop_outs_hide_no_fields(first):
    frames = woven(moments(40), first)
    for n, frame in enumerate(frames):
        cv2.circle(frame, (100, 120), 45, 40, -1)
        cv2.putText(frame, f"CULVERT {n}", (8, 40), cv2.FONT_HERSHEY_SIMPLEX, 0.9, 255, 2)
    frames[5] = frames[4]
    frames[7] = np.full_like(frames[7], 16)
    assert read(frames)[-1] == first


def test_the_search_goes_on_from_a_checkpoint_as_it_would_have():
    frames = woven(moments(30), BOTTOM)
    interlacing = Interlacing(Rectifier(floor_rig()))
    seen = []
    for frame in frames:
        seen.append(interlacing(frame))
        interlacing = pickle.loads(pickle.dumps(interlacing))  # noqa: S301
    assert seen == read(frames)


@pytest.mark.parametrize("pitch_deg", [0.0, 20.0])
def test_a_field_shows_the_wall_where_the_frame_does(pitch_deg):
    """Rows doubled in the picture would lie half a row off."""
    rig = floor_rig(mount={"pitch_deg": pitch_deg})
    rectify = Rectifier(rig)
    height, width = rig.camera.height, rig.camera.width
    v, u = np.indices((height, width), np.float32)
    inside = cv2.erode(rectify.valid, np.ones((7, 7), np.uint8), borderValue=0) > 0
    for ramp in (u, v):  # its value is its place
        whole = rectify(ramp)
        for rows in (TOP, BOTTOM):
            assert np.abs(rectify(ramp, rows) - whole)[inside].max() < 0.02


@ORDERS
def test_an_interlaced_run_is_measured_at_the_times_of_its_frames(first):
    """Woven frames would be read a quarter of a frame late, or torn between both fields."""
    rig = floor_rig()
    world = World(rig, speckle(2))
    speed = np.minimum(1.0, np.arange(60) / 16) * 2.0
    x_mm = np.concatenate([[0.0], np.cumsum(speed)])[:60]
    pictures = [stored(world.view(float(x)), n) for n, x in enumerate(x_mm)]
    track = follow(rig, woven(pictures, first))
    # The first frames of motion may be read by the wrong field.
    error_mm = (track.x_mm - x_mm[::2])[8:]
    assert np.abs(error_mm).max() < 0.1
    assert not (track.status == "lost").any()


@ORDERS
@pytest.mark.parametrize("speed_mm", [1.0, 25.0])
def test_an_interlaced_film_may_begin_in_mid_drive(first, speed_mm):
    """The first picture is read before the order is known: the zero point is put right."""
    rig = floor_rig()
    world = World(rig, speckle(4))
    x_mm = speed_mm * np.arange(24)
    track = follow(rig, woven([stored(world.view(float(x)), n) for n, x in enumerate(x_mm)], first))
    assert np.abs(track.x_mm - x_mm[::2]).max() < 0.1
    assert not (track.status == "lost").any()
