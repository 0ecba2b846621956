"""The exact motion model: how the developed wall moves in a patch when the robot moves.

A patch is rectified as if the camera stood at its vantage: centred, straight and at the stated
height, unless it looks along the pipe. If it stands otherwise, driving on shears and bends the
patch (by dx y / (R h) for y mm beside the axis of a cylinder), and a rigid fit would read half of
the shear as rotation. So the model is not rigid: it casts each point of the patch along its ray
from the reference pose to the wall, and projects the wall point back into the patch of the moving
camera.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from vo_core.geometry.rectify import PatchGrid
from vo_core.geometry.shutter import Exposure
from vo_core.geometry.wall import (
    NOMINAL,
    Points,
    Pose,
    Poses,
    camera_position,
    develop,
    enclose,
    outward,
    reach,
    rotation,
    sight,
    turned,
)
from vo_core.rig import Rig
from vo_core.types import Matrix

POSE = 6
"""Number of parameters of a pose."""

MOVING, REFERENCE = slice(0, POSE), slice(POSE, 2 * POSE)
MOUNT = slice(2 * POSE, 2 * POSE + 2)
"""Pitch and roll of the mount beyond the rig's, the same in both pictures."""

PARAMETERS = 2 * POSE + 2

OF_MOVING, OF_REFERENCE = (
    [*range(PARAMETERS)[pose], *range(PARAMETERS)[MOUNT]] for pose in (MOVING, REFERENCE)
)
"""Places of the state, which is pose and mount, of the moving camera and of the reference."""

RATES = 3
"""Number of rates, those of x, y and yaw, that a rolling shutter needs."""


