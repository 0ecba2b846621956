"""Geometry of rays and the wall, against algebra done by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from textures import make_rig

from vo_core import Pose, wall_point
from vo_core.geometry.wall import (
    camera_position,
    cast,
    clock_of,
    develop,
    enclose,
    pixel_rays,
    ray_pixels,
    robot_rays,
    sight,
    wall_points,
)

FISHEYE = {"model": "fisheye", "fx": 210.0, "fy": 212.0, "distortion": [0.02, -0.01, 0.002, 0.0]}
RIGS = {
    "plain": make_rig(),
    "skewed and distorted": make_rig(
        camera={"skew": 5.0, "distortion": [-0.3, 0.1, 0.001, 0.002]}, mount={"rotation_deg": 33.0}
    ),
    "tilted fisheye": make_rig(
        camera=FISHEYE,
        mount={"height_mm": 150.0, "pitch_deg": 3.0, "roll_deg": -2.0, "lateral_mm": 4.0},
    ),
    "forward": make_rig(camera=FISHEYE, mount={"height_mm": 150.0, "view": "forward"}),
    "floor": make_rig(pipe={"shape": "flat", "diameter_mm": None}),
}
ALL = pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())


def pixels(rig, count=500):
    high = (rig.camera.width - 1, rig.camera.height - 1)
    return np.random.default_rng(0).uniform(0, high, (count, 2))


@ALL
def test_a_ray_comes_back_to_its_pixel(rig):
    uv = pixels(rig)
    assert np.abs(ray_pixels(rig.camera, pixel_rays(rig.camera, uv)) - uv).max() < 1e-6


@ALL
def test_a_wall_point_is_seen_where_its_ray_went_out(rig):
    pose = Pose(120.0, -6.0, 0.1)
    rays = robot_rays(rig, pixels(rig))
    wall = cast(rig, pose, rays)
    hit = np.isfinite(wall).all(1)
    assert hit.any()
    back = sight(rig, pose, wall[hit])
    back /= np.linalg.norm(back, axis=1, keepdims=True)
    assert np.abs(back - rays[hit]).max() < 1e-9
    assert np.abs(enclose(rig, develop(rig, wall[hit])) - wall[hit]).max() < 1e-6


def test_the_centre_of_a_camera_that_looks_down_is_the_invert_below_it():
    point = wall_point(make_rig(), (319.5, 239.5), Pose(x_mm=500.0))
    assert (point.distance_mm, point.arc_mm, point.clock_h) == pytest.approx((500.0, 0.0, 6.0))


def test_image_right_points_forward_and_image_down_to_the_right():
    forward, right = (wall_point(make_rig(), uv) for uv in ((639, 239.5), (319.5, 479)))
    assert forward.distance_mm == pytest.approx(319.5 * 230 / 1194)
    assert forward.arc_mm == pytest.approx(0, abs=1e-9)
    # The ray (0, s, 1) from (0, 0, R - h) meets y^2 + z^2 = R^2 where s = tan of the ray's angle.
    slope, radius, up = 239.5 / 1194, 150.0, 80.0
    t = (up + np.sqrt(radius**2 * (1 + slope**2) - up**2 * slope**2)) / (1 + slope**2)
    assert right.arc_mm == pytest.approx(radius * np.arctan2(slope * t, t - up))
    assert right.clock_h < 6


def test_a_mount_turned_by_a_quarter_has_image_right_to_the_robots_right():
    point = wall_point(make_rig(mount={"rotation_deg": 90.0}), (639, 239.5))
    assert point.arc_mm > 50
    assert point.distance_mm == pytest.approx(0, abs=1e-9)


def test_yaw_turns_forward_to_the_right():
    assert wall_point(make_rig(), (639, 239.5), Pose(yaw_rad=np.radians(10.0))).arc_mm > 5


def test_nose_up_looks_ahead_and_right_side_down_looks_left():
    up, down = (make_rig(mount=m) for m in ({"pitch_deg": 10.0}, {"roll_deg": 10.0}))
    assert wall_point(up, (319.5, 239.5)).distance_mm > 20
    assert wall_point(down, (319.5, 239.5)).arc_mm < -20


def test_skew_is_the_papers_alpha():
    # u = fx X/Z + skew Y/Z + cx on a plane at Z = height.
    rig = make_rig(camera={"skew": 30.0}, pipe={"shape": "flat", "diameter_mm": None})
    x_mm, y_mm, z_mm = 20.0, 15.0, 230.0
    u = 1194 * x_mm / z_mm + 30 * y_mm / z_mm + 319.5
    point = wall_point(rig, (u, 1194 * y_mm / z_mm + 239.5))
    assert (point.distance_mm, point.arc_mm) == pytest.approx((x_mm, y_mm))


def test_a_ray_along_the_pipe_meets_no_wall():
    rig = make_rig(camera={"cx": 320.0, "cy": 240.0}, mount={"view": "forward", "height_mm": 150.0})
    assert wall_point(rig, (320.0, 240.0)) is None


@pytest.mark.parametrize(("phi_deg", "clock"), [(0, 6), (90, 3), (-90, 9), (180, 12), (-180, 12)])
def test_clock_positions_are_those_seen_in_the_direction_of_travel(phi_deg, clock):
    assert clock_of(np.radians(phi_deg)) == pytest.approx(clock)


@given(phi=st.floats(-20, 20))
def test_clock_lies_in_0_to_12(phi):
    assert 0 < clock_of(phi) <= 12


@pytest.mark.parametrize("distortion", [[], [-0.2, 0.05, 0.0, 0.0]])
def test_no_pixels_show_no_places(distortion):
    rig = make_rig(camera={"distortion": distortion})
    assert wall_points(rig, [], Pose()) == []


def test_a_corrugated_wall_lies_between_its_crests_and_its_valleys():
    waves = {"pitch_mm": 67.7, "depth_mm": 13.0}
    smooth, waved = make_rig(), make_rig(pipe={"corrugation": waves})
    below, crest = (
        cast(rig, Pose(), np.array([[0.0, 0.0, 1.0]]))[0] - camera_position(rig, Pose())
        for rig in (waved, smooth)
    )
    # The camera keeps its place in the pipe: its height is stated above the crests.
    assert camera_position(waved, Pose()) == pytest.approx(camera_position(smooth, Pose()))
    assert below - crest == pytest.approx([0.0, 0.0, 6.5], abs=0.2)
