"""The drive of every scenario."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from app.lab.simulation import SCENARIOS
from app.lab.simulation.motion import Trajectory
from app.lab.simulation.scenario import Shaking


def drive(scenario):
    """Frames of a drive as columns x, y, yaw."""
    trajectory = Trajectory(scenario)
    poses = [trajectory.truth(n / scenario.frames_per_s) for n in range(trajectory.frames)]
    return np.array([(p.x_mm, p.y_mm, p.yaw_rad) for p in poses]).T


def drive_in_six(scenario):
    """Frames of a drive in rows x, y, yaw, z, pitch, roll."""
    trajectory = Trajectory(scenario)
    poses = [trajectory.truth(n / scenario.frames_per_s) for n in range(trajectory.frames)]
    return np.array([astuple(pose) for pose in poses]).T


@pytest.mark.parametrize("name", SCENARIOS)
def test_drive_starts_at_rest_in_the_origin_and_keeps_its_limits(name):
    scenario = SCENARIOS[name]
    x, y, yaw = drive(scenario)
    assert (x[0], y[0], yaw[0]) == (0, 0, 0)
    per_frame_mm = np.abs(np.diff(x))
    assert per_frame_mm.max() <= scenario.speed_mm_s / scenario.frames_per_s + 1e-9
    starts_at_rest = np.isfinite(scenario.acceleration_mm_s2) and not scenario.cut_frames
    assert starts_at_rest == (per_frame_mm[0] < 0.1 * scenario.speed_mm_s / scenario.frames_per_s)
    if not scenario.climb_deg:
        assert np.ptp(y) <= 2 * (scenario.sway_mm + scenario.shaking.y_mm)
    assert np.ptp(yaw) <= 2 * np.radians(scenario.yaw_deg + scenario.shaking.yaw_deg)
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


def test_robot_that_bumps_into_things_stops_and_goes_on_from_one_frame_to_the_next():
    scenario = SCENARIOS["stop_dead"]
    x, _, _ = drive(scenario)
    assert len(x) == 451
    speeds_mm_s = np.diff(x) * scenario.frames_per_s
    standing = speeds_mm_s == 0
    starts = np.flatnonzero(standing[1:] & ~standing[:-1])
    assert len(starts) == 5
    assert 5 * 29 <= standing.sum() <= 5 * 30
    between = (speeds_mm_s > 1) & (speeds_mm_s < 299)
    assert between.sum() <= 10  # at most the frames in which it stops and goes on


def test_soft_wheels_bounce_as_far_as_stated_while_the_robot_drives_and_not_at_rest():
    scenario = SCENARIOS["bounce"]
    x, y, yaw, z, pitch, roll = drive_in_six(scenario)
    plain = drive(SCENARIOS["nominal"])
    assert np.array_equal(np.array([x, y, yaw]), plain)  # the way itself is the nominal one
    assert 0.8 * 4 < np.abs(z).max() <= 4
    assert 0.8 < np.degrees(np.abs(pitch).max()) <= 1
    assert not roll.any()
    assert not z[[0, -1]].any()
    steady = slice(30, -30)
    turns = np.count_nonzero(np.diff(np.sign(z[steady])))
    seconds = len(z[steady]) / scenario.frames_per_s
    assert 2 * 1.0 < turns / seconds < 2 * 3.0  # two zeros a period
    assert abs(np.corrcoef(z[steady], pitch[steady])[0, 1]) < 0.6


def test_shaking_stops_with_the_robot():
    scenario = replace(SCENARIOS["reverse"], shaking=Shaking(y_mm=1.0, z_mm=2.0, roll_deg=1.0))
    poses = drive_in_six(scenario)
    standing = np.diff(poses[0]) == 0
    assert np.abs(poses[3:]).max() > 0
    assert not np.diff(poses)[:, standing].any()


def test_climbing_robot_keeps_its_distance_from_the_axis_and_leans_by_the_same_angle():
    scenario = replace(SCENARIOS["climb"], sway_mm=0.0, yaw_deg=0.0)
    _, y, yaw, z, pitch, roll = drive_in_six(scenario)
    below_axis_mm = 150 - 230
    assert np.degrees(np.abs(roll).max()) == pytest.approx(6, abs=1)
    assert roll.min() < 0 < roll.max()
    assert not yaw.any()
    assert not pitch.any()
    np.testing.assert_allclose(np.hypot(y, below_axis_mm + z), 80)
    # Right-handed about x: a robot at the invert that leans to the right has climbed to the left.
    np.testing.assert_allclose(y, -below_axis_mm * np.sin(roll))


def test_film_that_begins_late_counts_from_its_first_frame():
    whole, late = (
        drive_in_six(replace(SCENARIOS["late_start"], cut_frames=0)),
        drive_in_six(SCENARIOS["late_start"]),
    )
    np.testing.assert_allclose(late, whole[:, 10:] - whole[:, 10:11], atol=1e-9)
    assert late.shape[1] == whole.shape[1] - 10
