"""Predicts before any drive whether a camera in a pipe is fit for the method.

The direct method needs the whole picture to move by one displacement, but the depth of a round wall
varies over the picture.  The paper (section 2.2, figures 2 to 4) examines this for a camera on the
axis and one above it.  This module does so for any lens and mount, both for the raw picture and for
the developed wall, on which the odometry measures.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from vo_core.geometry.rectify import COARSEST, Rectifier, no_wall_in_view
from vo_core.geometry.wall import (
    NOMINAL,
    Points,
    Pose,
    cast,
    develop,
    enclose,
    robot_pixels,
    robot_rays,
    sight,
)
from vo_core.links.locator import LEAST_OVERLAP
from vo_core.rig import Camera, Rig
from vo_core.tracker.references import KEYFRAME_OVERLAP
from vo_core.types import ByteImage

Grid = NDArray[np.float64]
"""(rows around, columns along, 2) values on an even grid of wall points."""

EVEN_ENOUGH = 0.1
"""Largest relative spread at which one shift describes the raw picture, as the paper's method
needs.

It is 0.05 at 30 degrees and 230 mm, which the paper finds fit, and 1.3 at 150 degrees and 150 mm,
which it does not."""

GOOD_OVERLAP = KEYFRAME_OVERLAP["circular"]
"""Overlap of consecutive frames above which a keyframe serves several frames."""

HEIGHT_ERROR_PERCENT = 1.0
"""Largest error of the distance per mm of height at which a tape measures the height well enough.

A tape is good to half a millimetre, and contracts ask for half a percent."""

COARSE_MM_PER_PX = 2.0
"""Above this the grain of concrete, which the method needs, falls within one pixel."""

LEAST_SHARE = 0.5
"""Least share of the picture that should show the wall finely enough to measure on."""


class Verdict(StrEnum):
    """How well a rig suits the method, best first."""

    FIT = "fit"
    CARE = "fit with care"
    UNFIT = "not fit"


@dataclass(frozen=True)
class Finding:
    """One reason for a verdict."""

    name: str
    """One word, by which other languages find their sentence."""
    verdict: Verdict
    sentence: str
    """What was found and what to change."""


@dataclass(frozen=True)
class Spread:
    """How evenly a displacement is distributed over the picture, by the lengths of its vectors."""

    smallest: float
    mean: float
    largest: float

    @property
    def relative(self) -> float:
        """(largest - smallest) / mean, 0 where nothing moves."""
        return (self.largest - self.smallest) / self.mean if self.mean > 0 else 0.0

    @classmethod
    def of(cls, displacement: Points) -> Spread:
        """Measure (N, 2) vectors, at least one of them without nan."""
        length = np.linalg.norm(displacement, axis=1)
        return cls(float(np.nanmin(length)), float(np.nanmean(length)), float(np.nanmax(length)))


@dataclass(frozen=True)
class DisplacementField:
    """Displacement of wall points in the picture by a motion; nan outside the picture."""

    wall_mm: Grid
    """(axial, arc) on the developed wall."""
    exact_px: Grid
    """Displacement by the whole motion, +u right, +v down."""
    derivative_px: Grid
    """The paper's total derivative times the motion: the limit of the exact one for small
    motions."""


@dataclass(frozen=True)
class Advice:
    """Expected performance of a rig; lengths are mm on the wall."""

    move: Pose
    """Motion between two frames."""
    frame_rate_hz: float
    raw_px: Spread
    """Displacement in px over the raw picture."""
    developed_mm: Spread
    """Displacement over the measured part of the developed wall.

    It is uneven for a motion across the pipe, which is no shift of a round wall; the odometry
    models that motion exactly."""
    developed_drive_mm: Spread
    """The same for the part of the motion along the pipe."""
    finest_mm_per_px: float
    coarsest_mm_per_px: float
    """Along rows or columns of the picture, whichever is coarser."""
    measured_mm_per_px: float
    """Resolution of the patch, as the frame is reduced before motion is measured."""
    measured_share: float
    """Share of the picture that shows the wall finely enough to measure on, see
    `rectify.COARSEST`."""
    axial_mm: tuple[float, float]
    """Wall in the picture along the pipe, from the camera, forward positive."""
    arc_mm: tuple[float, float]
    """Wall in the picture around the pipe, from the invert, right positive."""
    measured_axial_mm: float
    measured_arc_mm: float
    """Sides of the measured part of the developed wall."""
    overlap: float
    """Share of the measured wall that is still seen after `move`."""
    good_speed_mm_s: float
    """Speed up to which consecutive frames overlap by `GOOD_OVERLAP`."""
    speed_limit_mm_s: float
    """Speed beyond which consecutive frames share too little wall to measure motion."""
    height_error_percent: float
    """Error of the measured distance if the camera stands 1 mm higher than the rig states."""
    findings: tuple[Finding, ...]

    @property
    def is_even(self) -> bool:
        """Whether one shift describes the raw picture, as the paper's method needs."""
        return self.raw_px.relative <= EVEN_ENOUGH

    @property
    def verdict(self) -> Verdict:
        """The worst verdict of the findings; fit if there are none."""
        found = [finding.verdict for finding in self.findings]
        return max(found, key=list(Verdict).index, default=Verdict.FIT)


