"""What the field does to a film: times that lie, stops, walls that are not as the rig says."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from films import film, half_sized
from hypothesis import given, settings
from hypothesis import strategies as st
from textures import make_rig
from worlds import World, follow, small_rig, speckle, stored

from app.lab.simulation import SCENARIOS, Scenario
from app.lab.simulation.scenario import Shaking
from vo_core import Odometry, Rig
from vo_core.clock import Clock
from vo_core.geometry.motion import PARAMETERS, RATES, RollingMotion, WallMotion
from vo_core.geometry.rectify import Rectifier
from vo_core.matching.blocks import BlockGrid

FRAME_S = 1 / 30
WORLD = World(small_rig(), speckle(0))
DRIVEN_MM = 6 * WORLD.mm_per_px * np.arange(30)


@cache
def pictures():
    return [stored(WORLD.view(x), n) for n, x in enumerate(DRIVEN_MM)]


@cache
def on_time():
    return follow(WORLD.rig, pictures())


gaps_s = st.floats(1e-4, 10.0)


@settings(max_examples=max(1, settings().max_examples // 5))
@given(st.lists(gaps_s, min_size=29, max_size=29))
def test_the_same_pictures_give_the_same_distances_at_any_rising_times(gaps):
    track = follow(WORLD.rig, pictures(), np.concatenate([[0.0], np.cumsum(gaps)]))
    apart_mm = np.abs(track.distance_mm - on_time().distance_mm)
    assert np.all(apart_mm <= on_time().sigma_registration_mm + 1e-3)
    assert set(track.status) == {"ok"}


def test_one_period_lies_between_frames_that_come_in_bursts():
    clock = Clock()
    for t_s in [0.0, 0.033, 0.066, 0.129, 0.132, 0.165, 0.198]:
        clock.tick(t_s)
    assert clock.period_s == pytest.approx(0.033)
    # The late frame may have been two periods away; none is ever less than one.
    assert 6.0 <= clock.periods < 7.0


def test_frames_that_are_missing_count():
    clock = Clock()
    for t_s in [0.0, 0.04, 0.08, 0.12, 0.28]:
        clock.tick(t_s)
    assert clock.periods == pytest.approx(3 + 4)
    assert 0 < clock.jitter < 1


def test_a_stop_from_one_frame_to_the_next_is_believed_where_the_noise_is_new():
    x_mm = np.concatenate([DRIVEN_MM, np.full(30, DRIVEN_MM[-1]), DRIVEN_MM[-1] + DRIVEN_MM[1:]])
    track = follow(WORLD.rig, [stored(WORLD.view(x), n) for n, x in enumerate(x_mm)])
    assert np.abs(track.distance_mm - x_mm).max() < 0.2
    assert set(track.status) == {"ok"}


def test_a_picture_that_repeats_itself_for_long_is_a_stop():
    images = [*pictures(), *([pictures()[-1]] * 40)]
    track = follow(WORLD.rig, images)
    view_mm = 320 * WORLD.mm_per_px
    assert np.abs(track.distance_mm - DRIVEN_MM[-1])[30:].max() < view_mm
    assert track.distance_mm[40:] == pytest.approx(DRIVEN_MM[-1], abs=0.1)
    assert np.all(np.diff(track.sigma_registration_mm[31:38]) > 0)
    assert np.sum(track.status == "lost") < 15


def test_a_frozen_picture_that_its_coder_corrects_hides_no_way():
    frozen, images = pictures()[14], list(pictures())
    for n in range(15, 20):
        images[n] = frozen.copy()
        images[n].reshape(-1)[n::1500] ^= 1
    track = follow(WORLD.rig, images)
    assert track.distance_mm == pytest.approx(DRIVEN_MM, abs=0.5)
    assert set(np.flatnonzero(track.status == "lost")) == set(range(15, 20))


def test_a_film_that_hid_a_short_stop_behind_equal_pictures_shows_the_next():
    step_mm = DRIVEN_MM[1]
    x_mm = np.cumsum([step_mm * (n not in (*range(16, 21), *range(40, 60))) for n in range(60)])
    images = [stored(WORLD.view(x), int(x / step_mm + 0.5)) for x in x_mm]
    track = follow(WORLD.rig, images)
    assert track.distance_mm[21:] == pytest.approx((x_mm - x_mm[0])[21:], abs=0.2)
    assert set(track.status[22:]) == {"ok"}


RIGS = {
    "down": make_rig(),
    "floor": make_rig(pipe={"shape": "flat", "diameter_mm": None}),
    "forward": make_rig(
        camera={"fx": 266.0, "fy": 266.0}, mount={"view": "forward", "height_mm": 150.0}
    ),
    "tilted": make_rig(mount={"lateral_mm": 20.0, "pitch_deg": 5.0, "rotation_deg": 30.0}),
}
POSES = np.array(
    [20.0, 3.0, 0.05, 2.0, 0.02, 0.03, 0.0, -4.0, -0.03, -1.0, 0.01, -0.02, 0.02, -0.01]
)


def by_differences(positions, q, scales):
    steps = np.diag(1e-5 * scales)
    columns = [(positions(q + step) - positions(q - step)) / (2 * step.sum()) for step in steps]
    return np.stack(columns).swapaxes(1, 2)


@pytest.mark.parametrize("kind", RIGS)
def test_the_derivative_of_the_motion_is_that_of_its_positions(kind):
    rectifier = Rectifier(RIGS[kind])
    motion = WallMotion(RIGS[kind], rectifier.grid, BlockGrid.over(rectifier.grid.shape).nodes())
    positions, slopes = motion.linearise(POSES)
    assert np.allclose(positions, motion.positions(POSES), equal_nan=True)
    expected = by_differences(motion.positions, POSES, motion.scales)
    assert np.nanmax(np.abs(slopes - expected) * motion.scales[:, None, None]) < 1e-6


def test_without_a_readout_time_a_rolling_shutter_is_a_global_one():
    rig = RIGS["down"]
    rectifier = Rectifier(rig)
    motion = WallMotion(rig, rectifier.grid, BlockGrid.over(rectifier.grid.shape).nodes())
    rolling = RollingMotion(motion)
    rates = [300.0, 20.0, 0.3]
    q = np.append(POSES, [*rates, *rates])
    assert len(q) == PARAMETERS + 2 * RATES
    assert np.allclose(rolling.positions(q), motion.positions(POSES), equal_nan=True)
    assert np.all(rolling.linearise(q)[1][PARAMETERS:] == 0)


def followed(scenario: Scenario) -> tuple[list, np.ndarray, Rig]:
    """Estimates and true distances of a run that is rendered in half the size."""
    scenario = half_sized(scenario)
    odometry, estimates, true_mm = Odometry(scenario.rig), [], []
    for frame in film(scenario):
        estimates.append(odometry.step(frame.image, frame.t_s))
        true_mm.append(frame.x_mm)
    return estimates, np.array(true_mm), scenario.rig


def test_a_flat_bed_in_the_place_of_the_pipe_widens_the_interval():
    estimates, true_mm, _ = followed(SCENARIOS["silt"].shortened(400.0))
    error_mm = np.abs([e.distance_mm for e in estimates] - true_mm)
    assert error_mm[-1] > 0.1 * 400  # nothing in the picture shows how deep it is
    late = slice(20, None)
    assert np.all(error_mm[late] < 3 * np.array([e.sigma_distance_mm for e in estimates])[late])
    assert estimates[-1].sigma_registration_mm < 2


def test_a_mount_that_is_tilted_is_estimated_and_costs_no_distance():
    estimates, true_mm, _ = followed(SCENARIOS["pitched_mount"].shortened(600.0))
    assert np.abs([e.distance_mm for e in estimates] - true_mm).max() < 0.3
    assert abs(estimates[-1].pitch_deg) < 0.1  # against the first frame it never changed


def test_a_camera_beside_the_axis_rises_and_falls_with_a_climb_and_keeps_its_distance():
    climb = SCENARIOS["climb"].shortened(800.0)
    mount = climb.rig.mount.model_copy(update={"lateral_mm": 20.0})
    rig = climb.rig.model_copy(update={"mount": mount})
    estimates, true_mm, _ = followed(replace(climb, rig=rig))
    assert np.abs([e.distance_mm for e in estimates] - true_mm + true_mm[0]).max() < 2.0


def test_soft_springs_that_swing_slowly_are_learnt_and_cost_little_distance():
    """Two frames differ by little then, and by what they share with a change of scale."""
    slow = Shaking(frequencies_hz=(0.5, 1.3), z_mm=4.0, pitch_deg=1.0)
    bounce = replace(SCENARIOS["bounce"], shaking=slow).shortened(1200.0)
    estimates, true_mm, _ = followed(bounce)
    assert np.abs([e.distance_mm for e in estimates] - true_mm).max() < 8.0


def test_a_film_may_begin_with_a_robot_that_stands_askew_and_beside_the_axis():
    """The first frame is zero, and the pipe shows later that it was not straight."""
    images = [stored(WORLD.view(x, y_mm=4.0, yaw_deg=1.0), n) for n, x in enumerate(DRIVEN_MM)]
    track = follow(WORLD.rig, images)
    assert np.abs(track.distance_mm - DRIVEN_MM).max() < 0.2
    assert np.abs(track.yaw_deg).max() < 0.1
    assert np.abs(track.y_mm).max() < 0.8
