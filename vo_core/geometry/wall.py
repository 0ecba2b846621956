"""Geometry between the camera and the wall: pixels, rays, wall points, the developed wall.

Frames.  Robot: x forward, y right, z down.  World: X along the pipe's axis from the zero point, Y
right, Z down, the axis of a circular pipe at Y = Z = 0, a flat floor at Z = 0.  With r the radius
at the invert (at the crests of a corrugated pipe) and h the height of the camera above it, the
camera stands at (x, lateral + y, r - h + z), or (x, lateral + y, z - h) above a floor, turned by
roll, then pitch, then yaw.

Developed wall: (axial mm, arc mm).  The angle phi of a wall point is 0 at the invert and rises to
the right, so that arc = R phi with the radius R of the wall, which is midway between the crests
and the valleys of a corrugated pipe; on a floor the arc is Y itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vo_core.rig import Camera, Mount, Rig
from vo_core.types import Matrix

Points = NDArray[np.float64]
"""(N, 2) or (N, 3) coordinates; nan where a ray meets nothing."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Pose of the camera: [X, Y, theta] of the paper, with the height and the tilt of soft wheels.

    The robot's axes are turned by R_z(yaw) R_y(pitch) R_x(roll), all right-handed.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    yaw_rad: float = 0.0
    """From x towards y."""
    z_mm: float = 0.0
    """Down, against the height that the rig states."""
    pitch_rad: float = 0.0
    """Nose up."""
    roll_rad: float = 0.0
    """Right side down."""

    @property
    def vector(self) -> Matrix:
        """(6,) x, y, yaw, z, pitch, roll in mm and rad; covariances keep the same order."""
        return np.array(_fields_of(self), np.float64)

    @classmethod
    def of(cls, vector: Matrix) -> Pose:
        """The pose of such a vector: the inverse of `vector`."""
        return cls(*vector.tolist())

    def shifted(self, x_mm: float, y_mm: float) -> Pose:
        """The same pose after a move of the zero point."""
        return replace(self, x_mm=self.x_mm + x_mm, y_mm=self.y_mm + y_mm)


_fields_of = attrgetter(*Pose.__match_args__)
"""The numbers of a pose in their order; `astuple` would copy each of them deeply."""


def apart_mm(one: Pose, other: Pose) -> float:
    """Distance between two poses in the plane of x and y."""
    return float(np.hypot(one.x_mm - other.x_mm, one.y_mm - other.y_mm))


@dataclass(frozen=True, slots=True)
class Poses:
    """Many poses at once: arrays that broadcast against the (..., N) rays cast from them."""

    x_mm: Matrix
    y_mm: Matrix
    yaw_rad: Matrix
    z_mm: Matrix
    pitch_rad: Matrix
    roll_rad: Matrix

    @classmethod
    def of(cls, poses: Sequence[Pose]) -> Poses:
        """Stack poses: arrays of (N,)."""
        return cls(*np.array([_fields_of(pose) for pose in poses]).reshape(-1, 6).T)


NOMINAL = Pose()
"""A camera that stands straight at the zero point, at the height that the rig states."""


@dataclass(frozen=True, slots=True)
class WallPoint:
    """The place on the wall that a pixel shows."""

    distance_mm: float
    """Axial coordinate of the wall point, not of the camera."""
    arc_mm: float
    """Along the developed wall from the invert to the right; on a floor the lateral coordinate."""
    clock_h: float | None
    """Clock position in (0, 12], 12 crown, 3 right, 6 invert; None on a floor."""


def wall_point(
    rig: Rig,
    pixel_uv: tuple[float, float],
    pose: Pose = NOMINAL,
) -> WallPoint | None:
    """Find the wall point that a pixel shows from a pose, by exact ray casting.

    Returns:
        None where the ray of the pixel meets no wall.
    """
    (point,) = wall_points(rig, [pixel_uv], pose)
    return point


