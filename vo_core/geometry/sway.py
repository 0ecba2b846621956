"""Learns how far a robot sways from its mean pose on its wheels, from its own drive.

Zoom and keystone show height and pitch against the keyframe, but their errors add up from keyframe
to keyframe (by 0.4 mm of height per metre on rendered runs), and a wrong height is a wrong scale. A
robot returns to its mean pose, and the stiffer it is, the closer it stays. The differences between
keyframes show how stiff it is.
"""

from __future__ import annotations

import numpy as np

from vo_core.geometry.wall import Pose
from vo_core.rig import Rig
from vo_core.types import Matrix

STEERED = np.array([5.0, np.radians(1.5)])
"""Offset from the axis in mm and heading in rad, one sigma, of a robot not seen to steer more.

A round pipe centres a robot.  The wall shows both values by its shear only, from link to link, and
without this prior coding errors add up to 5 mm and 1 degree."""

UNSTEADY = np.array([15.0, np.radians(6)])
"""Upper limit of `STEERED`; also used on a floor, which centres nothing."""

SOFTEST = np.array([3.0, np.radians(1), np.radians(1), np.radians(6)])
"""Height in mm, pitch, roll and climb in rad, one sigma, of a robot on soft wheels: upper limit.

Climb turns the robot about the pipe's axis, up the wall to either side, and moves its camera aside.
Roll turns the robot about its own axis."""

STIFFEST = np.array([0.05, np.radians(0.01), np.radians(0.1), np.radians(0.1)])
"""Lower limit of the same: clearances and a rough wall move every robot."""

USUAL = np.array([0.2, np.radians(0.1), np.radians(0.1), np.radians(1)])
"""Initial value of the same."""

FORGOTTEN_MM = np.array([np.inf, 300.0, 300.0, 25.0, 25.0, 300.0])
"""Distance over which a deviation from the mean pose falls to 1/e, in the order of `Pose`.

It is short for springs and pebbles, longer for steering, and infinite along the pipe. Springs swing
about their mean, so a deviation does not last: a longer distance would let the height wander, and
the scale with it."""

LEAST_SPREAD = 0.05
"""Share of the sway's variance that a robot may add without any motion along the pipe."""

CLEAR = 4.0
"""A squared change counts as sway only beyond this many times its error variance."""

_LEARNT = [3, 4, 5, 5]
"""Indices of height, pitch, roll and climb in the order of `Pose`."""

_MEMORY = 40
"""Frames over which the sway's variance is averaged."""

_WORTH = 5
"""Weight of `USUAL` in that average, in frames."""

_WORTH_MM = 300.0
"""Weight of `STEERED` in the mean steering, as a distance."""

_MEMORY_MM = 3000.0
"""Distance over which the steering is averaged."""

_BIASED = 0.5
"""Changes count as an error of the wall's shape, and not as sway, if at least this share of their
squares is proportional to the distance.

A flat bed of silt raises the camera by the same amount in each step, up to 45 mm in 6 m; a robot
goes up and down. Climbs are long waves and are not tested."""

_BIASED_AFTER = 6
"""Number of frames after which that is certain."""

_MOST_BIAS = np.array([0.03, np.radians(0.02), 0.0, 0.0])
"""Height in mm and pitch in rad per mm of distance: smaller slopes may be an error of the wall's
shape from the first frames on.  A flat bed in place of a pipe makes half of these."""

_PER_STEP = np.array([4.0, 4.0, 4.0, 50.0])
"""Variance about the mean pose over the variance of a change, for the forgetting above; climbs are
waves that are far longer."""


