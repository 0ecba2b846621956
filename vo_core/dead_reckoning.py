"""Frames without a fix: the motion before them goes on, and the uncertainty grows with the time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vo_core.geometry.motion_prior import MotionPrior
from vo_core.geometry.wall import Pose
from vo_core.state import State
from vo_core.types import Matrix

UNSEEN_SPEED = 0.1
"""Relative change of speed, one sigma, that may go unseen during a loss."""

UNSEEN_ACCELERATION_MM_S2 = 500.0
"""Acceleration along the pipe, one sigma, that may go unseen."""

UNSEEN_ACCELERATION = np.array([UNSEEN_ACCELERATION_MM_S2, 200.0, 0.5])
"""Acceleration along and across in mm/s^2, and about the vertical in rad/s^2, one sigma each."""

UNKNOWN_SPEED = np.array([300.0, 20.0, 0.1])
"""Speed along and across in mm/s and of the turn in rad/s, one sigma, before any motion is seen."""


def reckoned(
    fixed: State,
    predicted: Pose,
    velocity: Matrix | None,
    motion: MotionPrior,
    *,
    periods: float,
    most_periods: float,
    period_s: float,
) -> State:
    """The state of a frame without a fix, at the predicted pose.

    Args:
        fixed: State at the last frame with a fix.
        predicted: Pose if the robot went on as before.
        velocity: (3,) mm along, mm across and rad a frame period; None before any motion was seen.
        motion: How far this robot leaves its way.
        periods: Frame periods since the last fix.
        most_periods: Frame periods in which the robot leaves the wall seen at the last fix; the
            prediction goes no further than that.
        period_s: Length of a frame period.
    """
    gone_s = periods * period_s
    unknown = UNKNOWN_SPEED * period_s
    if velocity is not None:
        unknown = UNSEEN_SPEED * np.abs(velocity)
        unknown[0] += abs(velocity[0]) * max(0.0, 1 - most_periods / periods)
    drift = unknown * periods
    drift += np.minimum(UNSEEN_ACCELERATION * gone_s / 2, UNKNOWN_SPEED) * gone_s
    covariance = fixed.covariance.copy()
    covariance[:3, :3] += np.diag(np.square(drift))
    covariance[3:6, 3:6] += motion.steps[2:, 2:] * min(gone_s, 1.0)
    return replace(fixed, pose=predicted, covariance=covariance)