class WallMotion:
    """The motion model at fixed points of the patch; their rays are computed once.

    q = (moving pose, reference pose, pitch and roll of the mount) in mm and rad, (14,).
    """

    def __init__(
        self,
        rig: Rig,
        grid: PatchGrid,
        points_px: Points,
        *,
        before: Pose = NOMINAL,
        now: Pose = NOMINAL,
    ) -> None:
        """`before` and `now` are the vantages (see `Rectifier`) of the two patches."""
        self._rig, self.grid = rig, grid
        self._turn_now, self._at_now = rotation(now), self._at(now)
        self.places_mm = grid.to_mm(points_px)
        self._rays = np.ascontiguousarray(sight(rig, before, enclose(rig, self.places_mm)).T)
        turn_rad = 2 / max(grid.shape)
        tilt_rad = grid.mm_per_px / rig.mount.height_mm
        pose = [grid.mm_per_px, grid.mm_per_px, turn_rad, turn_rad * rig.mount.height_mm]
        pose += [tilt_rad, tilt_rad]
        self.scales = np.array([*pose, *pose, tilt_rad, tilt_rad])
        """Steps of q that move the content at the border of the patch by about a pixel."""

    @cached_property
    def exposure(self) -> Exposure:
        """Exposure times of the points, for a rolling shutter."""
        return Exposure.of(self._rig, self.places_mm)

    def positions(self, q: Matrix) -> Points:
        """w(q): where the points of a reference's patch lie in the moving camera's patch, px."""
        moving, reference = poses(q)
        return self.grid.to_px(self.appears(reference, moving))

    def appears(self, reference: Pose | Poses, moving: Pose | Poses) -> Points:
        """(N, 2) where the moving camera sees the points of the reference, (axial, arc) mm."""
        before, at = (self._at(pose) for pose in (reference, moving))
        with np.errstate(invalid="ignore", divide="ignore"):
            arm = self._to_wall(before, turned(rotation(reference), self._rays)) + (before - at)
            seen = self._turn_now @ turned(rotation(moving).swapaxes(0, 1), arm)
            appears = self._to_wall(self._at_now, seen) + self._at_now
        return develop(self._rig, appears.T)

    def linearise(self, q: Matrix) -> tuple[Points, Matrix]:
        """w(q) and dw/dq at the points, (N, 2) and (14, 2, N), of a global shutter.

        A change of the reference pose moves the wall point W = o + v along the wall.  A change of
        the moving pose moves the ray d = R' (W - o) to W, and the patch shows d as a camera at its
        vantage sees it.  Wall points stay on the wall, so of a change u only the part
        (I - r n' / n'r) u counts, with the ray r and the normal n.
        """
        moving, reference = poses(q)
        before, at = (self._at(pose) for pose in (reference, moving))
        turn = rotation(moving)
        to_now = self._turn_now @ turn.T
        with np.errstate(invalid="ignore", divide="ignore"):
            arm_before = self._to_wall(before, rotation(reference) @ self._rays)
            arm = arm_before + (before - at)
            seen = to_now @ arm
            away = self._to_wall(self._at_now, seen)
            appears = away + self._at_now
            by_ray = self._by_ray(seen, away, outward(self._rig, appears))
            by_wall = _times(to_now.T, by_ray)
            normal = outward(self._rig, arm_before + before)
            lean = (by_wall * arm_before[:, None]).sum(0) / (normal * arm_before[1:]).sum(0)
        by_shift = by_wall.copy()
        by_shift[1:] -= normal[:, None] * lean
        slopes = np.empty((PARAMETERS, *by_wall.shape[1:]))
        slopes[MOVING] = -_by_pose(by_wall, moving, arm)
        slopes[REFERENCE] = _by_pose(by_shift, reference, arm_before)
        slopes[MOUNT] = slopes[MOVING][4:] + slopes[REFERENCE][4:]
        return self.grid.to_px(develop(self._rig, appears.T)), slopes

    def _at(self, pose: Pose | Poses) -> Matrix:
        """(3, 1) or (3, N) positions of the camera in the world."""
        return camera_position(self._rig, pose).reshape(3, -1)

    def _to_wall(self, at: Matrix, rays: Matrix) -> Matrix:
        """(3, N) the same rays, (3, N), as long as from the origin `at` to the wall."""
        return reach(self._rig, at, rays) * rays

    def _by_ray(self, seen: Matrix, away: Matrix, normal: Matrix) -> Matrix:
        """(3, 2, N) d(axial, arc)/d(ray) of rays (3, N) that are `away` long at the wall, in px.

        A ray turned by u meets the wall at P + t (I - r n' / n'r) u.  The arc runs along (nz, -ny).
        """
        (ahead, right, down), (ny, nz) = seen, normal
        scale = np.sqrt((away * away).sum(0) / (seen * seen).sum(0)) / self.grid.mm_per_px
        by_ray = np.zeros((3, 2, seen.shape[1]))
        by_ray[0, 0], by_ray[1, 1], by_ray[2, 1] = scale, scale * nz, -scale * ny
        lean = np.stack([ahead, right * nz - down * ny]) * (scale / (right * ny + down * nz))
        by_ray[1:] -= normal[:, None] * lean
        return by_ray


class RollingMotion:
    """The motion model of a rolling shutter: each point has the poses of the rows that show it.

    q = (q of `WallMotion`, rate, rate of the reference), (20,), with the rates of x, y and yaw in
    mm/s and rad/s.  As the rows differ in time, rates shear or stretch the picture.
    """

    def __init__(self, motion: WallMotion) -> None:
        self._motion = motion

    def positions(self, q: Matrix) -> Points:
        """w(q), (N, 2) px."""
        return self._appears(q)[0]

    def linearise(self, q: Matrix) -> tuple[Points, Matrix]:
        """w(q) and dw/dq; slopes by the poses are those of a global shutter, near enough."""
        positions, offset_s = self._appears(q)
        by_pose = self._motion.linearise(q[:PARAMETERS])[1]
        by_rate = by_pose[:RATES] * offset_s
        before = by_pose[POSE : POSE + RATES] * self._motion.exposure.offset_s
        return positions, np.concatenate([by_pose, by_rate, before])

    def _appears(self, q: Matrix) -> tuple[Points, Matrix]:
        """w(q), and the exposure time of each point in the moving picture, s from its own time."""
        motion, (rate, before) = self._motion, q[PARAMETERS:].reshape(2, RATES)
        moving, reference = poses(q)
        then = _along(reference, before, motion.exposure.offset_s)
        moved_mm = motion.appears(then, moving) - motion.places_mm
        offset_s = motion.exposure.of_moved(moved_mm, -rate[:2])
        now = _along(moving, rate, offset_s)
        return motion.grid.to_px(motion.appears(then, now)), offset_s


