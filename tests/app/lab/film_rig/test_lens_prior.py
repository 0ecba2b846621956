"""What is known of a lens before the film is looked at."""

from dataclasses import replace

import pytest

from app.lab.film_rig.lens import LensPrior, Pixels
from vo_core import VideoInfo

FILM = VideoInfo(0, 0, "h264", "mp4", "yuv420p", None, None, None)


@pytest.mark.parametrize(
    ("size_wh", "stated", "expected", "square_wh"),
    [
        ((720, 576), 64 / 45, 64 / 45, (1024, 576)),
        ((720, 576), 1.0, 1.08, (778, 576)),  # most such films state nothing
        ((480, 720), 15 / 16, 15 / 16, (480, 768)),
        ((640, 480), 1.0, 1.0, (640, 480)),
    ],
)
def test_fy_follows_the_pixels_of_the_film(size_wh, stated, expected, square_wh):
    width, height = size_wh
    pixels = Pixels.of(replace(FILM, width=width, height=height, pixel_aspect=stated))
    assert pixels.square_wh == square_wh
    prior = LensPrior.of("pinhole", pixels)
    camera = pixels.camera(prior.camera(prior.mean))
    assert (camera.width, camera.height) == size_wh
    assert camera.fy / camera.fx == pytest.approx(expected, rel=1e-3)
    assert (camera.cx, camera.cy) == pytest.approx(((width - 1) / 2, (height - 1) / 2))
