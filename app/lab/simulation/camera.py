"""The exact geometry of the renderer, from pixels to points on the wall.

This module uses the classes of rigs and poses of `vo_core` but none of its functions, so that the
odometry is measured against an independent truth.

Frames: camera x to the right of the picture, y down, z along the optical axis; robot x forward,
y right, z down; world X along the pipe, Y right, Z down, with the pipe's axis (for a floor: the
camera's nominal height) at Y = Z = 0.  All rotations are right-handed, pitch and roll are the
mount's in the first line and the robot's in the second:

    d_robot = R_y(pitch) R_x(roll) R_view R_z(rotation) d_camera
    d_world = R_z(yaw) R_y(pitch) R_x(roll) d_robot

so that pitch > 0 lifts the nose, roll > 0 lowers the right side and yaw > 0 turns to the right.
R_view is the identity for `down`; for `forward` it takes the optical axis to robot x, the
picture's right to robot y and its lower edge to robot z.
"""

from __future__ import annotations

from math import cos, radians, sin

import cv2
import numpy as np
from numpy.typing import NDArray

from app.lab.simulation.relief import range_to_relief
from app.lab.simulation.scenario import NO_SILT, Silt
from vo_core.geometry.wall import Pose
from vo_core.rig import Camera, Mount, Rig

FloatImage = NDArray[np.float32]
_Doubles = NDArray[np.float64]

REACH_MM = 1000.0
"""Farthest axial distance from the camera that is drawn."""


def camera_rays(camera: Camera) -> _Doubles:
    """Directions of all pixels in the camera frame, (H, W, 3), of length 1."""
    u, v = np.meshgrid(np.arange(camera.width, dtype=float), np.arange(camera.height, dtype=float))
    # OpenCV has no skew: u = fx x + skew y + cx is inverted here, for its distorted x and y.
    y = (v - camera.cy) / camera.fy
    x = (u - camera.cx - camera.skew * y) / camera.fx
    if camera.model == "fisheye":
        return _fisheye_rays(x, y, camera.distortion)
    if camera.distortion:
        until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-12)
        points = np.stack([x, y], axis=-1).reshape(-1, 1, 2)
        ideal = cv2.undistortPoints(
            points, np.eye(3), np.asarray(camera.distortion), criteria=until
        )
        x, y = np.moveaxis(ideal.reshape(*x.shape, 2), -1, 0)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    return rays


def _fisheye_rays(x: _Doubles, y: _Doubles, distortion: list[float]) -> _Doubles:
    """Rays of r = theta (1 + k1 theta^2 + ... + k4 theta^8), even beyond 90 degrees.

    `cv2.fisheye.undistortPoints` returns tangents, which end at 90 degrees.
    """
    r = np.hypot(x, y)
    k = np.array([1.0, *distortion])
    powers = 2 * np.arange(len(k))
    theta = r.copy()
    for _ in range(20):  # Newton; four to six steps are enough for common lenses
        terms = k * theta[..., None] ** powers
        theta -= (theta * terms.sum(-1) - r) / (terms * (powers + 1)).sum(-1)
    scale = np.sinc(theta / np.pi) * theta / np.where(r > 0, r, 1)  # sin(theta) / r
    return np.stack([x * scale, y * scale, np.cos(theta)], axis=-1)


def mount_rotation(mount: Mount) -> _Doubles:
    """(3, 3) R_robot_camera of the module's docstring."""
    down = np.eye(3)
    forward = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    rotation, pitch, roll = (
        radians(angle) for angle in (mount.rotation_deg, mount.pitch_deg, mount.roll_deg)
    )
    turn_z = np.array(
        [[cos(rotation), -sin(rotation), 0], [sin(rotation), cos(rotation), 0], [0, 0, 1]]
    )
    turn_y = np.array([[cos(pitch), 0, sin(pitch)], [0, 1, 0], [-sin(pitch), 0, cos(pitch)]])
    turn_x = np.array([[1, 0, 0], [0, cos(roll), -sin(roll)], [0, sin(roll), cos(roll)]])
    view = down if mount.view == "down" else forward
    return np.asarray(turn_y @ turn_x @ view @ turn_z)


