"""The renderer's geometry against OpenCV's own projection, which it does not use."""

import cv2
import numpy as np
import pytest

from app.simulation.camera import REACH_MM, WallCaster, mount_rotation
from app.simulation.motion import Pose
from vo_core.rig import Rig
from vo_core.wall import wall_point

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


def project(rig: Rig, pose: Pose, x_mm, arc_mm):
    """Pixels of developed wall points, by OpenCV's forward models."""
    camera = rig.camera
    if rig.pipe.diameter_mm is None:
        y_mm, z_mm = arc_mm, np.full_like(arc_mm, rig.mount.height_mm)
        centre_z_mm = 0.0
    else:
        radius_mm = rig.pipe.diameter_mm / 2
        y_mm = radius_mm * np.sin(arc_mm / radius_mm)
        z_mm = radius_mm * np.cos(arc_mm / radius_mm)
        centre_z_mm = radius_mm - rig.mount.height_mm
    to_wall = np.stack(
        [x_mm - pose.x_mm, y_mm - rig.mount.lateral_mm - pose.y_mm, z_mm - centre_z_mm], axis=-1
    )
    c, s = np.cos(pose.yaw_rad), np.sin(pose.yaw_rad)
    r_world_camera = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ mount_rotation(rig.mount)
    points = to_wall.reshape(-1, 1, 3) @ r_world_camera
    still = np.zeros(3)
    if camera.model == "fisheye":
        distortion = np.array(camera.distortion or [0.0] * 4)
        plane, _ = cv2.fisheye.projectPoints(points, still, still, np.eye(3), distortion)
    else:
        distortion = np.array(camera.distortion)
        plane, _ = cv2.projectPoints(points, still, still, np.eye(3), distortion)
    x, y = plane.reshape(-1, 2).T
    u = camera.fx * x + camera.skew * y + camera.cx
    return u, camera.fy * y + camera.cy


@pytest.mark.parametrize("name", RIGS)
def test_wall_points_project_back_to_their_pixels(name):
    rig, pose = make_rig(name), Pose(x_mm=1234.5, y_mm=-7.0, yaw_rad=0.06)
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
        point = wall_point(rig, (u, v), pose.x_mm, pose.y_mm, np.degrees(pose.yaw_rad))
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
