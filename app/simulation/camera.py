"""From pixels to points on the wall, exactly: the geometry of the renderer.

Nothing of `vo_core` but the rig's numbers is used here, so that the odometry is measured against
a truth that it had no part in.

Frames: camera x to the right of the picture, y down, z along the optical axis; robot x forward,
y right, z down; world X along the pipe, Y right, Z down, with the pipe's axis (for a floor: the
camera's height) at Y = Z = 0.  All rotations are right-handed:

    d_robot = R_y(pitch) R_x(roll) R_view R_z(rotation) d_camera,    d_world = R_z(yaw) d_robot

so that pitch > 0 lifts the nose, roll > 0 lowers the right side and yaw > 0 turns to the right.
R_view is the identity for `down`; for `forward` it takes the optical axis to robot x, the
picture's right to robot y and its lower edge to robot z.
"""

from __future__ import annotations

from math import cos, radians, sin

import cv2
import numpy as np
from numpy.typing import NDArray

from app.simulation.motion import Pose
from vo_core.rig import Camera, Mount, Rig

FloatImage = NDArray[np.float32]
_Doubles = NDArray[np.float64]

REACH_MM = 1000.0
"""Nothing farther along the pipe than this is drawn."""


def camera_rays(camera: Camera) -> _Doubles:
    """Directions of all pixels in the camera frame, (H, W, 3), of length 1."""
    u, v = np.meshgrid(np.arange(camera.width, dtype=float), np.arange(camera.height, dtype=float))
    # OpenCV knows no skew: u = fx x + skew y + cx is undone here, for its distorted x and y.
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
    """Rays of r = theta (1 + k1 theta^2 + ... + k4 theta^8), also beyond 90 degrees.

    `cv2.fisheye.undistortPoints` answers in tangents, which end at 90 degrees.
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
    """R_robot_camera of the module's docstring, (3, 3)."""
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
    """Casts the rays of one rig onto its wall."""

    def __init__(self, rig: Rig) -> None:
        rays = camera_rays(rig.camera) @ mount_rotation(rig.mount).T
        self._x, self._y, self._z = (
            np.ascontiguousarray(rays[..., axis], dtype=np.float32) for axis in range(3)
        )
        self._mount = rig.mount
        diameter_mm = rig.pipe.diameter_mm
        self.radius_mm = None if diameter_mm is None else diameter_mm / 2

    def cast(self, pose: Pose) -> tuple[FloatImage, FloatImage, FloatImage]:
        """Wall points of all pixels for a camera at `pose`.

        Returns:
            ahead_mm: Axial distance from the camera, within +-`REACH_MM`, (H, W).
            arc_mm: Along the wall from the invert, to the right positive; on a floor, Y.
            range_mm: From the camera to the wall; far beyond `REACH_MM` where no wall is seen.
        """
        sine, cosine = np.float32(sin(pose.yaw_rad)), np.float32(cos(pose.yaw_rad))
        dx = cosine * self._x - sine * self._y
        dy = sine * self._x + cosine * self._y
        y0 = np.float32(self._mount.lateral_mm + pose.y_mm)
        if self.radius_mm is None:
            down = np.maximum(self._z, np.float32(1e-6))
            t = np.asarray(np.float32(self._mount.height_mm) / down, np.float32)
            arc = np.asarray((y0 + t * dy).clip(-REACH_MM, REACH_MM), np.float32)
        else:
            z0 = np.float32(self.radius_mm - self._mount.height_mm)
            t = self._range_in_cylinder(dy, y0, z0, np.float32(self.radius_mm))
            arc = np.arctan2(y0 + t * dy, z0 + t * self._z)
            arc *= np.float32(self.radius_mm)
        ahead = np.asarray((t * dx).clip(-REACH_MM, REACH_MM), np.float32)
        return ahead, arc, t

    def _range_in_cylinder(
        self, dy: FloatImage, y0: np.float32, z0: np.float32, radius: np.float32
    ) -> FloatImage:
        """The t > 0 of |(y0, z0) + t (dy, dz)| = R for a camera inside."""
        a = dy * dy
        a += self._z * self._z
        np.maximum(a, np.float32(1e-9), out=a)
        b = y0 * dy
        b += z0 * self._z
        t = b * b
        t -= a * (y0 * y0 + z0 * z0 - radius * radius)
        np.sqrt(t, out=t)
        t -= b
        t /= a
        return t