class CodedMotion:
    """A motion model plus displacements that are no motion, the last elements of q.

    They are those by video coding, and those by the relief of a corrugated wall (`relief_modes`).
    A coder predicts the motion of a block from the blocks before it, and keeps a prediction that is
    nearly right.  The wall moves faster at the borders of the picture than in its middle, so blocks
    move too fast from the upper border on and too slowly below the middle: by 0.12 px of the patch
    on either side, measured on H.264 at crf 30. Driving beside the axis looks the same: without the
    shear two pictures 10 mm apart would place the camera 7 mm aside, with a small uncertainty.
    """

    def __init__(self, motion: WallMotion | RollingMotion, modes: Matrix) -> None:
        """`modes` is (k, 2, N): displacements by each parameter, px of the patch."""
        self._motion, self._modes = motion, modes
        self.scales = 1 / np.abs(modes).max((1, 2))
        """(k,) parameters that move the content by a pixel where it moves most."""

    def positions(self, q: Matrix) -> Points:
        """w(q), (N, 2) px."""
        own, coding = self._split(q)
        return self._motion.positions(own) + self._displacements(coding)

    def linearise(self, q: Matrix) -> tuple[Points, Matrix]:
        """w(q) and dw/dq."""
        own, coding = self._split(q)
        positions, slopes = self._motion.linearise(own)
        return positions + self._displacements(coding), np.concatenate([slopes, self._modes])

    def _split(self, q: Matrix) -> tuple[Matrix, Matrix]:
        count = len(self._modes)
        return q[:-count], q[-count:]

    def _displacements(self, coding: Matrix) -> Points:
        return np.asarray(np.tensordot(coding, self._modes, 1).T)


def shear_mode(points_px: Points) -> Matrix:
    """(1, 2, N) the displacement by a shear of 1 rad about the middle of the patch."""
    return _lengthwise(points_px[:, 1:] - points_px[:, 1].mean())


def ring_modes(rig: Rig, grid: PatchGrid, points_px: Points) -> Matrix:
    """(8, 2, N) displacements that look like a camera beside the axis, or turned against it.

    They are the sine and the cosine around the ring, evenly along the pipe and growing from -1 at
    the near end of the patch to 1 at its far end; 1 px along the pipe, then 0.8 px around it, as
    coders err most where the wall moves most.
    """
    phi = grid.to_mm(points_px)[:, 1] / (rig.pipe.radius_mm or np.inf)
    along = 2 * points_px[:, 0] / (grid.shape[1] - 1) - 1
    around = np.stack([np.sin(phi), np.cos(phi)], 1)
    modes = _lengthwise(np.concatenate([around, along[:, None] * around], 1))
    return np.concatenate([modes, 0.8 * modes[:, ::-1]])


def _lengthwise(modes: Matrix) -> Matrix:
    """(k, 2, N) displacements along the pipe, from (N, k)."""
    return np.stack([modes.T, np.zeros_like(modes.T)], 1)


