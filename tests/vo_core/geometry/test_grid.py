"""The grid of a rig lies where the wall is."""

from __future__ import annotations

import numpy as np
import pytest

from vo_core.errors import InvalidRig
from vo_core.geometry.gaze import gaze
from vo_core.geometry.grid import grid
from vo_core.geometry.wall import Pose, wall_point
from vo_core.rig import Rig

RIG = Rig.parse(
    {
        "camera": {
            "model": "pinhole", "width": 640, "height": 480, "fx": 420.0, "fy": 420.0,
            "cx": 319.5, "cy": 239.5, "distortion": [-0.1, 0.01, 0.0, 0.0],
        },
        "mount": {
            "view": "forward", "height_mm": 130.0, "lateral_mm": 10.0, "rotation_deg": 0.0,
            "pitch_deg": -4.0, "roll_deg": 2.0,
        },
        "pipe": {"shape": "circular", "diameter_mm": 300.0},
    }
)  # fmt: skip


def test_rings_are_one_two_and_three_radii_ahead() -> None:
    pose = Pose(yaw_rad=0.05)
    for radii, ring in zip((1, 2, 3), grid(RIG, pose).rings_uv, strict=True):
        inside = [uv for uv in ring if np.isfinite(uv).all() and (uv >= 0).all()]
        assert len(inside) > 20
        for u, v in inside:
            point = wall_point(RIG, (u, v), pose)
            assert point
            # Undistortion is iterated to about a thousandth of a pixel.
            assert point.distance_mm == pytest.approx(radii * 150, abs=0.05)


def test_generators_are_at_the_hours_and_end_at_the_axis() -> None:
    lines = grid(RIG, Pose(yaw_rad=0.05)).generators_uv
    right = wall_point(RIG, tuple(lines[3][20]), Pose(yaw_rad=0.05))
    assert right
    assert right.clock_h == pytest.approx(3, abs=1e-3)
    end = np.mean([line[-1] for line in lines], axis=0)
    yaw, pitch = np.degrees(gaze(RIG, tuple(end), 0.0))
    # The last points are 30 radii ahead, and the camera is off the axis by a seventh of a radius.
    assert yaw == pytest.approx(np.degrees(0.05), abs=0.3)
    assert pitch == pytest.approx(0, abs=0.3)


def test_the_grid_goes_with_the_camera() -> None:
    pose = Pose(x_mm=2000.0, y_mm=8.0, yaw_rad=0.1, z_mm=-5.0, pitch_rad=0.05, roll_rad=0.1)
    (ring,) = grid(RIG, pose, rings_radii=[2.5]).rings_uv
    u, v = ring[len(ring) // 4]  # at 3 o'clock
    point = wall_point(RIG, (u, v), pose)
    assert point
    assert point.distance_mm == pytest.approx(2000.0 + 2.5 * 150, abs=0.05)
    assert point.clock_h == pytest.approx(3, abs=1e-3)


def test_a_flat_floor_has_no_rings() -> None:
    flat = RIG.model_copy(update={"pipe": RIG.pipe.model_copy(update={"diameter_mm": None})})
    with pytest.raises(InvalidRig, match="no rings"):
        grid(flat)
