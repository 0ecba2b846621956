"""Gains of the rows are divided out where a film has them, and nowhere else."""

import cv2
import numpy as np
import pytest
from textures import texture

from vo_core.image.rows import RowGains

ROWS, COLUMNS, FRAMES = 240, 320, 12
WALL = 100 + 15 * texture((ROWS + 10 * FRAMES, COLUMNS), 0)


def film(change=lambda wall: wall, gain=lambda n: np.ones(ROWS)):
    """Pictures that move by 10 rows a frame, each row with a gain."""
    wall = change(WALL.copy())
    moved = [wall[10 * n : 10 * n + ROWS] for n in range(FRAMES)]
    return [np.rint(seen * gain(n)[:, None]).astype(np.uint8) for n, seen in enumerate(moved)]


def with_a_joint(wall):
    wall[150:156] *= 0.4
    return wall


def spot(n):
    return np.exp(-(((np.arange(ROWS) - 120) / 60) ** 2))


def bands(n):
    return np.where((np.arange(ROWS) // 30 + n) % 2, 1.0, 0.65)


def evened(images):
    gains = RowGains()
    for image in images:
        gains.learn(image)
        yield gains.divide_out(image)


@pytest.mark.parametrize("text", ["", "m3"])
def test_bands_are_divided_out_from_the_second_frame_on(text):
    images = film(gain=bands)
    for image in images:
        cv2.putText(image, text, (4, 120), cv2.FONT_HERSHEY_SIMPLEX, 1, 255, 3)
    for n, image in list(enumerate(evened(images)))[1:]:
        light = image[:, 160:].mean(1)
        assert abs(light[bands(n) < 1].mean() / light[bands(n) == 1].mean() - 1) < 0.05  # was 0.35


@pytest.mark.parametrize("images", [film(), film(with_a_joint), film(gain=spot)])
def test_a_film_without_bands_is_left_as_it_is(images):
    assert all(even is image for even, image in zip(evened(images), images, strict=True))
