"""The renderer's geometry against OpenCV's own projection, which it does not use."""

import numpy as np
import pytest
from projection import project

from app.lab.simulation.camera import REACH_MM, WallCaster
from app.lab.simulation.scenario import Silt
from vo_core.geometry.wall import Pose, wall_point
from vo_core.rig import Rig

PINHOLE = {
    "model": "pinhole", "width": 320, "height": 240,
    "fx": 597.0, "fy": 601.0, "cx": 150.0, "cy": 125.0, "skew": 3.0,
    "distortion": [-0.2, 0.05, 0.001, -0.002],
}  # fmt: skip
FISHEYE = {
    **PINHOLE, "model": "fisheye", "fx": 105.0, "fy": 104.0,
    "distortion": [0.02, -0.005, 0.001, 0.0],
}  # fmt: skip
TILTED = {"rotation_deg": 25.0, "lateral_mm": 6.0, "pitch_deg": 4.0, "roll_deg": -3.0}
CIRCULAR = {"shape": "circular", "diameter_mm": 300.0}

RIGS = {
    "pinhole down": (PINHOLE, {"view": "down", "height_mm": 230.0, **TILTED}, CIRCULAR),
    "pinhole floor": (
        PINHOLE, {"view": "down", "height_mm": 230.0, **TILTED}, {"shape": "flat"},
    ),
    "fisheye down": (FISHEYE, {"view": "down", "height_mm": 150.0, **TILTED}, CIRCULAR),
    "pinhole forward": (PINHOLE, {"view": "forward", "height_mm": 140.0, **TILTED}, CIRCULAR),
}  # fmt: skip


def make_rig(name: str) -> Rig:
    camera, mount, pipe = RIGS[name]
    return Rig.parse({"camera": camera, "mount": mount, "pipe": pipe})


POSES = {
    "in three": Pose(x_mm=1234.5, y_mm=-7.0, yaw_rad=0.06),
    "in six": Pose(1234.5, -7.0, 0.06, z_mm=5.0, pitch_rad=0.05, roll_rad=-0.07),
}


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
@pytest.mark.parametrize("name", RIGS)
def test_wall_points_project_back_to_their_pixels(name, pose):
    rig = make_rig(name)
    ahead_mm, arc_mm, _ = WallCaster(rig).cast(pose)
    v, u = np.mgrid[5:235:23, 5:315:31]
    near = np.abs(ahead_mm[v, u]) < 0.9 * REACH_MM
    if rig.camera.model == "fisheye":  # OpenCV's fisheye cannot look sideways or back
        near &= np.hypot(u - rig.camera.cx, v - rig.camera.cy) < 1.4 * rig.camera.fx
    v, u = v[near], u[near]
    assert len(u) > 50

    u_back, v_back = project(
        rig, pose, pose.x_mm + ahead_mm[v, u].astype(float), arc_mm[v, u].astype(float)
    )

    # float32 of a wall point 1 m away is 0.06 um; through the shortest focal length, below 0.01 px.
    assert np.abs(u_back - u).max() < 0.01
    assert np.abs(v_back - v).max() < 0.01


@pytest.mark.parametrize("name", RIGS)
def test_both_geometries_of_the_repository_agree(name):
    rig, pose = make_rig(name), Pose(x_mm=10.0, y_mm=5.0, yaw_rad=0.08)
    ahead_mm, arc_mm, _ = WallCaster(rig).cast(pose)
    for u, v in ((40, 30), (40, 210), (270, 30), (270, 210)):
        point = wall_point(rig, (u, v), pose)
        assert point is not None
        ahead = np.clip(point.distance_mm - pose.x_mm, -REACH_MM, REACH_MM)
        assert ahead_mm[v, u] == pytest.approx(ahead, abs=1e-3)
        assert arc_mm[v, u] == pytest.approx(point.arc_mm, abs=1e-3)


def centre_of_view(mount: dict, pose: Pose) -> tuple[float, float]:
    """Where a distortion-free camera looks on a floor: ahead and to the right in mm."""
    camera = {**PINHOLE, "cx": 160.0, "cy": 120.0, "distortion": []}
    rig = Rig.parse(
        {
            "camera": camera,
            "mount": {"view": "down", "height_mm": 200.0, "rotation_deg": 0.0, **mount},
            "pipe": {"shape": "flat"},
        }
    )
    ahead_mm, arc_mm, _ = WallCaster(rig).cast(pose)
    return float(ahead_mm[120, 160]), float(arc_mm[120, 160])