def displacement_px(rig: Rig, wall_xyz: Points, move: Pose) -> Points:
    """Displacement in the picture of (N, 3) world points when the camera moves from zero to `move`.

    The content moves opposite to the robot.  For a pinhole camera that looks down and a motion
    within its plane this is -(fx dX + skew dY) / Z and -fy dY / Z: it falls with the depth Z.
    """
    return _project(rig, wall_xyz, move) - _project(rig, wall_xyz, NOMINAL)


def total_derivative_px(rig: Rig, wall_xyz: Points, move: Pose) -> Points:
    """The paper's total derivative of the pixels of (N, 3) world points, times the motion.

    du = (du/dX) dX + (du/dY) dY + (du/dyaw) dyaw at the zero, for any lens, by central difference.
    """
    small = 1e-4  # truncation and rounding are both below 1e-7 of the result
    step = Pose(small * move.x_mm, small * move.y_mm, small * move.yaw_rad)
    back = Pose(-step.x_mm, -step.y_mm, -step.yaw_rad)
    return (_project(rig, wall_xyz, step) - _project(rig, wall_xyz, back)) / (2 * small)


def developed_displacement_mm(rig: Rig, wall_xyz: Points, move: Pose) -> Points:
    """Displacement (axial, arc) of (N, 3) world points on the developed wall, see `rectify`."""
    before, after = (
        develop(rig, cast(rig, NOMINAL, sight(rig, pose, wall_xyz))) for pose in (NOMINAL, move)
    )
    moved = after - before
    if rig.pipe.radius_mm is not None:  # across the crown take the shorter way around
        turn = 2 * np.pi * rig.pipe.radius_mm
        moved[:, 1] -= turn * np.rint(moved[:, 1] / turn)
    return np.asarray(moved)


def displacement_field(
    rig: Rig, move: Pose, shape: tuple[int, int] = (25, 33)
) -> DisplacementField:
    """Compute the displacement on (rows around, columns along) even points of the measured wall.

    Points outside the picture are nan.

    Raises:
        InvalidRig: The camera sees no wall.
    """
    _seen_wall(rig, _pixel_grid(rig.camera))
    patch = Rectifier(rig).grid
    last = np.array(patch.shape[::-1], np.float64) - 1
    x, y = (np.linspace(0, end, count) for end, count in zip(last, shape[::-1], strict=True))
    wall_mm = patch.to_mm(np.stack(np.meshgrid(x, y), -1).reshape(-1, 2))
    wall = enclose(rig, wall_mm)
    uv = _project(rig, wall, NOMINAL)
    with np.errstate(invalid="ignore"):
        # The border of the patch lies on the border of the picture, up to rounding.
        seen = ((uv >= -1) & (uv <= (rig.camera.width, rig.camera.height))).all(axis=1)
    wall[~seen] = np.nan
    return DisplacementField(
        wall_mm=wall_mm.reshape(*shape, 2),
        exact_px=displacement_px(rig, wall, move).reshape(*shape, 2),
        derivative_px=total_derivative_px(rig, wall, move).reshape(*shape, 2),
    )