class WallCaster:
    """Casts the rays of one rig onto its wall, onto silt in it."""

    def __init__(self, rig: Rig, silt: Silt = NO_SILT) -> None:
        rays = camera_rays(rig.camera) @ mount_rotation(rig.mount).T
        self._rays = tuple(
            np.ascontiguousarray(rays[..., axis], dtype=np.float32) for axis in range(3)
        )
        self._mount = rig.mount
        self._silt = silt
        self._corrugation = rig.pipe.corrugation
        diameter_mm = rig.pipe.diameter_mm
        self.radius_mm = None if diameter_mm is None else diameter_mm / 2

    def cast(self, *poses: Pose) -> tuple[FloatImage, FloatImage, FloatImage]:
        """Cast all pixels to the wall, for a camera at one pose or at one pose for each row.

        Returns:
            ahead_mm: Axial distance from the camera, within +-`REACH_MM`, (H, W).
            arc_mm: Along the wall from the invert, to the right positive; on a floor and on silt,
                Y.
            range_mm: From the camera to the wall; far beyond `REACH_MM` where no wall is seen.
        """
        x_mm, y_mm, yaw_rad, z_mm, pitch_rad, roll_rad = np.array(
            [pose.vector for pose in poses]
        ).T[..., None]
        dx, dy, dz = self._in_the_pipe(yaw_rad, pitch_rad, roll_rad)
        y0 = np.float32(self._mount.lateral_mm + y_mm)
        if self.radius_mm is None:
            down = np.maximum(dz, np.float32(1e-6))
            t = np.asarray(np.float32(self._mount.height_mm - z_mm) / down, np.float32)
            arc = np.asarray((y0 + t * dy).clip(-REACH_MM, REACH_MM), np.float32)
        else:
            z0 = np.float32(self.radius_mm - self._mount.height_mm + z_mm)
            t = _range_in_cylinder(dy, dz, y0, z0, np.float32(self.radius_mm))
            if self._corrugation is not None:
                t = range_to_relief(
                    self._corrugation,
                    self.radius_mm,
                    t,
                    eye_mm=(x_mm, y0, z0),
                    towards=(dx, dy, dz),
                )
            arc = _arc_in_cylinder(y0 + t * dy, z0 + t * dz, np.float32(self.radius_mm))
            if self._silt.is_there:
                bed = self._range_to_silt(dx, dz, x_mm, z0)
                is_covered = (bed > 0) & (bed < t)
                t = np.where(is_covered, bed, t)
                arc = np.where(is_covered, y0 + t * dy, arc)
        ahead = np.asarray((t * dx).clip(-REACH_MM, REACH_MM), np.float32)
        return ahead, arc, t

    def _in_the_pipe(
        self, yaw_rad: _Doubles, pitch_rad: _Doubles, roll_rad: _Doubles
    ) -> tuple[FloatImage, FloatImage, FloatImage]:
        """Rotate the rays into the axes of the pipe; angles are (1, 1) or (H, 1)."""
        x, y, z = self._rays
        (cy, sy), (cp, sp), (cr, sr) = (
            (np.cos(angle), np.sin(angle)) for angle in (yaw_rad, pitch_rad, roll_rad)
        )
        rotation = (
            (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr),
        )
        dx, dy, dz = (
            np.float32(a) * x + np.float32(b) * y + np.float32(c) * z for a, b, c in rotation
        )
        return dx, dy, dz

    def _range_to_silt(
        self, dx: FloatImage, dz: FloatImage, x_mm: _Doubles, z0: np.float32
    ) -> FloatImage:
        """Solve z0 + t dz = R - depth(x + t dx), the bed of the silt, for t."""
        slope = np.float32(self._silt.slope)
        above_mm = np.float32(self.radius_mm or 0) - np.float32(self._silt.depth_mm(x_mm)) - z0
        down = dz + slope * dx
        return np.asarray(above_mm / np.where(np.abs(down) > 1e-6, down, 1e-6), np.float32)


def _arc_in_cylinder(y: FloatImage, z: FloatImage, radius: np.float32) -> FloatImage:
    """Arc from the invert to points of the wall, as exact as arctan2 in a third of its time.

    `cv2.phase` is right to 1e-4 rad: what it leaves is a small angle, whose sine is what remains of
    y in axes turned by the first one, over the radius.
    """
    angle = np.asarray(cv2.phase(z, y), np.float32)
    angle[angle > np.float32(np.pi)] -= np.float32(2 * np.pi)
    left = np.cos(angle)
    left *= y
    left -= np.sin(angle) * z
    angle *= radius
    angle += left
    return angle


def _range_in_cylinder(
    dy: FloatImage, dz: FloatImage, y0: np.float32, z0: np.float32, radius: np.float32
) -> FloatImage:
    """Solve |(y0, z0) + t (dy, dz)| = R for t > 0, for a camera inside."""
    a = dy * dy
    a += dz * dz
    np.maximum(a, np.float32(1e-9), out=a)
    b = y0 * dy
    b += z0 * dz
    t = b * b
    t -= a * (y0 * y0 + z0 * z0 - radius * radius)
    np.sqrt(t, out=t)
    t -= b
    t /= a
    return t
