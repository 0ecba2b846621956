"""The paper's equations, each against what it states."""

import numpy as np
import pytest
from textures import make_rig, pair, rig_fields

from vo_core import InvalidRig, Rig, ShapeMismatch
from vo_core.paper import PaperOdometry, displacement, wall_motion_mm


def test_the_peak_lies_at_minus_the_motion_of_the_content():
    before, now = (v.astype(np.float32) for v in pair((240, 320), (7.0, -4.0)))
    dx_px, dy_px, theta_deg, peak = displacement(before, now)
    assert (dx_px, dy_px, theta_deg) == (-7, 4, 0)
    assert 0.2 < peak <= 1


def test_the_peak_is_one_at_a_perfect_match():
    image = np.random.default_rng(0).normal(100, 20, (240, 320)).astype(np.float32)
    assert displacement(image, image) == pytest.approx((0, 0, 0, 1), abs=1e-3)


def test_equation_8_without_skew_is_the_pinhole():
    camera = make_rig().camera
    assert wall_motion_mm(camera, 230.0, 10.0, 5.0) == pytest.approx(
        (10 * 230 / 1194, 5 * 230 / 1194)
    )


def test_equation_8_undoes_the_skew_of_the_camera():
    camera = make_rig(camera={"skew": 40.0, "fy": 1100.0}).camera
    # u = fx X/Z + skew Y/Z + cx, so the content of a plane moves by:
    x_mm, y_mm, z_mm = 12.0, -7.0, 230.0
    dx_px = (camera.fx * x_mm + camera.skew * y_mm) / z_mm
    assert wall_motion_mm(camera, z_mm, dx_px, camera.fy * y_mm / z_mm) == pytest.approx(
        (x_mm, y_mm)
    )


def test_a_turned_mount_reports_in_the_axes_of_the_robot():
    fields = rig_fields(camera={"width": 320, "height": 240}, mount={"rotation_deg": 90.0})
    odometry = PaperOdometry(Rig.parse(fields))
    before, now = pair((240, 320), (10.0, 0.0))
    odometry.step(before, 0.0)
    estimate = odometry.step(now, 0.1)
    # The content moves to image-right, which is robot-right: the camera moved to the left.
    assert estimate.x_mm == pytest.approx(0, abs=1e-9)
    assert estimate.y_mm == pytest.approx(-10 * 230 / 1194)


def test_it_needs_a_camera_that_looks_down():
    with pytest.raises(InvalidRig, match=r"mount\.view.*looks down"):
        PaperOdometry(make_rig(mount={"view": "forward", "height_mm": 150.0}))


def test_pictures_of_another_size_are_refused():
    with pytest.raises(ShapeMismatch, match="320x240"):
        PaperOdometry(make_rig()).step(np.zeros((240, 320)), 0.0)