def wall_points(rig: Rig, pixels_uv: ArrayLike, pose: Pose | Poses) -> list[WallPoint | None]:
    """Find the wall points of (N, 2) pixels, from one pose or each from its own.

    Returns:
        None where the ray of a pixel meets no wall.
    """
    points = cast(rig, pose, robot_rays(rig, pixels_uv))
    radius_mm = rig.pipe.radius_mm
    return [
        None
        if not math.isfinite(distance_mm + arc_mm)
        else WallPoint(
            distance_mm, arc_mm, None if radius_mm is None else clock_of(arc_mm / radius_mm)
        )
        for distance_mm, arc_mm in develop(rig, points).tolist()
    ]


def clock_of(phi_rad: float) -> float:
    """Clock position in (0, 12] of a wall angle: 6 at the invert, falling to 3 on the right."""
    return float(-np.mod(np.degrees(phi_rad) / 30 - 6, -12)) or 12.0


def pixel_rays(camera: Camera, pixels_uv: ArrayLike) -> Points:
    """Unit rays in camera axes (right, down, forward) of (N, 2) pixels; nan outside the lens."""
    uv = np.asarray(pixels_uv, np.float64).reshape(-1, 2)
    y = (uv[:, 1] - camera.cy) / camera.fy
    x = (uv[:, 0] - camera.cx - camera.skew * y) / camera.fx  # OpenCV ignores the skew of K
    if not any(camera.distortion) and camera.model == "pinhole":
        plane = np.stack([x, y], 1)
    else:
        plane = _undistort(camera, np.stack([x, y], 1))
    rays = np.concatenate([plane, np.ones((len(plane), 1))], 1)
    if camera.model == "fisheye":
        # _undistort gives the direction and the angle: tan() alone could not look sideways.
        theta = np.hypot(plane[:, 0], plane[:, 1])
        scale = np.divide(np.sin(theta), theta, out=np.ones_like(theta), where=theta > 1e-12)
        rays = np.column_stack([plane * scale[:, None], np.cos(theta)])
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def ray_pixels(camera: Camera, rays: Points) -> Points:
    """(N, 2) pixels that show rays given in camera axes; nan where the lens cannot see."""
    return np.stack(project(camera, *rays.T), 1)


def project(camera: Camera, x: Matrix, y: Matrix, z: Matrix) -> tuple[Matrix, Matrix]:
    """Columns and rows of the pixels that show rays (x, y, z) in camera axes, of any shape."""
    with np.errstate(invalid="ignore", divide="ignore"):
        if camera.model == "fisheye":
            beside = np.hypot(x, y)
            theta = np.arctan2(beside, z)
            k1, k2, k3, k4 = camera.distortion or (0.0, 0.0, 0.0, 0.0)
            t2 = theta * theta
            bent = theta * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
            scale = np.where(theta > 1e-12, bent / beside, 1 / z)
        else:
            scale = np.where(z > 1e-9, 1 / z, np.nan)
        x, y = x * scale, y * scale
        if camera.model == "pinhole" and any(camera.distortion):
            x, y = _distort(camera, x, y)
    return camera.fx * x + camera.skew * y + camera.cx, camera.fy * y + camera.cy


def _distort(camera: Camera, x: Matrix, y: Matrix) -> tuple[Matrix, Matrix]:
    """Distorted plane coordinates, by OpenCV's model; nan where the lens cannot see.

    `cv2.projectPoints` always computes derivatives too, which takes twenty times as long.
    """
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, *tilt_rad = [*camera.distortion, *[0.0] * 14][
        :14
    ]
    xy, r2 = 2 * x * y, x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    bent_x = x * radial + p1 * xy + p2 * (r2 + 2 * x * x) + r2 * (s1 + r2 * s2)
    bent_y = y * radial + p1 * (r2 + 2 * y * y) + p2 * xy + r2 * (s3 + r2 * s4)
    if any(tilt_rad):
        bent_x, bent_y = _on_tilted_sensor(tilt_rad, bent_x, bent_y)
    # Far outside the picture a polynomial folds back and would show the wall twice.
    limit = np.linalg.norm(_undistort(camera, _border_plane(camera)), axis=1).max() * 1.1
    beyond = ~(r2 <= limit * limit)
    bent_x[beyond] = bent_y[beyond] = np.nan
    return bent_x, bent_y