def advise(rig: Rig, move: Pose, frame_rate_hz: float = 30.0) -> Advice:
    """Predict the performance of a rig, and whether it is fit for the method.

    Args:
        rig: The camera in its pipe.
        move: Motion between two frames, not zero.
        frame_rate_hz: Frame rate, from which the speeds follow.
    Raises:
        InvalidRig: The camera sees no wall.
    """
    pixels = _pixel_grid(rig.camera)
    seen = _seen_wall(rig, pixels)
    seen_mm = develop(rig, seen)
    rectifier = Rectifier(rig)
    patch = rectifier.grid
    patch_rows, patch_columns = np.nonzero(rectifier.valid)
    patch_px = np.column_stack([patch_columns, patch_rows]).astype(np.float64)
    measured = enclose(rig, patch.to_mm(patch_px))
    rows, columns = (np.ptp(side) + 1 for side in (patch_rows, patch_columns))
    resolution = _mm_per_px(rig, pixels)
    finest = float(np.nanmin(resolution))
    good_mm, limit_mm = (
        _longest_shift_px(rectifier.valid, share) * patch.mm_per_px
        for share in (GOOD_OVERLAP, LEAST_OVERLAP)
    )
    advice = Advice(
        move=move,
        frame_rate_hz=frame_rate_hz,
        raw_px=Spread.of(displacement_px(rig, seen, move)),
        developed_mm=Spread.of(developed_displacement_mm(rig, measured, move)),
        developed_drive_mm=Spread.of(developed_displacement_mm(rig, measured, Pose(move.x_mm))),
        finest_mm_per_px=finest,
        coarsest_mm_per_px=float(np.nanmax(resolution)),
        measured_mm_per_px=patch.mm_per_px,
        measured_share=float(np.mean(resolution <= COARSEST * finest)),  # nan is not
        axial_mm=_extent(seen_mm[:, 0]),
        arc_mm=_extent(seen_mm[:, 1]),
        measured_axial_mm=float(columns * patch.mm_per_px),
        measured_arc_mm=float(rows * patch.mm_per_px),
        overlap=_overlap(
            rectifier.valid,
            round(abs(move.x_mm) / patch.mm_per_px),
            round(abs(move.y_mm) / patch.mm_per_px),
        ),
        good_speed_mm_s=good_mm * frame_rate_hz,
        speed_limit_mm_s=limit_mm * frame_rate_hz,
        height_error_percent=_height_error_percent(rig, measured),
        findings=(),
    )
    return replace(advice, findings=_findings(rig, advice))


def _findings(rig: Rig, advice: Advice) -> tuple[Finding, ...]:
    """Collect what speaks against the rig, with what to change."""
    care, unfit = Verdict.CARE, Verdict.UNFIT
    found: list[tuple[str, bool, Verdict, str]] = [
        (
            "forward",
            rig.mount.view == "forward",
            care,
            "The camera looks forward along the pipe, which has been tried on rendered pipes only: "
            "check the distance against a known length.",
        ),
        (
            "fast",
            advice.overlap < LEAST_OVERLAP,
            unfit,
            f"After this motion only {advice.overlap:.0%} of the wall is still seen: drive at most "
            f"{advice.good_speed_mm_s:.0f} mm/s at {advice.frame_rate_hz:g} frames/s, or take a "
            "wider lens or more frames.",
        ),
        (
            "hurried",
            LEAST_OVERLAP <= advice.overlap < GOOD_OVERLAP,
            care,
            f"After this motion {advice.overlap:.0%} of the wall is still seen: "
            f"{GOOD_OVERLAP:.0%} are good, which is {advice.good_speed_mm_s:.0f} mm/s at "
            f"{advice.frame_rate_hz:g} frames/s.",
        ),
        (
            "near",
            abs(advice.height_error_percent) > HEIGHT_ERROR_PERCENT,
            care,
            f"1 mm of wrong height is {abs(advice.height_error_percent):.1f} % of distance: mount "
            "the camera higher, or set the scale by a length that was measured with a tape.",
        ),
        (
            "coarse",
            advice.measured_mm_per_px > COARSE_MM_PER_PX,
            care,
            f"A pixel of the measured picture is {advice.measured_mm_per_px:.1f} mm of wall, too "
            "coarse for the grain of concrete: mount the camera lower or take a longer lens.",
        ),
        (
            "oblique",
            advice.measured_share < LEAST_SHARE,
            care,
            f"Only {advice.measured_share:.0%} of the picture show the wall well enough to be "
            "measured on: take a longer lens or turn the camera to the invert.",
        ),
        (
            "corrugated",
            rig.pipe.corrugation is not None,
            care,
            "The wall is corrugated, and half of an error of its stated depth adds to the distance "
            "from the camera to the wall: check the distance against a known length.",
        ),
    ]
    return tuple(
        Finding(name, verdict, sentence) for name, holds, verdict, sentence in found if holds
    )


