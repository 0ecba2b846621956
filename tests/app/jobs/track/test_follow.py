"""A run of a camera that looks along the pipe and does not stand where its rig says."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import av
import cv2
import numpy as np
import pytest
from films import film, half_sized
from in_process import batch_of
from projection import project

from app.inspections.picking import WallPlace, seen_best
from app.jobs.track.batches import Batch
from app.jobs.track.follow import Follower
from app.lab.simulation import SCENARIOS, RenderedFrame
from app.survey.adjustment.adjust import adjust
from app.survey.distances.stated import Stated
from app.survey.places.place import Trajectory, wall_under
from vo_core import Estimate, Pose, Track
from vo_core.geometry.initial_pose import InitialPose
from vo_core.joints.sightings import places_mm
from vo_core.mosaic.layout import Layout
from vo_core.sources import frame_of

CROOKED = replace(
    SCENARIOS["forward_crooked"],
    length_mm=1600.0,
    speed_mm_s=600.0,
    acceleration_mm_s2=2000.0,
    sway_mm=0.0,
    yaw_deg=0.0,
    aside_deg=0.0,
    text=False,
    light_follows_view=False,
    first_joint_mm=1100.0,
)
"""The camera stands 12 mm to the right and 16 mm low and looks 3 degrees down; no rig says so."""

TRUE = InitialPose(y_mm=12.0, z_mm=16.0, pitch_deg=-3.0)
AHEAD_MM = 250.0
CLOCKS_H = (1.0, 3.0, 5.0, 6.0, 7.0, 9.0, 11.0)
RADIUS_MM = 150.0


def followed(follower: Follower, frames: Iterable[RenderedFrame]) -> Batch:
    for each in frames:
        picture = av.VideoFrame.from_ndarray(each.image, format="gray")
        follower.add(frame_of(picture, each.index, each.t_s))
    follower.finish()
    return batch_of(follower)


def track_of(batch: Batch) -> Track:
    return Track.from_estimates(batch.estimates)


@pytest.fixture(scope="module")
def follower() -> Follower:
    return Follower(CROOKED.rig)


@pytest.fixture(scope="module")
def batch(follower: Follower) -> Batch:
    return followed(follower, film(CROOKED))


@pytest.fixture(scope="module")
def trajectory(batch: Batch, follower: Follower) -> Trajectory:
    track = Track.from_estimates([row for each in follower.smoothed() for row in each.smoothed])
    assert batch.initial_pose is not None
    return Trajectory(
        adjust(track, CROOKED.rig, Stated(), []), track, initial_pose=batch.initial_pose
    )


def true_pixel(frame: RenderedFrame, x_mm: float, clock_h: float) -> tuple[float, float]:
    """Return the pixel that shows a wall point to the camera where it really is."""
    arc_mm = RADIUS_MM * np.radians(180 - 30 * clock_h)
    pose = Pose(
        frame.x_mm, frame.y_mm, np.radians(frame.yaw_deg), frame.z_mm,
        np.radians(frame.pitch_deg), np.radians(frame.roll_deg),
    )  # fmt: skip
    u, v = project(CROOKED.rendered_rig, pose, np.array([x_mm]), np.array([arc_mm]))
    return float(u[0]), float(v[0])


def test_the_stance_is_that_of_the_real_camera(trajectory: Trajectory) -> None:
    # The first links of a coded film are short; the places after a metre do not suffer from it.
    assert trajectory.initial_pose.y_mm == pytest.approx(TRUE.y_mm, abs=8)
    assert trajectory.initial_pose.z_mm == pytest.approx(TRUE.z_mm, abs=8)
    for turn in ("yaw_deg", "pitch_deg", "roll_deg"):
        assert getattr(trajectory.initial_pose, turn) == pytest.approx(
            getattr(TRUE, turn), abs=1
        ), turn


def test_a_pixel_shows_its_wall_point_at_the_right_clock_and_distance(
    trajectory: Trajectory,
) -> None:
    frames = film(CROOKED)
    after_a_metre = np.flatnonzero(trajectory.raw.distance_mm > 1000)[::6].tolist()
    assert len(after_a_metre) > 4
    for n in after_a_metre:
        for clock_h in CLOCKS_H:
            x_mm = frames[n].x_mm + AHEAD_MM
            seen = wall_under(trajectory, n, true_pixel(frames[n], x_mm, clock_h))
            assert seen is not None
            assert seen.clock_h is not None
            assert seen.distance_mm == pytest.approx(x_mm, abs=5), (n, clock_h)
            assert 30 * seen.clock_h == pytest.approx(30 * clock_h, abs=2), (n, clock_h)


def test_a_place_on_the_wall_is_found_in_the_picture_where_it_is(trajectory: Trajectory) -> None:
    for clock_h in CLOCKS_H:
        seen = seen_best(trajectory, WallPlace(1400.0, clock_h, None), None)
        assert seen is not None
        truth = true_pixel(film(CROOKED)[seen.frame], 1400.0, clock_h)
        assert seen.pixel == pytest.approx(truth, abs=5)


def test_a_joint_is_a_ring_at_one_distance(batch: Batch, trajectory: Trajectory) -> None:
    assert places_mm(trajectory.raw, batch.sightings) == pytest.approx([1100.0], abs=3)


def test_the_unrolled_wall_shows_a_joint_as_a_straight_line(batch: Batch) -> None:
    layout = Layout.of(CROOKED.rig)
    (tile,) = (tile for tile in batch.tiles if tile.index == 2)
    picture = cv2.imdecode(np.frombuffer(tile.content, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    bands = cv2.resize(picture, (layout.width_px, 24), interpolation=cv2.INTER_AREA)
    at_mm = 1000 + (bands.argmin(axis=1) + 0.5) * layout.mm_per_px
    assert at_mm == pytest.approx(np.full(24, 1100.0), abs=8)


def test_joints_are_found_where_few_pictures_a_second_need_a_longer_patch() -> None:
    slow = half_sized(SCENARIOS["forward_slow"].shortened(2500.0))
    batch = followed(Follower(slow.rig), film(slow))
    track = track_of(batch)
    joints_mm = [slow.first_joint_mm, slow.first_joint_mm + 1500.0]
    assert sorted(places_mm(track, batch.sightings)) == pytest.approx(joints_mm, abs=5)


def test_a_camera_that_looks_down_stands_as_its_rig_states_in_every_part() -> None:
    down = CROOKED.rig.mount.model_copy(update={"view": "down"})
    rig = CROOKED.rig.model_copy(update={"mount": down})
    last = Estimate(3, 0.0, 0.0, 4.0, 0.5, 0.0, 1.0, 1.0, "ok", 1.0)
    frames = [replace(each, index=4 + each.index) for each in film(CROOKED)[:20]]
    for follower in (Follower(rig), Follower(rig, start=last, between="stood_still")):
        assert followed(follower, frames).initial_pose == InitialPose()


@pytest.mark.parametrize(("earlier", "is_known"), [(3, True), (300, False)])
def test_a_later_part_shows_the_stance_once_it_is_longer_than_the_run_before(
    earlier: int, *, is_known: bool
) -> None:
    last = Estimate(earlier, 0.0, 0.0, 4.0, 0.5, 0.0, 1.0, 1.0, "ok", 1.0)
    frames = [replace(each, index=earlier + 1 + each.index) for each in film(CROOKED)[:20]]
    alone = followed(Follower(CROOKED.rig), film(CROOKED)[:20]).initial_pose
    later = followed(Follower(CROOKED.rig, start=last, between="stood_still"), frames)
    if not is_known:
        assert later.initial_pose is None
        return
    assert alone is not None
    assert later.initial_pose is not None
    assert later.initial_pose.y_mm == alone.y_mm - 4.0
    assert later.initial_pose.yaw_deg == alone.yaw_deg - 0.5
    assert later.initial_pose.z_mm == alone.z_mm
