"""Where a camera that looks ahead looks, by the place of the pipe's axis in its picture."""

from __future__ import annotations

import numpy as np

from vo_core.geometry.wall import robot_rays
from vo_core.rig import Rig
from vo_core.types import Matrix


def gaze(rig: Rig, axis_uv: tuple[float, float], roll_rad: float) -> Matrix:
    """(2,) yaw and pitch of the robot, rad, whose camera shows the axis at a pixel; nan if none.

    With R = R_z(yaw) R_y(pitch) R_x(roll) the axis appears along d = R' e_x, so that
    R_x(roll) d = (cos(pitch) cos(yaw), -sin(yaw), sin(pitch) cos(yaw)).
    """
    ((ahead, right, down),) = robot_rays(rig, [axis_uv])
    cos, sin = np.cos(roll_rad), np.sin(roll_rad)
    right, down = cos * right - sin * down, sin * right + cos * down
    return np.array([-np.arcsin(right), np.arctan2(down, ahead)])