def _pixel_grid(camera: Camera) -> Points:
    """Pixels spread evenly over the picture, from border to border."""
    u = np.linspace(0, camera.width - 1, 33)
    v = np.linspace(0, camera.height - 1, 25)
    return np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)


def _seen_wall(rig: Rig, pixels_uv: Points) -> Points:
    wall = cast(rig, NOMINAL, robot_rays(rig, pixels_uv))
    if not np.isfinite(wall).all(axis=1).any():
        raise no_wall_in_view(rig)
    return wall


def _project(rig: Rig, wall_xyz: Points, pose: Pose) -> Points:
    return robot_pixels(rig, sight(rig, pose, wall_xyz))


def _mm_per_px(rig: Rig, pixels_uv: Points) -> NDArray[np.float64]:
    """(N,) mm of wall per pixel, along the row or the column, whichever is larger."""

    def wall(offset: tuple[float, float]) -> Points:
        return cast(rig, NOMINAL, robot_rays(rig, pixels_uv + np.array(offset)))

    along_row = np.linalg.norm(wall((0.5, 0)) - wall((-0.5, 0)), axis=1)
    along_column = np.linalg.norm(wall((0, 0.5)) - wall((0, -0.5)), axis=1)
    return np.asarray(np.maximum(along_row, along_column))


def _extent(coordinate: NDArray[np.float64]) -> tuple[float, float]:
    return float(np.nanmin(coordinate)), float(np.nanmax(coordinate))


def _overlap(valid: ByteImage, columns: int, rows: int) -> float:
    """Share of the patch that stays in view when the content moves by whole pixels."""
    height, width = valid.shape
    common = valid[rows:, columns:] & valid[: max(0, height - rows), : max(0, width - columns)]
    return float(common.sum() / valid.sum())


def _longest_shift_px(valid: ByteImage, share: float) -> int:
    """Longest axial motion that keeps at least this share of the patch in view."""
    shifts = range(valid.shape[1])
    return next((k - 1 for k in shifts if _overlap(valid, k, 0) < share), shifts.stop - 1)


def _height_error_percent(rig: Rig, measured_xyz: Points) -> float:
    """Error of the distance, in percent, per mm by which the camera is higher than the rig states.

    A true camera that is slightly higher moves, and its rays are projected by the stated rig.
    """
    rise_mm, move = 0.01, Pose(x_mm=1.0)  # small against any height; the error is linear in it
    mount = rig.mount.model_copy(update={"height_mm": rig.mount.height_mm + rise_mm})
    true_rig = rig.model_copy(update={"mount": mount})
    true_wall = cast(true_rig, NOMINAL, sight(rig, NOMINAL, measured_xyz))
    appears = develop(rig, cast(rig, NOMINAL, sight(true_rig, move, true_wall)))
    was = develop(rig, measured_xyz)
    distance_mm = -float(np.nanmean((appears - was)[:, 0]))
    return 100 * (distance_mm / move.x_mm - 1) / rise_mm
