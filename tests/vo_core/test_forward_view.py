"""A camera that looks along the pipe as crews have it: crooked, turned, masked, rarely exposed."""

from dataclasses import replace

import numpy as np
import pytest
from films import film, half_sized
from worlds import follow

from app.lab.simulation import SCENARIOS
from app.lab.simulation.camera import WallCaster
from app.lab.simulation.scenario import Look
from vo_core.geometry.gaze import gaze
from vo_core.geometry.motion import PARAMETERS, WallMotion, parameters
from vo_core.geometry.rectify import Rectifier
from vo_core.geometry.wall import NOMINAL, Pose, cast, develop, robot_rays
from vo_core.image.axis import AxisFinder
from vo_core.image.overlay import Overlay
from vo_core.image.pattern import LEAST_FRAMES
from vo_core.matching.blocks import BlockGrid

RIG = SCENARIOS["forward"].rig
TURNED = Pose(0.0, 12.0, np.radians(-9), -16.0, np.radians(11), np.radians(3))


def tracked(scenario):
    """The track of a scenario and the true distances of its frames."""
    frames = film(scenario)
    track = follow(scenario.rig, [f.image for f in frames], [f.t_s for f in frames])
    return track, np.array([f.x_mm for f in frames])


def percent(track, x_mm):
    return 100 * abs(track.distance_mm[-1] - x_mm[-1]) / np.abs(np.diff(x_mm)).sum()


def test_a_patch_from_another_vantage_shows_each_place_of_the_wall_where_it_is():
    rows, columns = np.mgrid[: RIG.camera.height, : RIG.camera.width].astype(np.float32)
    rectify = Rectifier(RIG).at(TURNED)
    assert rectify.grid == Rectifier(RIG).grid
    wall_mm = develop(RIG, cast(RIG, TURNED, robot_rays(RIG, [(60.0, 300.0)])))
    column, row = np.round(rectify.grid.to_px(wall_mm)[0]).astype(int)
    assert rectify.valid[row, column]
    assert rectify(columns / 4)[row, column] == pytest.approx(15.0, abs=0.6)
    assert rectify(rows / 4)[row, column] == pytest.approx(75.0, abs=0.6)


def test_the_slopes_between_two_vantages_are_those_of_the_positions():
    grid = Rectifier(RIG).grid
    nodes = BlockGrid.over(grid.shape).nodes()
    motion = WallMotion(RIG, grid, nodes, before=TURNED, now=Pose(0.0, -10.0, 0.15, 8.0, 0.06))
    q = parameters(Pose(20, -11, 0.16, 9, 0.05, -0.01), TURNED, np.array([0.01, 0.01]))
    positions, slopes = motion.linearise(q)
    assert np.allclose(positions, motion.positions(q), equal_nan=True)
    for n in range(PARAMETERS):
        step = 1e-4 * motion.scales * (np.arange(PARAMETERS) == n)
        found = (motion.positions(q + step) - motion.positions(q - step)) / (2 * step[n])
        assert np.nanmax(np.abs(found - slopes[n].T)) < 1e-5 * np.nanmax(np.abs(found))


def test_the_axis_is_found_in_the_picture_of_a_turned_camera():
    turned = replace(SCENARIOS["forward_wobble"], length_mm=60.0, frames_per_s=3)
    find = AxisFinder((RIG.camera.width, RIG.camera.height))
    for frame in film(turned):
        axis = find(frame.image)
        yaw, pitch = np.degrees(gaze(RIG, axis.pixel_uv, np.radians(frame.roll_deg)))
        assert yaw == pytest.approx(frame.yaw_deg, abs=3.5)
        assert pitch == pytest.approx(frame.pitch_deg, abs=3.5)


def test_a_picture_without_a_pipe_has_no_axis():
    noise = np.random.default_rng(0).integers(90, 130, (480, 640)).astype(np.uint8)
    assert AxisFinder((640, 480))(noise) is None


def test_text_is_masked_once_the_wall_has_moved_and_the_wall_is_not():
    frames = film(half_sized(replace(SCENARIOS["forward"], text=True, length_mm=150.0)))
    clear = film(half_sized(replace(SCENARIOS["forward"], length_mm=150.0)))
    overlay, bare = Overlay((320, 240)), Overlay((320, 240))
    for frame, other in zip(frames, clear, strict=True):
        overlay.add(frame.image)
        bare.add(other.image)
    mask = overlay.mask
    assert mask[5:15, 20:180].mean() > 0.9  # the name
    assert mask[225:236, 165:270].mean() > 0.9  # the running clock
    assert mask[40:200].mean() < 0.01
    assert bare.mask is None or bare.mask.mean() < 0.01


def test_a_camera_that_stands_masks_nothing():
    still = film(half_sized(replace(SCENARIOS["forward"], text=True, length_mm=1.0)))[0].image
    overlay = Overlay((320, 240))
    rng = np.random.default_rng(1)
    for _ in range(4 * LEAST_FRAMES):
        overlay.add(np.clip(still + rng.normal(0, 1.5, still.shape), 0, 255).astype(np.uint8))
    assert overlay.mask is None


