"""The displacement field against algebra and the paper's figures; the advice against the wall."""

import numpy as np
import pytest
from textures import make_rig

from vo_core import InvalidRig, Pose, Rig
from vo_core.advice import (
    Spread,
    Verdict,
    advise,
    developed_displacement_mm,
    displacement_field,
    displacement_px,
    total_derivative_px,
)
from vo_core.geometry.wall import enclose

MOVE = Pose(15.0, 5.0)
"""The paper's: 15 mm along x, 5 mm along y."""


def paper_rig(view_deg: float, height_mm: float) -> Rig:
    """The paper's camera: f = 800 px, alpha = 0.0004, in a pipe of radius 150 mm."""
    side = 2 * round(800 * np.tan(np.radians(view_deg / 2))) + 1
    return make_rig(
        camera={
            "width": side,
            "height": side,
            "fx": 800.0,
            "fy": 800.0,
            "cx": (side - 1) / 2,
            "cy": (side - 1) / 2,
            "skew": 0.0004,
        },
        mount={"height_mm": height_mm},
        pipe={"diameter_mm": 300.0},
    )


WIDE = paper_rig(150, 150.0)
NARROW = paper_rig(30, 230.0)
FISHEYE = make_rig(
    camera={"model": "fisheye", "fx": 210.0, "fy": 212.0, "distortion": [0.02, -0.01, 0.002, 0.0]},
    mount={"height_mm": 150.0, "rotation_deg": 40.0, "pitch_deg": 2.0},
)


def around_the_invert(rig, half_view_deg, axial_mm=0.0):
    """World points straight across the pipe below the camera, evenly from left to right."""
    angle = np.radians(np.linspace(-half_view_deg, half_view_deg, 61))
    rise = 150.0 - rig.mount.height_mm  # of the camera below the pipe's axis
    # Law of sines: the wall angle that a ray at `angle` through the camera ends at.
    phi = angle - np.arcsin(np.clip(rise * np.sin(angle) / 150.0, -1, 1))
    return enclose(rig, np.column_stack([np.full_like(phi, axial_mm), 150.0 * phi]))


@pytest.mark.parametrize("rig", [WIDE, NARROW], ids=["150 degrees", "30 degrees"])
def test_pinhole_above_the_invert_moves_as_the_papers_total_derivative(rig):
    wall = around_the_invert(rig, 14, axial_mm=20.0)
    depth = wall[:, 2] - (150.0 - rig.mount.height_mm)
    by_hand = np.column_stack([-(800 * 15 + 0.0004 * 5) / depth, -800 * 5 / depth])
    # With dZ = 0 the derivative is exact for a motion of any size.
    assert displacement_px(rig, wall, MOVE) == pytest.approx(by_hand, abs=1e-9)
    assert total_derivative_px(rig, wall, MOVE) == pytest.approx(by_hand, abs=1e-5)


def test_figures_2_and_3_centre_moves_less_than_the_sides_at_150_degrees():
    length = np.linalg.norm(displacement_px(WIDE, around_the_invert(WIDE, 75), MOVE), axis=1)
    centre, left, right = length[30], length[0], length[-1]
    assert length.argmin() == 30
    assert (np.diff(length[30:]) > 0).all()
    assert left == pytest.approx(right)
    assert length == pytest.approx(length[::-1])
    # Z falls from 150 mm at the invert to 150 cos 75 at the sides, and 1/Z rises.
    assert right / centre == pytest.approx(1 / np.cos(np.radians(75)))
    assert centre == pytest.approx(800 * np.hypot(15, 5) / 150)


def test_figure_3_does_not_depend_on_the_position_along_the_pipe():
    here, there = (
        displacement_px(WIDE, around_the_invert(WIDE, 60, axial), MOVE) for axial in (0.0, 90.0)
    )
    assert here == pytest.approx(there)


def test_figure_4_differences_can_be_ignored_at_30_degrees():
    wide, narrow = advise(WIDE, MOVE), advise(NARROW, MOVE)
    assert narrow.raw_px.relative < 0.06
    assert wide.raw_px.relative > 20 * narrow.raw_px.relative
    assert narrow.is_even
    assert not wide.is_even