def relief_modes(rig: Rig, points_mm: Points) -> Matrix:
    """(4, 2, N) displacements by the waves of a corrugated wall, in ways; none if it is smooth.

    Points are (axial, arc).  Nobody knows where in the picture the crests lie, so the modes are
    the cosine and the sine along the pipe, as large as the relief makes them: a wall that is by d
    farther than the mean one at the distance h moves less by the share d / h of the way.  Seen
    obliquely it also appears nearer along the pipe, by d x / h at the place x, which bends a wave
    d = a cos(k x): to first order it adds a wave of half the length and of a k x / 2 h its height.
    """
    waves, across_mm = rig.pipe.corrugation, rig.mount.height_mm
    if waves is None:
        return np.zeros((0, 2, len(points_mm)))
    if rig.looks_along_pipe and rig.pipe.radius_mm is not None:
        across_mm = rig.pipe.radius_mm
    along_mm, per_mm, height = points_mm[:, 0], 2 * np.pi / waves.pitch_mm, waves.depth_mm / 2
    bend = height * per_mm * along_mm / (2 * across_mm)
    plain, bent = (np.exp(1j * n * per_mm * along_mm) for n in (1, 2))
    bent *= bend
    waves_px = np.stack([plain.real, plain.imag, bent.real, bent.imag], 1)
    return _lengthwise(height / across_mm * waves_px)


def parameters(moving: Pose, reference: Pose, mount_rad: Matrix) -> Matrix:
    """Join poses and mount to the q of `WallMotion`; `mount_rad` is (2,), pitch and roll."""
    return np.concatenate([moving.vector, reference.vector, mount_rad])


def poses(q: Matrix) -> tuple[Pose, Pose]:
    """Split q into the moving and the reference pose, each with the tilt of the mount."""
    tilt = np.array([0.0, 0.0, 0.0, 0.0, *q[MOUNT]])
    return Pose.of(q[MOVING] + tilt), Pose.of(q[REFERENCE] + tilt)


def _along(pose: Pose, rate: Matrix, offset_s: Matrix) -> Poses:
    """The pose at the times `offset_s`, (N,) each."""
    x, y, yaw = pose.vector[:RATES, None] + rate[:, None] * offset_s
    still = np.zeros_like(offset_s)
    return Poses(x, y, yaw, pose.z_mm + still, pose.pitch_rad + still, pose.roll_rad + still)


def _times(matrix: Matrix, rows: Matrix) -> Matrix:
    """Products of a matrix (3, 3) and vectors (3, ...), in one product."""
    return np.asarray((matrix @ rows.reshape(3, -1)).reshape(rows.shape))


def _by_pose(rows: Matrix, pose: Pose, arm: Matrix) -> Matrix:
    """(6, 2, N) slopes of rows (3, 2, N) by a shift of the origin and by its turns on an arm.

    Turns are about the world's z (yaw), the yawed y (pitch) and the robot's x (roll).  A turn w
    moves the end of the arm, (3, N), by w x arm, and a . (w x arm) = w . (arm x a).
    """
    x, y, z = rows
    ahead, right, down = arm
    # Written out: `np.cross` takes as long as all the rest.
    moments = np.stack([right * z - down * y, down * x - ahead * z, ahead * y - right * x])
    cos, sin = np.cos(pose.yaw_rad), np.sin(pose.yaw_rad)
    turns = np.array([[0.0, 0.0, 1.0], [-sin, cos, 0.0], rotation(pose)[:, 0]])
    slopes = np.empty((POSE, *rows.shape[1:]))
    slopes[[0, 1, 3]], slopes[[2, 4, 5]] = rows, _times(turns, moments)
    return slopes


def moved_by_content(pose: Pose, shift_mm: tuple[float, float], reference_yaw_rad: float) -> Pose:
    """Correct a pose whose content appears `shift_mm` (axial, arc) off the expected place.

    Content moves opposite to the camera, in the axes of the reference: d = -R(yaw_reference) s.
    """
    cos, sin = np.cos(reference_yaw_rad), np.sin(reference_yaw_rad)
    axial, arc = shift_mm
    return replace(
        pose,
        x_mm=pose.x_mm - (cos * axial - sin * arc),
        y_mm=pose.y_mm - (sin * axial + cos * arc),
    )
