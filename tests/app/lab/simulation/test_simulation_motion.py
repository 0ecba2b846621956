"""The drive of every scenario."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from app.lab.simulation import SCENARIOS
from app.lab.simulation.motion import Trajectory
from app.lab.simulation.scenario import Look, Shaking


def drive_in_six(scenario):
    """Frames of a drive in rows x, y, yaw, z, pitch, roll."""
    trajectory = Trajectory(scenario)
    poses = [trajectory.truth(n / scenario.frames_per_s) for n in range(trajectory.frames)]
    return np.array([astuple(pose) for pose in poses]).T


def drive(scenario):
    """The first three of these rows."""
    return drive_in_six(scenario)[:3]


@pytest.mark.parametrize("name", SCENARIOS)
def test_drive_starts_at_rest_in_the_origin_and_keeps_its_limits(name):
    scenario = SCENARIOS[name]
    x, y, yaw = drive(scenario)
    assert (x[0], y[0], yaw[0]) == (0, 0, 0)
    per_frame_mm = np.abs(np.diff(x))
    assert per_frame_mm.max() <= scenario.speed_mm_s / scenario.frames_per_s + 1e-9
    ramp_frames = scenario.speed_mm_s / scenario.acceleration_mm_s2 * scenario.frames_per_s
    starts_at_rest = ramp_frames > 1 and not scenario.cut_frames
    assert starts_at_rest == (per_frame_mm[0] < 0.1 * scenario.speed_mm_s / scenario.frames_per_s)
    if not scenario.climb_deg:
        assert np.ptp(y) <= 2 * (scenario.sway_mm + scenario.shaking.y_mm)
    looks_deg = [look.yaw_deg for look in scenario.looks] or [0.0]
    yaw_deg = 2 * (scenario.yaw_deg + scenario.shaking.yaw_deg) + np.ptp([*looks_deg, 0.0])
    assert np.ptp(yaw) <= np.radians(yaw_deg)
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


def test_camera_that_looks_around_turns_about_its_centre_while_the_robot_stands():
    scenario = SCENARIOS["forward_looking_around"]
    poses = drive_in_six(scenario)
    plain = drive_in_six(replace(scenario, looks=()))
    x, y, yaw, z, pitch, roll = poses - plain
    assert not np.array([x, y, z, roll]).any()
    standing = np.concatenate([[False], np.diff(plain[0]) == 0])
    assert not np.array([yaw, pitch])[:, ~standing].any()
    assert np.degrees([yaw.max(), yaw.min()]) == pytest.approx([50, -50])
    assert np.degrees([pitch.max(), pitch.min()]) == pytest.approx([10, -20])
    per_frame_deg = np.degrees(np.abs(np.diff(yaw)).max())
    assert per_frame_deg == pytest.approx(50 * np.pi / 2 / 2 / scenario.frames_per_s, rel=0.01)


def test_look_takes_its_time_and_begins_and_ends_without_a_jerk():
    look = Look(yaw_deg=1.0, turn_s=2.0, hold_s=1.0)
    t_s = np.arange(-1.0, 6.5, 0.01)
    share = np.array([look.share(t) for t in t_s])
    assert not share[(t_s < 0) | (t_s > 5)].any()
    np.testing.assert_allclose(share[(t_s > 2) & (t_s < 3)], 1.0, atol=1e-4)
    np.testing.assert_allclose(share, np.interp(5 - t_s, t_s, share), atol=1e-3)  # back as out
    assert np.abs(np.diff(share, 2)).max() < 2e-4  # steps of the speed


def test_camera_that_looks_aside_keeps_its_angle_and_the_truth_counts_from_it():
    crooked = SCENARIOS["forward_crooked"]
    straight = replace(crooked, aside_deg=0.0)
    for t_s in (0.0, 5.0, 26.0):
        turned = Trajectory(crooked).pose(t_s).vector - Trajectory(straight).pose(t_s).vector
        np.testing.assert_allclose(np.degrees(turned), [0, 0, 1.5, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(drive_in_six(crooked), drive_in_six(straight), atol=1e-12)


def test_drive_of_one_picture_a_second_goes_a_radius_between_two():
    scenario = SCENARIOS["forward_slow"]
    x, _, _ = drive(scenario)
    assert np.median(np.diff(x)) == pytest.approx(scenario.rig.pipe.diameter_mm / 2)


def test_phone_on_a_rod_wanders_over_seconds_and_as_far_as_stated():
    scenario = SCENARIOS["forward_wobble"]
    _, y, yaw, z, pitch, _ = drive_in_six(scenario)
    assert 18 < np.abs(y).max() < 25 + scenario.sway_mm
    assert 18 < np.abs(z).max() <= 25
    assert 6 < np.degrees(np.abs(yaw).max()) < 8 + 2 * scenario.yaw_deg
    assert 6 < np.degrees(np.abs(pitch).max()) <= 8
    per_frame_deg = np.degrees(np.abs(np.diff([yaw, pitch])).max())
    assert per_frame_deg < 1.0
