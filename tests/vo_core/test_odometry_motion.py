"""Motions that fool a tracker: crawl behind dirty glass, slow turns, jumps, uneven frames.

Truth is the pose from which the pictures were cast. The bounds are measured values times two or
more; a pixel is 0.56 mm.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shares import first_of
from worlds import FRAME_S, World, floor_rig, follow, glass, rms, small_rig, speckle, stored

RIGS = {"pipe": small_rig(), "floor": floor_rig()}
EVERYWHERE = pytest.mark.parametrize("shape", RIGS)
FEW = settings(max_examples=4, deadline=None, derandomize=True)


@pytest.fixture(scope="module")
def worlds():
    return {shape: World(rig, speckle(0)) for shape, rig in RIGS.items()}


def pictures(world, x_mm, y_mm=None, yaw_deg=None, through=None):
    """Noisy pictures from poses, through glass that is one for all or one for each."""
    straight = np.zeros(len(x_mm))
    y_mm, yaw_deg = (straight if v is None else v for v in (y_mm, yaw_deg))
    for n, pose in enumerate(zip(x_mm, y_mm, yaw_deg, strict=True)):
        yield stored(world.view(*pose) * (1.0 if through is None else through(n)), seed=n)


def steps(world, px_per_frame, frames):
    """Positions along the axis of an even drive."""
    return px_per_frame * world.mm_per_px * np.arange(frames)


@pytest.mark.parametrize("px_per_frame", first_of(3, [0, 0.5, 8, 0.25, 1, 2, 4]))
def test_what_moves_with_the_camera_is_not_read_as_motion_or_rest(worlds, px_per_frame):
    world = worlds["pipe"]
    dusty = glass(world.rig)
    x_mm = steps(world, px_per_frame, 50)
    track = follow(world.rig, pictures(world, x_mm, through=lambda _: dusty))
    assert np.abs(track.distance_mm - x_mm).max() < 0.03 + 3e-4 * x_mm[-1]
    assert np.abs(track.yaw_deg).max() < 0.25
    assert set(track.status) == {"ok"}


@pytest.mark.parametrize("px_per_frame", first_of(1, [2, 0.5, 8]))
def test_glass_that_gets_dirty_on_the_way_changes_nothing(worlds, px_per_frame):
    world = worlds["pipe"]
    clean, dirty = glass(world.rig, dust=0), glass(world.rig, dust=60, seed=3)
    x_mm = steps(world, px_per_frame, 60)
    images = pictures(world, x_mm, through=lambda n: dirty if n >= 30 else clean)
    track = follow(world.rig, images)
    assert np.abs(track.distance_mm - x_mm).max() < 0.1
    assert set(track.status) == {"ok"}


@EVERYWHERE
@pytest.mark.parametrize("turn_deg", first_of(1, [0.05, 0.1, 0.2, 0.4]))
def test_a_slow_turn_has_no_dead_zone(worlds, shape, turn_deg):
    world, n = worlds[shape], np.arange(60)
    yaw_deg = turn_deg * np.minimum(n, 60 - n)
    x_mm = steps(world, 4, 60)
    # The mount of this world is known: a tilt that is being learnt moves x while the robot turns.
    track = follow(world.rig.known_to(tilt_deg=0.1), pictures(world, x_mm, yaw_deg=yaw_deg))
    assert np.abs(track.yaw_deg - yaw_deg).max() < 0.15
    assert np.abs(track.distance_mm - x_mm).max() < 0.03


@EVERYWHERE
@pytest.mark.parametrize("turn_deg", first_of(1, [10, -10]))
def test_a_turn_of_ten_degrees_at_once_is_found(worlds, shape, turn_deg):
    world = worlds[shape]
    x_mm, yaw_deg = steps(world, 4, 6), np.array([0, 0, 0, 1, 1, 1]) * turn_deg
    track = follow(world.rig, pictures(world, x_mm, yaw_deg=yaw_deg))
    assert np.abs(track.yaw_deg - yaw_deg).max() < 0.1
    assert np.abs(track.distance_mm - x_mm).max() < 0.05
    assert set(track.status) == {"ok"}


@EVERYWHERE
def test_a_turn_about_a_point_behind_the_camera_moves_it_too(worlds, shape):
    world, lever_mm = worlds[shape], 60.0
    yaw_deg = 4 * np.sin(np.arange(50) / 8)
    turn = np.radians(yaw_deg)
    x_mm, y_mm = lever_mm * (np.cos(turn) - 1), lever_mm * np.sin(turn)
    track = follow(world.rig, pictures(world, x_mm, y_mm, yaw_deg))
    assert np.abs(track.x_mm - x_mm).max() < 0.03
    assert np.abs(track.y_mm - y_mm).max() < 0.5
    assert np.abs(track.yaw_deg - yaw_deg).max() < 0.15


def test_a_jump_beyond_the_picture_is_lost_with_a_sigma_that_grows_and_then_tracked_on(worlds):
    world, elsewhere = worlds["pipe"], World(RIGS["pipe"], speckle(1))
    x_mm = steps(world, 6, 80)
    images = list(pictures(world, x_mm[:30])) + list(pictures(elsewhere, x_mm[30:]))
    track = follow(world.rig, images)
    assert track.status[30] == "lost"
    assert track.sigma_registration_mm[30] > 4 * track.sigma_registration_mm[29]
    assert set(track.status[70:]) == {"ok"}
    # From there on the motion is measured, at the speed that it has.
    assert np.diff(track.distance_mm[70:]) == pytest.approx(np.diff(x_mm[70:]), abs=0.05)
    assert np.all(np.diff(track.sigma_registration_mm[70:]) < 0.1)


def test_dropped_frames_change_nothing(worlds):
    world, kept = worlds["pipe"], np.flatnonzero(np.arange(90) % 7 < 4)
    x_mm = steps(world, 6, 90)[kept]
    images = list(pictures(world, x_mm))
    for times_s in (kept * FRAME_S, None):  # with the true times, or as if none were missing
        track = follow(world.rig, images, times_s)
        assert np.abs(track.distance_mm - x_mm).max() < 0.08
        assert set(track.status) == {"ok"}


def test_a_frame_that_comes_twice_is_bridged_not_read_as_a_stop(worlds):
    world = worlds["pipe"]
    x_mm = steps(world, 6, 90)
    images = list(pictures(world, x_mm))
    twice = [n for n in range(1, 90) if n % 10 == 0]
    for n in twice:
        images[n] = images[n - 1]
    track = follow(world.rig, images)
    assert set(track.status[twice]) == {"lost"}
    assert np.abs(track.distance_mm - x_mm).max() < 0.1


def test_frames_at_irregular_times_are_followed(worlds):
    world = worlds["pipe"]
    times_s = np.cumsum(np.random.default_rng(1).uniform(0.2, 1.8, 80)) * FRAME_S
    x_mm = 6 * world.mm_per_px * (times_s - times_s[0]) / FRAME_S
    track = follow(world.rig, pictures(world, x_mm), times_s)
    assert np.abs(track.distance_mm - x_mm).max() < 0.08
    assert set(track.status) == {"ok"}


def test_a_reversal_comes_back_to_zero(worlds):
    world = worlds["pipe"]
    x_mm = 100 * (1 - np.cos(np.linspace(0, 2 * np.pi, 80)))
    track = follow(world.rig, pictures(world, x_mm))
    assert np.abs(track.distance_mm - x_mm).max() < 0.06
    assert abs(track.distance_mm[-1]) < 0.02  # the issue: 0.02 % of the path, which is 400 mm


# Algebra: what must hold whatever the robot does.

TURNING = (
    40 * np.linspace(0, 1, 25) ** 1.2,
    3 * np.sin(np.linspace(0, 2 * np.pi, 25)),
    2 * np.sin(np.linspace(0, 4 * np.pi, 25)),
)
"""x mm, y mm and yaw degrees of a short sinuous drive that starts and ends straight on the axis."""


@FEW
@given(angle_deg=st.floats(-180, 180))
def test_a_floor_that_is_turned_gives_the_same_track(angle_deg):
    """The track counts from the first pose, in its axes."""
    world = World(RIGS["floor"], speckle(2))
    x_mm, y_mm, yaw_deg = TURNING
    turn = np.exp(1j * np.radians(angle_deg))
    path = turn * (x_mm + 1j * y_mm)
    track = follow(world.rig, pictures(world, path.real, path.imag, yaw_deg + angle_deg))
    assert np.abs(track.x_mm - x_mm).max() < 0.04
    assert np.abs(track.y_mm - y_mm).max() < 0.05
    assert np.abs(track.yaw_deg - yaw_deg).max() < 0.05


@EVERYWHERE
def test_a_mirrored_world_gives_a_mirrored_track(worlds, shape):
    world = worlds[shape]
    images = list(pictures(world, *TURNING))
    straight = follow(world.rig, images)
    mirrored = follow(world.rig, [image[::-1] for image in images])
    assert mirrored.x_mm == pytest.approx(straight.x_mm, abs=0.03)
    assert mirrored.y_mm == pytest.approx(-straight.y_mm, abs=0.15)
    assert mirrored.yaw_deg == pytest.approx(-straight.yaw_deg, abs=0.06)


@EVERYWHERE
def test_the_same_drive_backwards_gives_the_inverse_motion(worlds, shape):
    world = worlds[shape]
    x_mm, y_mm, yaw_deg = TURNING
    back = follow(world.rig, list(pictures(world, *TURNING))[::-1])
    assert back.x_mm == pytest.approx((x_mm - x_mm[-1])[::-1], abs=0.03)
    assert back.y_mm == pytest.approx(y_mm[::-1], abs=0.3)
    assert back.yaw_deg == pytest.approx(yaw_deg[::-1], abs=0.15)


@FEW
@given(gain=st.floats(0.4, 1.6), offset_grey=st.floats(-20, 40))
def test_gain_and_offset_do_not_matter(worlds, gain, offset_grey):
    world = worlds["pipe"]
    lights = [world.view(*pose) for pose in zip(*TURNING, strict=True)]
    plain = follow(world.rig, lights)
    other = follow(world.rig, [gain * light + offset_grey for light in lights])
    assert other.x_mm == pytest.approx(plain.x_mm, abs=0.02)
    assert other.y_mm == pytest.approx(plain.y_mm, abs=0.1)
    assert other.yaw_deg == pytest.approx(plain.yaw_deg, abs=0.05)


def test_what_the_camera_sees_first_is_zero_and_one_frame_is_a_track(worlds):
    world = worlds["pipe"]
    track = follow(world.rig, [stored(world.view(250.0), 0)])
    assert (track.x_mm[0], track.y_mm[0], track.yaw_deg[0]) == (0, 0, 0)
    assert track.status[0] == "ok"


def test_frames_without_noise_that_repeat_are_a_robot_at_rest(worlds):
    world = worlds["pipe"]
    track = follow(world.rig, [stored(world.view(), 0)] * 40)
    assert rms(track.distance_mm) < 1e-3
    assert set(track.status) == {"ok"}


def test_a_third_of_the_picture_at_the_first_step_is_followed(worlds):
    """A recording may begin on the way, at any speed."""
    world = worlds["floor"]
    x_mm = steps(world, 107, 15)
    track = follow(world.rig, pictures(world, x_mm))
    assert np.abs(track.distance_mm - x_mm).max() < 0.3
    assert np.abs(track.y_mm).max() < 0.3
    assert set(track.status) == {"ok"}