@pytest.mark.parametrize("rig", [WIDE, NARROW], ids=["150 degrees", "30 degrees"])
def test_field_is_symmetric_to_the_invert(rig):
    field = displacement_field(rig, Pose(15.0))
    rows = field.exact_px[:, field.exact_px.shape[1] // 2]
    arc = field.wall_mm[:, 0, 1]
    mirrored = np.interp(-arc, arc, rows[:, 0])
    inside = np.isfinite(rows[:, 0]) & np.isfinite(mirrored) & (np.abs(arc) < 0.8 * arc.max())
    assert inside.sum() > 15
    # The patch is a grid: its rows lie within a pixel of the mirror's.
    assert rows[inside, 0] == pytest.approx(mirrored[inside], rel=0.02)


def test_exact_displacement_of_a_small_motion_is_the_total_derivative():
    wall = enclose(FISHEYE, np.array([[10.0, 20.0], [-80.0, 60.0], [40.0, -120.0]]))
    small = Pose(0.015, 0.005, 1e-4)
    exact = displacement_px(FISHEYE, wall, small)
    assert total_derivative_px(FISHEYE, wall, small) == pytest.approx(exact, rel=1e-3)
    assert displacement_px(FISHEYE, wall, MOVE) != pytest.approx(
        total_derivative_px(FISHEYE, wall, MOVE), rel=1e-3
    )


@pytest.mark.parametrize(
    "rig",
    [WIDE, NARROW, FISHEYE, make_rig(mount={"lateral_mm": 12.0, "roll_deg": 4.0})],
    ids=["wide", "narrow", "fisheye", "off the axis"],
)
def test_driving_along_is_one_shift_of_the_developed_wall(rig):
    wall = enclose(rig, np.array([[0.0, 0.0], [30.0, -25.0], [-40.0, 30.0]]))
    moved = developed_displacement_mm(rig, wall, Pose(15.0))
    assert moved == pytest.approx(np.array([[-15.0, 0.0]] * 3), abs=1e-6)
    assert advise(rig, MOVE).developed_drive_mm.relative < 1e-6


def test_developed_displacement_takes_the_short_way_across_the_crown():
    rig = make_rig(camera={"fx": 266.0, "fy": 266.0}, mount={"view": "forward", "height_mm": 150.0})
    crown = enclose(rig, np.array([[200.0, 150.0 * 3.14]]))
    assert np.abs(developed_displacement_mm(rig, crown, Pose(0.0, 3.0))).max() < 20


@pytest.mark.parametrize(
    ("height_mm", "percent"), [(150.0, -1 / 1.5), (190.0, -0.51), (230.0, -0.4)]
)
def test_height_error_is_that_of_the_notes_for_a_narrow_view(height_mm, percent):
    rig = make_rig(camera={"fx": 4000.0, "fy": 4000.0}, mount={"height_mm": height_mm})
    assert advise(rig, MOVE).height_error_percent == pytest.approx(percent, rel=0.1)


def test_height_error_over_a_floor_is_one_over_the_height():
    rig = make_rig(mount={"height_mm": 200.0}, pipe={"shape": "flat", "diameter_mm": None})
    assert advise(rig, MOVE).height_error_percent == pytest.approx(-0.5, rel=1e-3)


def test_advice_over_a_floor_is_that_of_plane_geometry():
    rig = make_rig(mount={"height_mm": 200.0}, pipe={"shape": "flat", "diameter_mm": None})
    advice = advise(rig, Pose(40.0), frame_rate_hz=25.0)
    mm_per_px = 200.0 / rig.camera.fx
    width_mm = (rig.camera.width - 1) * mm_per_px
    assert advice.raw_px.relative == pytest.approx(0, abs=1e-9)
    assert advice.raw_px.mean == pytest.approx(40.0 / mm_per_px)
    assert advice.finest_mm_per_px == pytest.approx(mm_per_px)
    assert advice.coarsest_mm_per_px == pytest.approx(mm_per_px)
    assert advice.axial_mm == pytest.approx((-width_mm / 2, width_mm / 2))
    assert advice.measured_axial_mm == pytest.approx(width_mm, rel=0.02)
    assert advice.measured_share == 1
    assert advice.overlap == pytest.approx(1 - 40.0 / width_mm, abs=0.02)
    # 68 % common wall make a keyframe last, 15 % are the least to measure on.
    assert advice.good_speed_mm_s == pytest.approx(0.32 * width_mm * 25, rel=0.03)
    assert advice.speed_limit_mm_s == pytest.approx(0.85 * width_mm * 25, rel=0.03)


def test_the_papers_second_rig_is_fit():
    advice = advise(NARROW, MOVE)
    assert advice.verdict is Verdict.FIT
    assert advice.findings == ()


@pytest.mark.parametrize(
    ("rig", "move", "verdict", "said"),
    [
        (NARROW, Pose(-60.0), Verdict.CARE, "50% of the wall is still seen: 68% are good"),
        (NARROW, Pose(120.0), Verdict.UNFIT, "take a wider lens or more frames"),
        (NARROW, Pose(0.0, 119.0), Verdict.UNFIT, "of the wall is still seen"),
        (make_rig(mount={"height_mm": 40.0}), Pose(1.0), Verdict.CARE, "2.5 % of distance"),
        (
            make_rig(mount={"height_mm": 1500.0}, pipe={"diameter_mm": 3000.0}),
            Pose(1.0),
            Verdict.CARE,
            "too coarse for the grain of concrete",
        ),
        (
            make_rig(camera={"fx": 266.0, "fy": 266.0}, mount={"pitch_deg": 75.0}),
            Pose(1.0),
            Verdict.CARE,
            "of the picture show the wall well enough",
        ),
        (
            make_rig(camera={"fx": 266.0, "fy": 266.0}, mount={"view": "forward"}),
            Pose(1.0),
            Verdict.CARE,
            "looks forward along the pipe",
        ),
        (
            make_rig(pipe={"corrugation": {"pitch_mm": 67.7, "depth_mm": 13.0}}),
            Pose(1.0),
            Verdict.CARE,
            "The wall is corrugated",
        ),
    ],
)
def test_what_speaks_against_a_rig_is_reported_with_what_to_change(rig, move, verdict, said):
    advice = advise(rig, move)
    assert advice.verdict is verdict
    assert said in " ".join(finding.sentence for finding in advice.findings)


def test_camera_that_sees_no_wall_is_refused():
    rig = make_rig(
        mount={"view": "forward", "pitch_deg": 60.0}, pipe={"shape": "flat", "diameter_mm": None}
    )
    with pytest.raises(InvalidRig, match="looks past the wall: view 'forward', pitch_deg 60"):
        advise(rig, MOVE)
    with pytest.raises(InvalidRig):
        displacement_field(rig, MOVE)


def test_spread_is_over_the_lengths_and_ignores_what_is_not_seen():
    spread = Spread.of(np.array([[3.0, 4.0], [0.0, 6.0], [np.nan, 1.0]]))
    assert (spread.smallest, spread.mean, spread.largest) == (5.0, 5.5, 6.0)
    assert spread.relative == pytest.approx(1 / 5.5)
    assert Spread.of(np.zeros((3, 2))).relative == 0