def test_positive_pitch_lifts_the_nose_and_looks_ahead():
    ahead_mm, _ = centre_of_view({"pitch_deg": 10.0}, Pose(0, 0, 0))
    assert ahead_mm == pytest.approx(200 * np.tan(np.radians(10)), abs=1e-3)


def test_positive_roll_lowers_the_right_side_and_looks_left():
    _, right_mm = centre_of_view({"roll_deg": 10.0}, Pose(0, 0, 0))
    assert right_mm == pytest.approx(-200 * np.tan(np.radians(10)), abs=1e-3)


def test_positive_yaw_turns_what_lies_ahead_to_the_right():
    _, right_mm = centre_of_view({"pitch_deg": 10.0}, Pose(0, 0, np.pi / 2))
    assert right_mm == pytest.approx(200 * np.tan(np.radians(10)), abs=1e-3)


def test_rotation_turns_the_right_of_the_picture_from_forward_to_the_right():
    rig = make_rig("pinhole floor")
    rig = rig.model_copy(
        update={"mount": rig.mount.model_copy(update={"rotation_deg": 90.0, "pitch_deg": 0.0})}
    )
    _, arc_mm, _ = WallCaster(rig).cast(Pose(0, 0, 0))
    assert arc_mm[120, 300] > arc_mm[120, 20] + 50


def test_a_ray_above_the_horizon_of_a_floor_reaches_nothing():
    rig = Rig.parse(
        {
            "camera": {**PINHOLE, "skew": 0.0, "distortion": []},
            "mount": {"view": "forward", "height_mm": 200.0, "rotation_deg": 0.0},
            "pipe": {"shape": "flat"},
        }
    )
    _, _, range_mm = WallCaster(rig).cast(Pose(0, 0, 0))
    assert (range_mm[:100] > REACH_MM).all()
    assert (range_mm[-1] < 2 * REACH_MM).all()


NARROW = (PINHOLE, {"view": "down", "height_mm": 230.0, "rotation_deg": 0.0}, CIRCULAR)


def narrow_rig(**changes) -> Rig:
    camera, mount, pipe = NARROW
    return Rig.parse({"camera": camera, "mount": mount | changes, "pipe": pipe})


def test_turn_about_the_axis_of_the_pipe_moves_all_points_by_one_arc():
    rig, angle = narrow_rig(), 0.1
    below_mm = 150.0 - 230.0
    turned = Pose(
        0.0, -below_mm * np.sin(angle), 0.0, below_mm * np.cos(angle) - below_mm, 0.0, angle
    )
    before, after = (WallCaster(rig).cast(pose) for pose in (Pose(0, 0, 0), turned))
    np.testing.assert_allclose(after[0], before[0], atol=1e-3)
    # Right-handed about x: the view of a robot that leans to the right goes to the left.
    np.testing.assert_allclose(after[1] - before[1], -150.0 * angle, atol=1e-3)


def test_camera_that_goes_up_sees_a_floor_in_proportion():
    rig = make_rig("pinhole floor")
    before, after = (WallCaster(rig).cast(Pose(0, 0, 0, z_mm=z)) for z in (0.0, -23.0))
    np.testing.assert_allclose(after[0], 1.1 * before[0], atol=1e-3)
    from_camera = (image[1] - rig.mount.lateral_mm for image in (before, after))
    np.testing.assert_allclose(*(next(from_camera) * share for share in (1.1, 1.0)), atol=1e-3)


@pytest.mark.parametrize("part", ["pitch", "roll"])
def test_a_mount_that_is_tilted_and_a_robot_that_is_look_at_the_same_wall(part):
    mounted = WallCaster(narrow_rig(**{f"{part}_deg": 3.0})).cast(Pose(0, 0, 0))
    leaning = WallCaster(narrow_rig()).cast(Pose(0, 0, 0, **{f"{part}_rad": np.radians(3.0)}))
    for ours, theirs in zip(mounted, leaning, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-3)