def test_a_crooked_camera_is_placed_by_the_wall():
    scenario = replace(SCENARIOS["forward_crooked"], length_mm=900.0, crf=18)
    track, x_mm = tracked(half_sized(scenario))
    assert percent(track, x_mm) < 0.5
    assert np.count_nonzero(track.status == "lost") == 0
    within = np.abs(track.distance_mm - x_mm) <= 3 * track.sigma_distance_mm + 1e-6
    assert within.mean() >= 0.97


def test_looking_around_holds_the_distance_and_is_named():
    scenario = replace(
        SCENARIOS["forward_looking_around"],
        length_mm=400.0,
        legs=(0.5, 0.5),
        frames_per_s=15,
        looks=(Look(yaw_deg=50.0, pitch_deg=10.0),),
    )
    track, x_mm = tracked(half_sized(scenario))
    assert np.abs(track.distance_mm - x_mm).max() < 5.0
    yaw_deg = np.array([f.yaw_deg for f in film(half_sized(scenario))])
    turned = np.abs(yaw_deg) > 15
    assert track.looking_around[turned].mean() > 0.95
    assert not track.looking_around[np.abs(yaw_deg) < 3].any()


def test_a_camera_that_stands_and_tilts_a_little_drives_nowhere():
    scenario = replace(
        SCENARIOS["forward_looking_around"],
        length_mm=600.0,
        legs=(0.5, 0.5),
        rest_s=9.0,
        frames_per_s=10,
        looks=(Look(yaw_deg=6.0, pitch_deg=12.0, hold_s=4.0),),
    )
    track, x_mm = tracked(half_sized(scenario))
    stands = np.flatnonzero(np.diff(x_mm) == 0)
    assert len(stands) > 80
    assert np.ptp(track.distance_mm[stands]) < 3.0


def test_a_drive_in_and_out_again_closes():
    scenario = replace(
        SCENARIOS["forward_crooked"],
        length_mm=800.0,
        legs=(0.5, -0.5),
        rest_s=0.5,
        frames_per_s=15,
    )
    track, x_mm = tracked(half_sized(scenario))
    # The film ends where it began; 6 % of the way in are allowed in the field.
    assert abs(x_mm[-1]) < 1.0
    assert abs(track.distance_mm[-1]) < 0.02 * x_mm.max()
    assert np.count_nonzero(track.status == "lost") == 0


def test_one_picture_a_second_is_enough():
    scenario = replace(SCENARIOS["forward_slow"], length_mm=1800.0)
    track, x_mm = tracked(scenario)
    assert percent(track, x_mm) < 0.5
    assert np.count_nonzero(track.status == "lost") == 0


def test_a_pipe_without_texture_gives_no_certain_distance():
    blank = replace(
        SCENARIOS["forward"],
        contrast=0.0,
        first_joint_mm=9000.0,
        length_mm=600.0,
        frames_per_s=15,
    )
    track, x_mm = tracked(half_sized(blank))
    assert "ok" not in track.status[1:]
    assert track.sigma_distance_mm[-1] > 150.0
    assert x_mm[-1] == pytest.approx(600.0, abs=5)


def test_the_stated_pose_casts_like_the_renderer():
    ahead_mm, arc_mm, _ = WallCaster(RIG).cast(TURNED)
    wall = develop(RIG, cast(RIG, TURNED, robot_rays(RIG, [(420.0, 90.0)])))[0]
    assert wall == pytest.approx((ahead_mm[90, 420], arc_mm[90, 420]), abs=0.05)
    assert NOMINAL != TURNED


def test_after_a_cut_to_a_turned_camera_the_axis_shows_how_it_looks():
    mount = RIG.mount.model_copy(update={"pitch_deg": -12.0})
    turned = RIG.model_copy(update={"mount": mount})
    before = half_sized(replace(SCENARIOS["forward"], length_mm=240.0))
    after = half_sized(replace(SCENARIOS["forward"], true_rig=turned, seed=3, length_mm=600.0))
    frames = film(before) + film(after)
    track = follow(before.rig, [f.image for f in frames], np.arange(len(frames)) / 30)
    driven_mm = np.diff(track.distance_mm[-30:]).sum()
    true_mm = frames[-1].x_mm - frames[-30].x_mm
    assert driven_mm == pytest.approx(true_mm, rel=0.01)
    assert set(track.status[-30:]) == {"ok"}
    assert track.sigma_distance_mm[-1] > 20.0


def test_a_film_may_begin_with_the_camera_turned_far_aside():
    turned = RIG.model_copy(update={"mount": RIG.mount.model_copy(update={"pitch_deg": -25.0})})
    scenario = replace(SCENARIOS["forward"], true_rig=turned, seed=3, length_mm=400.0)
    track, x_mm = tracked(half_sized(scenario))
    assert np.count_nonzero(track.status == "lost") == 0
    assert percent(track, x_mm) < 3.0