def _on_tilted_sensor(tilt_rad: Sequence[float], x: Matrix, y: Matrix) -> tuple[Matrix, Matrix]:
    """Plane coordinates on a sensor turned by two angles, about its rows and its columns."""
    (sin_x, sin_y), (cos_x, cos_y) = np.sin(tilt_rad), np.cos(tilt_rad)
    about_x = np.array([[1, 0, 0], [0, cos_x, sin_x], [0, -sin_x, cos_x]])
    about_y = np.array([[cos_y, 0, -sin_y], [0, 1, 0], [sin_y, 0, cos_y]])
    turn = about_y @ about_x
    level = np.array([[turn[2, 2], 0, -turn[0, 2]], [0, turn[2, 2], -turn[1, 2]], [0, 0, 1]])
    a, b, c = (row[0] * x + row[1] * y + row[2] for row in level @ turn)
    return a / c, b / c


def _undistort(camera: Camera, plane: Points) -> Points:
    """Undistorted plane coordinates; for a fisheye the angle in radians along its direction."""
    import cv2

    if camera.model == "fisheye":
        bent = np.linalg.norm(plane, axis=1)
        theta = bent.copy()
        k1, k2, k3, k4 = camera.distortion or (0.0, 0.0, 0.0, 0.0)
        for _ in range(20):  # Newton on theta (1 + k1 theta^2 + ...) = bent
            t2 = theta * theta
            value = theta * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
            slope = 1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4)))
            theta = theta - (value - bent) / np.where(np.abs(slope) > 1e-6, slope, 1.0)
        theta = np.where((theta >= 0) & (theta < np.pi), theta, np.nan)
        ratio = np.divide(theta, bent, out=np.ones_like(bent), where=bent > 1e-12)
        return np.asarray(plane * ratio[:, None])
    if len(plane) == 0:  # OpenCV returns no array then
        return plane
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-12)
    points = cv2.undistortPoints(
        plane.reshape(-1, 1, 2), np.eye(3), np.array(camera.distortion), criteria=criteria
    )
    return np.asarray(points, np.float64).reshape(-1, 2)


def _border_plane(camera: Camera) -> Points:
    u = np.linspace(0, camera.width - 1, 17)
    v = np.linspace(0, camera.height - 1, 17)
    border = [(a, b) for a in u for b in (v[0], v[-1])] + [(a, b) for a in (u[0], u[-1]) for b in v]
    uv = np.array(border)
    y = (uv[:, 1] - camera.cy) / camera.fy
    return np.stack([(uv[:, 0] - camera.cx - camera.skew * y) / camera.fx, y], 1)