def test_rows_of_different_times_have_the_poses_of_these_times():
    caster = WallCaster(make_rig("pinhole down"))
    poses = [Pose(0.1 * row, 0.01 * row, 1e-4 * row, pitch_rad=2e-4 * row) for row in range(240)]
    each = caster.cast(*poses)
    for row in (0, 101, 239):
        whole = caster.cast(poses[row])
        for ours, theirs in zip(each, whole, strict=True):
            np.testing.assert_array_equal(ours[row], theirs[row])


def test_silt_is_a_flat_bed_at_its_depth_and_the_wall_goes_on_beside_it():
    rig = make_rig("fisheye down")
    rig = rig.model_copy(update={"mount": narrow_rig(height_mm=150.0).mount})
    pose = Pose(40.0, 3.0, 0.05, pitch_rad=0.02)
    clean = WallCaster(rig).cast(pose)
    ahead_mm, arc_mm, range_mm = WallCaster(rig, Silt(start_mm=25.0)).cast(pose)
    is_bed = range_mm < clean[2] - 1e-3
    half_chord_mm = np.sqrt(150.0**2 - 125.0**2)
    assert 0.05 < is_bed.mean() < 0.5
    assert np.abs(arc_mm[is_bed]).max() == pytest.approx(half_chord_mm, abs=3)
    np.testing.assert_allclose(range_mm[~is_bed], clean[2][~is_bed])
    # In straight lines from the camera, which is on the axis, to 125 mm below it.
    seen = np.hypot(np.hypot(ahead_mm, arc_mm - pose.y_mm), 125.0)
    is_near = is_bed & (range_mm < 0.9 * REACH_MM)
    np.testing.assert_allclose(seen[is_near], range_mm[is_near], rtol=1e-5)


def test_rising_silt_is_as_deep_where_it_is_seen_as_its_slope_says():
    rig = narrow_rig()
    silt = Silt(start_mm=-5.0, slope=0.02)  # begins 250 mm ahead of the first frame
    pose = Pose(1000.0, 0.0, 0.0)
    ahead_mm, arc_mm, range_mm = WallCaster(rig, silt).cast(pose)
    depth_mm = -5.0 + 0.02 * (1000.0 + ahead_mm)
    below_camera_mm = 230.0 - depth_mm
    seen = np.sqrt(ahead_mm**2 + arc_mm**2 + below_camera_mm**2)
    np.testing.assert_allclose(seen, range_mm, rtol=1e-5)
    for ours, theirs in zip(
        WallCaster(rig, silt).cast(Pose(0, 0, 0)), WallCaster(rig).cast(Pose(0, 0, 0)), strict=True
    ):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("name", ["pinhole down", "pinhole forward"])
def test_rays_end_where_they_first_meet_the_waves_of_a_metal_pipe(name):
    smooth = make_rig(name)
    waves = {"pitch_mm": 67.7, "depth_mm": 13.0}
    rig = Rig.parse(smooth.model_dump() | {"pipe": CIRCULAR | {"corrugation": waves}})
    pose = POSES["in six"]
    crests, first = (
        WallCaster(one).cast(pose)[2][::16, ::16].astype(float) for one in (smooth, rig)
    )
    ahead = WallCaster(rig).cast(pose)[0][::16, ::16].astype(float)
    near = np.abs(ahead) < 0.9 * REACH_MM
    crests, first, ahead = crests[near], first[near], ahead[near]
    y, z = pose.y_mm + rig.mount.lateral_mm, 150 - rig.mount.height_mm + pose.z_mm
    # Along the ray the square of the distance from the axis is c + b t + a t^2; it is R at crests.
    a = 1 - (ahead / first) ** 2
    c = y * y + z * z
    b = (150.0**2 - c - a * crests**2) / crests

    def beyond_mm(t):
        depth_mm = 6.5 * (1 - np.cos(2 * np.pi / 67.7 * (pose.x_mm + t * ahead / first)))
        return np.sqrt(c + b * t + a * t * t) - 150 - depth_mm

    assert first.max() - crests.min() > 13
    assert np.abs(beyond_mm(first)).max() < 0.05
    assert max(beyond_mm(share * first).max() for share in np.linspace(0.3, 1, 300)) < 0.05
