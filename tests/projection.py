"""Projects wall points with OpenCV's own forward models, which the renderer does not use."""

from __future__ import annotations

import cv2
import numpy as np

from app.lab.simulation.camera import mount_rotation
from vo_core import Pose, Rig


def attitude(pose: Pose):
    """Return R_z(yaw) R_y(pitch) R_x(roll), from OpenCV's rotation vectors."""
    turns = ((0, 0, pose.yaw_rad), (0, pose.pitch_rad, 0), (pose.roll_rad, 0, 0))
    about_z, about_y, about_x = (cv2.Rodrigues(np.array(turn, float))[0] for turn in turns)
    return about_z @ about_y @ about_x


def project(rig: Rig, pose: Pose, x_mm, arc_mm):
    """Return the pixels of developed wall points, by OpenCV's forward models."""
    camera = rig.camera
    if rig.pipe.diameter_mm is None:
        y_mm, z_mm = arc_mm, np.full_like(arc_mm, rig.mount.height_mm)
        centre_z_mm = 0.0
    else:
        radius_mm = rig.pipe.diameter_mm / 2
        y_mm = radius_mm * np.sin(arc_mm / radius_mm)
        z_mm = radius_mm * np.cos(arc_mm / radius_mm)
        centre_z_mm = radius_mm - rig.mount.height_mm
    to_wall = np.stack(
        [
            x_mm - pose.x_mm,
            y_mm - rig.mount.lateral_mm - pose.y_mm,
            z_mm - centre_z_mm - pose.z_mm,
        ],
        axis=-1,
    )
    r_world_camera = attitude(pose) @ mount_rotation(rig.mount)
    points = to_wall.reshape(-1, 1, 3) @ r_world_camera
    still = np.zeros(3)
    if camera.model == "fisheye":
        distortion = np.array(camera.distortion or [0.0] * 4)
        plane, _ = cv2.fisheye.projectPoints(points, still, still, np.eye(3), distortion)
    else:
        distortion = np.array(camera.distortion)
        plane, _ = cv2.projectPoints(points, still, still, np.eye(3), distortion)
    x, y = plane.reshape(-1, 2).T
    u = camera.fx * x + camera.skew * y + camera.cx
    return u, camera.fy * y + camera.cy