def rotation_robot_camera(mount: Mount) -> Matrix:
    """R with p_robot = R p_camera, (3, 3): the mount's turn first, then roll, then pitch."""
    turn, pitch, roll = np.radians([mount.rotation_deg, mount.pitch_deg, mount.roll_deg])
    turn_z = np.array(
        [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )
    pitch_y = np.array(
        [[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]]
    )
    roll_x = np.array(
        [[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]]
    )
    # Columns: where the camera's right, down and optical axis point on the robot.
    base = np.eye(3) if mount.view == "down" else np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    return np.asarray(pitch_y @ roll_x @ base @ turn_z)


def robot_rays(rig: Rig, pixels_uv: ArrayLike) -> Points:
    """Unit rays in robot axes of (N, 2) pixels; nan outside the lens."""
    return np.asarray(pixel_rays(rig.camera, pixels_uv) @ rotation_robot_camera(rig.mount).T)


def robot_pixels(rig: Rig, rays: Points) -> Points:
    """(N, 2) pixels that show rays given in robot axes; nan where the lens cannot see."""
    return ray_pixels(rig.camera, in_camera(rig, rays))


def in_camera(rig: Rig, rays: Points) -> Points:
    """Turn (..., 3) rays from robot axes into camera axes."""
    return np.asarray(rays @ rotation_robot_camera(rig.mount))


def camera_position(rig: Rig, pose: Pose | Poses) -> Matrix:
    """(3,) position in the world, or (3, N) of N poses."""
    return np.array([pose.x_mm, rig.mount.lateral_mm + pose.y_mm, _camera_z(rig) + pose.z_mm])


def cast(rig: Rig, pose: Pose | Poses, robot_rays: Points) -> Points:
    """World points where rays given in robot axes meet the wall; nan where they never do."""
    rays = turned(rotation(pose), np.moveaxis(robot_rays, -1, 0))
    x, y, z = camera_position(rig, pose)
    with np.errstate(invalid="ignore", divide="ignore"):
        t = reach(rig, (x, y, z), rays)
        return _xyz(x + t * rays[0], y + t * rays[1], z + t * rays[2])


def reach(rig: Rig, at: Matrix | tuple[Matrix, ...], rays: Matrix) -> Matrix:
    """Factors by which rays, (3, ...), reach from `at` to the wall; nan where they never do.

    Cylinder: |o + t d| = R in the plane across the axis:
    a = dy^2 + dz^2, b = oy dy + oz dz, c = oy^2 + oz^2 - R^2, t = (-b + sqrt(b^2 - a c)) / a.
    """
    (_, oy, oz), (_, dy, dz), radius = at, rays, rig.pipe.radius_mm
    if radius is None:
        t = -oz / dz
    else:
        a, b = dy * dy + dz * dz, oy * dy + oz * dz
        c = oy * oy + oz * oz - radius * radius
        t = (np.sqrt(b * b - a * c) - b) / a
    return np.where(t > 0, t, np.nan)


def sight(rig: Rig, pose: Pose | Poses, wall_xyz: Points) -> Points:
    """Directions in robot axes, not normalised, in which world points appear from a pose."""
    x, y, z = camera_position(rig, pose)
    away = np.stack([wall_xyz[..., 0] - x, wall_xyz[..., 1] - y, wall_xyz[..., 2] - z])
    return np.moveaxis(turned(rotation(pose).swapaxes(0, 1), away), 0, -1)


def rotation(pose: Pose | Poses) -> Matrix:
    """R_z(yaw) R_y(pitch) R_x(roll), robot to world, (3, 3) and then the shape of the poses."""
    cy, cp, cr = np.cos(pose.yaw_rad), np.cos(pose.pitch_rad), np.cos(pose.roll_rad)
    sy, sp, sr = np.sin(pose.yaw_rad), np.sin(pose.pitch_rad), np.sin(pose.roll_rad)
    return np.array(
        [
            (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr),
        ]
    )


def turned(matrix: Matrix, vectors: Matrix) -> Matrix:
    """R v of vectors (3, ...); `matrix` is (3, 3) for all of them, or (3, 3, ...) for each."""
    if matrix.ndim == 2:
        return np.asarray((matrix @ vectors.reshape(3, -1)).reshape(vectors.shape))
    return np.asarray(np.einsum("ij...,j...->i...", matrix, vectors))


def develop(rig: Rig, wall_xyz: Points) -> Points:
    """(axial mm, arc mm) of points on the wall."""
    radius = rig.pipe.radius_mm
    if radius is None:
        return np.asarray(wall_xyz[..., :2])
    arc = radius * np.arctan2(wall_xyz[..., 1], wall_xyz[..., 2])
    return np.stack([wall_xyz[..., 0], arc], -1)


def outward(rig: Rig, wall_xyz: Matrix) -> Matrix:
    """(2, N) y and z of the unit normal through the wall at points on it, (3, N); its x is 0."""
    radius = rig.pipe.radius_mm
    if radius is None:
        return np.stack([np.zeros_like(wall_xyz[0]), np.ones_like(wall_xyz[0])])
    return np.asarray(wall_xyz[1:] / radius)


def enclose(rig: Rig, axial_arc: Points) -> Points:
    """World points of the developed wall: the inverse of `develop`."""
    axial, arc = axial_arc.T
    radius = rig.pipe.radius_mm
    if radius is None:
        return np.stack([axial, arc, np.zeros_like(arc)], 1)
    return np.stack([axial, radius * np.sin(arc / radius), radius * np.cos(arc / radius)], 1)


def _xyz(x: Matrix, y: Matrix, z: Matrix) -> Points:
    points = np.empty((*np.broadcast_shapes(x.shape, y.shape, z.shape), 3))
    points[..., 0], points[..., 1], points[..., 2] = x, y, z
    return points


def _camera_z(rig: Rig) -> float:
    invert_mm = 0.0 if rig.pipe.diameter_mm is None else rig.pipe.diameter_mm / 2
    return invert_mm - rig.mount.height_mm
