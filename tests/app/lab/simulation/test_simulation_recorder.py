"""What lamp, air and recorder make of the picture, beside the plain one."""

from dataclasses import replace
from itertools import islice, pairwise

import numpy as np
import pytest
from films import half_sized

from app.lab.simulation import SCENARIOS, render


def frames(name: str, count: int, **changes):
    """The first frames of a scenario in small pictures, without noise and flicker."""
    scenario = replace(
        SCENARIOS[name].shortened(40), **{"noise_grey": 0.0, "flicker": 0.0, **changes}
    )
    return list(islice(render(half_sized(scenario)), count))


def test_pulsed_lamp_darkens_rows_in_bands_that_run():
    plain = frames("pulsed_lamp", 2, pulse=None)
    gains = [
        (banded.image.mean(axis=1) / even.image.mean(axis=1))
        for banded, even in zip(frames("pulsed_lamp", 2), plain, strict=True)
    ]
    for gain in gains:
        assert gain.min() == pytest.approx(0.65, abs=0.03)
        assert gain.max() == pytest.approx(1.0, abs=0.03)
    assert np.abs(gains[1] - gains[0]).max() > 0.2


def test_mixed_picture_lies_between_two_of_the_camera_in_picture_and_pose():
    camera = frames("mixed_frames", 6, conversion=None, frames_per_s=25)
    mixed = frames("mixed_frames", 6)
    share = 2 / 6  # the fifth picture: 4 / 30 s is 3 1/3 pictures of the camera
    expected = (1 - share) * camera[3].image + share * camera[4].image
    assert np.abs(mixed[4].image - expected).max() < 1
    assert camera[3].x_mm < mixed[4].x_mm < camera[4].x_mm
    assert mixed[4].t_s == pytest.approx(4 / 30, abs=1e-4)


def test_pull_down_repeats_every_fourth_picture_with_its_pose():
    shown = frames("pull_down", 11)
    again = [a.x_mm == b.x_mm and (a.image == b.image).all() for a, b in pairwise(shown)]
    assert [number for number, is_same in enumerate(again) if is_same] == [0, 5]


def test_standing_robot_has_a_film_without_motion():
    shown = list(islice(render(half_sized(SCENARIOS["standing"])), 3))
    assert all((frame.x_mm, frame.y_mm, frame.yaw_deg) == (0, 0, 0) for frame in shown)
    assert not np.array_equal(shown[1].image, shown[2].image)


@pytest.mark.parametrize(
    ("name", "plain"), [("mist", {"mist": 0.0}), ("swinging_cable", {"cable": False})]
)
def test_mist_and_cable_move_before_the_wall(name, plain):
    hidden = [
        np.abs(a.image.astype(int) - b.image) > 5
        for a, b in zip(frames(name, 4), frames(name, 4, **plain), strict=True)
    ]
    assert 0.01 < hidden[0].mean() < 0.99
    assert not np.array_equal(hidden[0], hidden[3])


def test_another_draw_changes_the_noise_alone():
    first, again, other = (
        frames("dirty_lens", 1, noise_grey=3.0, noise_draw=draw)[0].image.astype(float)
        for draw in (0, 0, 1)
    )
    assert np.array_equal(first, again)
    assert (other - first).std() == pytest.approx(3 * np.sqrt(2), rel=0.1)
