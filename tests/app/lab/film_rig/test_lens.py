"""What is known of a lens before the film is looked at."""

import pytest

from app.lab.film_rig.lens import LensPrior


@pytest.mark.parametrize(
    ("size_wh", "stated", "expected"),
    [
        ((720, 576), 64 / 45, 64 / 45),
        ((720, 576), 1.0, 1.08),  # most such films state nothing
        ((640, 480), 4 / 3, 4 / 3),
        ((640, 480), 1.0, 1.0),
    ],
)
def test_fy_follows_the_pixels_that_the_film_states(size_wh, stated, expected):
    prior = LensPrior.of("pinhole", size_wh, stated)
    camera = prior.camera(prior.mean)
    assert camera.fy / camera.fx == pytest.approx(expected)
