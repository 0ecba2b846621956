"""The drive of every scenario."""

from dataclasses import replace

import numpy as np
import pytest

from app.simulation import SCENARIOS
from app.simulation.motion import Trajectory


def drive(scenario):
    """Frames of a drive as columns x, y, yaw."""
    trajectory = Trajectory(scenario)
    poses = [trajectory.pose(n / scenario.frames_per_s) for n in range(trajectory.frames)]
    return np.array([(p.x_mm, p.y_mm, p.yaw_rad) for p in poses]).T


@pytest.mark.parametrize("name", SCENARIOS)
def test_drive_starts_at_rest_in_the_origin_and_keeps_its_limits(name):
    scenario = SCENARIOS[name]
    x, y, yaw = drive(scenario)
    assert (x[0], y[0], yaw[0]) == (0, 0, 0)
    per_frame_mm = np.abs(np.diff(x))
    assert per_frame_mm.max() <= scenario.speed_mm_s / scenario.frames_per_s + 1e-9
    assert per_frame_mm[0] < 0.1 * scenario.speed_mm_s / scenario.frames_per_s
    assert np.abs(y).max() <= scenario.sway_mm
    assert np.abs(yaw).max() <= np.radians(scenario.yaw_deg)
    assert sum(map(abs, scenario.legs)) == pytest.approx(1)


def test_nominal_drive_is_six_metres_of_ten_millimetres_a_frame():
    x, _, _ = drive(SCENARIOS["nominal"])
    assert len(x) == 616
    assert x[-1] == pytest.approx(6000)
    assert np.median(np.diff(x)) == pytest.approx(10)


def test_fast_drive_shows_half_a_picture_of_new_wall_in_each_frame():
    scenario = SCENARIOS["fast"]
    width_mm = 640 * scenario.rig.mount.height_mm / scenario.rig.camera.fx
    x, _, _ = drive(scenario)
    assert np.diff(x).max() == pytest.approx(width_mm / 2, rel=0.01)


def test_robot_that_comes_back_ends_where_it_started():
    x, _, _ = drive(SCENARIOS["there_and_back"])
    assert x.max() == pytest.approx(3000, abs=1)
    assert x[-1] == pytest.approx(0, abs=0.5)  # at most one frame before the stop


def test_robot_stands_still_in_all_directions_between_legs():
    x, y, yaw = drive(SCENARIOS["reverse"])
    standing = np.diff(x) == 0
    assert standing.sum() >= 3 * 29
    assert not np.diff(y)[standing].any()
    assert not np.diff(yaw)[standing].any()
    assert np.diff(x).min() < -9


def test_short_leg_brakes_before_it_reaches_full_speed():
    x, _, _ = drive(SCENARIOS["nominal"].shortened(20))
    assert x[-1] == pytest.approx(20, abs=0.5)
    assert np.diff(x).max() < 5


def test_shortening_never_lengthens():
    crawl = SCENARIOS["crawl"]
    assert crawl.shortened(1e6) == crawl
    assert crawl.shortened(100) == replace(crawl, length_mm=100)