class Sway:
    """Estimates the variance of the sway from the changes between keyframes."""

    def __init__(self, rig: Rig) -> None:
        diameter_mm = rig.pipe.diameter_mm
        self._arm_mm = None if diameter_mm is None else rig.mount.height_mm - diameter_mm / 2
        """Height of the camera above the pipe's axis; None on a floor."""
        self.own = np.eye(6)
        """(6, 6) matrix that removes from a deviation the change of height by which a climb moves a
        camera beside the axis, for small angles."""
        if self._arm_mm is not None:
            self.own[3, 5] = -rig.mount.lateral_mm
        self._variance = np.square(USUAL)
        self._count = _WORTH
        self._square = np.zeros(4)
        """Means of the squared changes."""
        self._with_way = np.zeros(4)
        """Means of the changes times the distance."""
        self._way = 0.0
        """Mean of the squared distance."""

        self._steering = np.square(UNSTEADY if self._arm_mm is None else STEERED)
        """Mean squares of the offset from the axis and of the heading."""
        self._followed_mm, self._last_mm = _WORTH_MM, 0.0

    def learn(self, change: Matrix, variance: Matrix) -> None:
        """Update height, pitch, roll and climb by a change of the pose since its reference.

        Args:
            change: (6,) in the order of `Pose`, measured without the habit prior.
            variance: (6,) of `change`.
        """
        way_mm, aside_mm, _, down_mm, pitch, turn = (self.own @ change).tolist()
        # A turn that moves the camera aside as a climb does is no roll.
        own = turn
        if self._arm_mm:
            own = min(turn, aside_mm / self._arm_mm - turn, key=abs)
        self._count += 1
        share = 1 / min(self._count, _MEMORY)
        seen = np.array([down_mm, pitch, own, turn])
        self._square += share * (np.square(seen) - self._square)
        self._with_way += share * (seen * way_mm - self._with_way)
        self._way += share * (way_mm**2 - self._way)
        per_mm = self._with_way / max(self._way, 1e-9)
        biased = per_mm * self._with_way > _BIASED * self._square
        biased[2:] = False
        biased &= (np.abs(per_mm) < _MOST_BIAS) | (self._count > _WORTH + _BIASED_AFTER)
        seen = np.where(biased, seen - per_mm * way_mm, seen)
        per_step = _PER_STEP / self.spread(way_mm)[_LEARNT]
        noise = per_step * variance[_LEARNT]
        # A change that is hardly visible is no sign of stiff springs: it counts by its Fisher
        # information on the variance of a normal distribution.  Rolls and climbs count as small
        # until they are seen, because an open roll moves the camera aside.
        likely = np.maximum(self._variance, np.square(USUAL))
        weight = np.square(likely / (likely + noise))
        weight[2:] = 1.0
        shown = per_step * np.square(seen) - CLEAR * noise
        self._variance += share * weight * (shown - self._variance)

    def follow(self, pose: Pose, variance: Matrix) -> None:
        """Update the steering: how far from the axis the robot drives, and how far turned.

        A pose that is hardly visible is held near the mean pose by its prior. Averaging the squared
        estimate plus its variance keeps that from counting as a steady drive (expectation
        maximisation, Dempster et al. 1977).

        Args:
            pose: The estimate with the habit prior.
            variance: (6,) of `pose`.
        """
        if self._arm_mm is None:
            return
        way_mm, self._last_mm = abs(pose.x_mm - self._last_mm), pose.x_mm
        self._followed_mm += way_mm
        # The offset by a climb is part of the sway already.
        aside_mm = min(pose.y_mm, pose.y_mm - self._arm_mm * pose.roll_rad, key=abs)
        seen = np.square([aside_mm, pose.yaw_rad]) + variance[1:3]
        share = min(way_mm / min(self._followed_mm, _MEMORY_MM), 1.0)
        self._steering += share * (seen - self._steering)

    def kept(self, way_mm: float) -> Matrix:
        """(6,) shares of a deviation that remain after a distance (Ornstein & Uhlenbeck 1930)."""
        return np.asarray(np.exp(-abs(way_mm) / FORGOTTEN_MM))

    def spread(self, way_mm: float) -> Matrix:
        """(6,) variance of the new deviation after a distance, over that of the sway."""
        return np.maximum(1 - self.kept(way_mm) ** 2, LEAST_SPREAD)

    def mean(self, pose: Pose) -> Matrix:
        """(6,) the mean pose: level, except that a camera above the axis sinks in a climb."""
        if self._arm_mm is None:
            return np.zeros(6)
        return np.array([0.0, 0.0, 0.0, self._arm_mm * (1 - np.cos(pose.roll_rad)), 0.0, 0.0])

    @property
    def covariance(self) -> Matrix:
        """(6, 6) of the `own` deviations, in the order of `Pose`; open along the pipe."""
        height, pitch, roll, climb = np.clip(self._variance, STIFFEST**2, SOFTEST**2)
        aside, yaw = np.clip(self._steering, STEERED**2, UNSTEADY**2)
        covariance = np.diag([1e12, aside, yaw, height, pitch, roll])
        if self._arm_mm is not None:
            direction = np.array([0.0, self._arm_mm, 0.0, 0.0, 0.0, 1.0])
            covariance += climb * np.outer(direction, direction)
        return covariance
