"""Height and focal length against the scale: floors and pipes in closed form."""

import numpy as np
import pytest
from textures import make_rig

from vo_core.geometry.height import implied_height, reading, scale_sigma

FLAT = {"shape": "flat", "diameter_mm": None}
FORWARD = make_rig(camera={"fx": 266.0, "fy": 266.0}, mount={"view": "forward", "height_mm": 150.0})


@pytest.mark.parametrize("factor", [0.9, 0.99, 1.03])
def test_above_a_floor_the_reading_is_the_ratio_of_the_heights(factor):
    rig = make_rig(mount={"height_mm": factor * 230}, pipe=FLAT)
    assert reading(rig, make_rig(pipe=FLAT)) == pytest.approx(factor)


@pytest.mark.parametrize("factor", [0.9, 0.99, 1.03])
def test_above_a_floor_the_height_follows_the_scale(factor):
    height = implied_height(make_rig(pipe=FLAT), factor, 0.001)
    assert height.height_mm == pytest.approx(230 * factor)
    assert height.sigma_mm == pytest.approx(0.23, rel=1e-3)


NOTHING = {"height_mm": 0.0, "tilt_deg": 0.0, "focal_percent": 0.0, "diameter_mm": 0.0}
"""Is uncertain."""


def test_above_a_floor_height_and_focal_length_count_fully():
    rig = make_rig(pipe=FLAT).known_to(**NOTHING)
    assert scale_sigma(rig.known_to(height_mm=2.3)) == pytest.approx(0.01, rel=1e-3)
    assert scale_sigma(rig.known_to(focal_percent=1.0)) == pytest.approx(0.01, rel=1e-3)
    both = scale_sigma(rig.known_to(height_mm=2.3, focal_percent=1.0))
    assert both == pytest.approx(0.01 * np.sqrt(2), rel=1e-3)
    assert scale_sigma(rig) == 0


def test_a_rig_that_says_nothing_is_known_by_a_tape_and_a_data_sheet():
    expected = np.hypot(2.0 / 230, 0.005)
    assert scale_sigma(make_rig(pipe=FLAT)) == pytest.approx(expected, rel=0.01)


def depth_mm(height_mm, slope):
    """Depth below a camera above the invert of a pipe of 300 mm along a ray of a lateral slope."""
    radius, rise = 150.0, 150.0 - height_mm
    a, b, c = 1 + slope**2, rise, rise**2 - radius**2
    return (-b + np.sqrt(b**2 - a * c)) / a


def test_in_a_pipe_the_reading_is_the_mean_ratio_of_the_depths():
    slope = np.linspace(-239.5, 239.5, 481) / 1194
    expected = np.mean(depth_mm(1.03 * 230, slope) / depth_mm(230, slope))
    rig = make_rig(mount={"height_mm": 1.03 * 230})
    assert reading(rig, make_rig()) == pytest.approx(expected, abs=1e-4)
    assert expected < 1.03


def test_in_a_pipe_the_height_comes_back():
    rig = make_rig(mount={"height_mm": 1.03 * 230})
    height = implied_height(rig, 1 / reading(rig, make_rig()), 1e-4)
    assert height.height_mm == pytest.approx(230, abs=0.01)
    assert 0.02 < height.sigma_mm < 0.2


def test_looking_along_the_pipe_no_height_is_derived():
    assert implied_height(FORWARD, 1.01, 1e-4) is None
    known = FORWARD.known_to(**NOTHING)
    assert scale_sigma(known.known_to(height_mm=1.0)) < 0.001
    assert scale_sigma(known.known_to(diameter_mm=3.0)) == pytest.approx(0.01, rel=0.02)


def test_no_height_outside_the_pipe_is_made_up():
    assert implied_height(make_rig(), 1.5, 1e-3) is None
