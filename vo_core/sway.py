"""How far a robot leaves its mean pose on its wheels, learnt from its own drive.

Zoom and keystone show height and pitch against the keyframe, but their errors add up from keyframe
to keyframe (by 0.4 mm of height a metre, on rendered runs), and a wrong height is a wrong scale.  A
robot comes back to its mean pose, and it does so the better the stiffer it is: what the keyframes
differ by shows how stiff.
"""

from __future__ import annotations

import numpy as np

from vo_core.rig import Rig
from vo_core.types import Matrix
from vo_core.wall import Pose

ASIDE_MM, YAW_RAD = 15.0, float(np.radians(6))
"""One sigma each: beside the axis, and heading."""

SOFTEST = np.array([3.0, np.radians(1), np.radians(1), np.radians(6)])
"""Height in mm, pitch, roll and climb in rad, one sigma, on soft wheels.

Climb is how far the robot turns about the pipe's axis, up the wall to either side; its camera moves
aside, too.  Roll is about itself."""

STIFFEST = np.array([0.1, np.radians(0.03), np.radians(0.1), np.radians(0.1)])
"""The same of a robot of which nothing is seen to move: clearances and a rough wall."""

_MEMORY = 20
"""Keyframes over which the robot's softness is averaged."""

_PER_STEP = np.array([4.0, 4.0, 4.0, 50.0])
"""Variance about the mean pose over the mean square change between two keyframes: 1.6 for a wave as
long as the way on which a deviation is forgotten, 4 for a random one, 50 for a wave of 1.7 m."""


class Sway:
    """Takes the changes of height and tilt from keyframe to keyframe."""

    def __init__(self, rig: Rig) -> None:
        diameter_mm = rig.pipe.diameter_mm
        self._arm_mm = None if diameter_mm is None else rig.mount.height_mm - diameter_mm / 2
        """Of the camera above the pipe's axis; a floor has none."""
        self._excess = np.zeros(4)
        self._count = 0

    def learn(self, before: Pose, after: Pose, variance: Matrix) -> None:
        """Take the poses of two keyframes that follow one another.

        Args:
            before, after: The poses.
            variance: (3,) of the change of z mm, pitch and roll in rad.
        """
        turn = after.roll_rad - before.roll_rad
        aside_mm = 0.0 if self._arm_mm is None else self._arm_mm * turn
        # What moves the camera aside as a climb does is none of its own roll.
        missing_mm = after.y_mm - before.y_mm - aside_mm
        own = turn
        if self._arm_mm:
            own = min(turn, missing_mm / self._arm_mm, key=abs)
        change = [after.z_mm - before.z_mm, after.pitch_rad - before.pitch_rad, own, turn]
        self._count += 1
        share = 1 / min(self._count, _MEMORY)
        excess = np.square(change) - np.asarray(variance)[[0, 1, 2, 2]]
        self._excess += share * (excess - self._excess)

    def mean(self, pose: Pose) -> Matrix:
        """(6,) the mean pose: level, but a camera above the axis comes down while it climbs."""
        if self._arm_mm is None:
            return np.zeros(6)
        return np.array([0.0, 0.0, 0.0, self._arm_mm * (1 - np.cos(pose.roll_rad)), 0.0, 0.0])

    @property
    def covariance(self) -> Matrix:
        """(6, 6) of a pose about the mean one, in the order of `Pose`; open along the pipe."""
        height, pitch, roll, climb = (
            np.clip(_PER_STEP * self._excess, STIFFEST**2, SOFTEST**2)
            if self._count
            else SOFTEST**2
        )
        covariance = np.diag([1e12, ASIDE_MM**2, YAW_RAD**2, height, pitch, roll])
        if self._arm_mm is not None:
            direction = np.array([0.0, self._arm_mm, 0.0, 0.0, 0.0, 1.0])
            covariance += climb * np.outer(direction, direction)
        return covariance
