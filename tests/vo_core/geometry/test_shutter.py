"""When the rows of a rolling shutter saw the wall, against closed forms."""

import numpy as np
import pytest
from textures import make_rig

from vo_core.geometry.shutter import Exposure, exposure_s
from vo_core.geometry.wall import Pose, cast, develop, robot_rays

READOUT_MS, HEIGHT, FOCAL_PX, Z_MM = 24.0, 480, 1194.0, 230.0
FLAT = {"shape": "flat", "diameter_mm": None}


def rolling(camera=None, **parts):
    return make_rig(camera={"readout_ms": READOUT_MS} | (camera or {}), **parts)


def places(count=200, seed=0):
    """(axial, arc) mm within the picture of `make_rig`."""
    return np.random.default_rng(seed).uniform((-55, -42), (55, 42), (count, 2))


def test_a_floor_is_exposed_row_by_row():
    at = places()
    row = 239.5 + FOCAL_PX * at[:, 1] / Z_MM
    expected = READOUT_MS / 1000 * (row / HEIGHT - 0.5)
    assert np.abs(exposure_s(rolling(pipe=FLAT), at) - expected).max() < 1e-12


def test_a_pipe_is_exposed_in_the_rows_of_the_cylinder():
    at, radius = places(), 150.0
    phi = at[:, 1] / radius
    depth = radius * np.cos(phi) + Z_MM - radius
    row = 239.5 + FOCAL_PX * radius * np.sin(phi) / depth
    expected = READOUT_MS / 1000 * (row / HEIGHT - 0.5)
    assert np.abs(exposure_s(rolling(), at) - expected).max() < 1e-12


def test_a_camera_turned_by_a_quarter_reads_out_along_the_pipe():
    at = places()
    rig = rolling(pipe=FLAT, mount={"rotation_deg": 90.0})
    # The picture's right points to the robot's right, its lower edge backwards.
    row = 239.5 - FOCAL_PX * at[:, 0] / Z_MM
    expected = READOUT_MS / 1000 * (row / HEIGHT - 0.5)
    assert np.abs(exposure_s(rig, at) - expected).max() < 1e-12


def test_without_a_readout_all_is_exposed_at_once():
    exposure = Exposure.of(make_rig(), places())
    assert not exposure.offset_s.any()
    assert not exposure.slope.any()
    assert not exposure.bend.any()


def test_behind_the_camera_nothing_is_exposed():
    rig = rolling(mount={"view": "forward", "height_mm": 150.0})
    assert exposure_s(rig, np.array([[-100.0, 0.0], [300.0, 0.0]])).tolist()[0] == 0.0


@pytest.mark.parametrize("rotation_deg", [0.0, 90.0, -90.0, 33.0])
def test_on_a_floor_the_moved_places_are_exact(rotation_deg):
    rig = rolling(pipe=FLAT, mount={"rotation_deg": rotation_deg})
    at, velocity = places(), np.array([-900.0, 40.0])
    moved = places(seed=1) / 4
    exposed = Exposure.of(rig, at).of_moved(moved, velocity)
    seen_at = at + moved + velocity * exposed[:, None]
    assert np.abs(exposed - exposure_s(rig, seen_at)).max() < 1e-12


LENSES = {
    "plain": rolling(mount={"rotation_deg": 90.0}),
    "distorted": rolling({"distortion": [-0.3, 0.1, 0.001, 0.002]}, mount={"rotation_deg": 60.0}),
    "fisheye": rolling(
        {"model": "fisheye", "fx": 210.0, "fy": 210.0},
        mount={"height_mm": 150.0, "rotation_deg": 90.0},
    ),
}


@pytest.mark.parametrize("rig", LENSES.values(), ids=LENSES.keys())
def test_on_a_cylinder_hardly_anything_is_left_out(rig):
    """Against the exposure that the moving picture really has, found by iteration.

    A fifth of the picture's width is driven, at 300 mm/s: an error of 0.1 ms is 0.03 mm.
    """
    camera = rig.camera
    low, high = np.array([0.2, 0.2]), np.array([0.8, 0.8])
    uv = np.random.default_rng(2).uniform(low, high, (200, 2)) * (camera.width, camera.height)
    at = develop(rig, cast(rig, Pose(), robot_rays(rig, uv)))
    driven_mm = 0.2 * np.ptp(at[:, 0])
    moved, velocity = np.array([-driven_mm, 0.0]), np.array([-300.0, 0.0])
    exact = np.zeros(len(at))
    for _ in range(30):
        exact = exposure_s(rig, at + moved + velocity * exact[:, None])
    seen = Exposure.of(rig, at).of_moved(moved, velocity)
    assert np.abs(exact).max() > 5e-3
    assert np.abs(seen - exact).max() < 2e-4
    assert np.abs(seen - exact).mean() < 1e-4
