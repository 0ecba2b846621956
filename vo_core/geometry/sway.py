"""How far a robot leaves its mean pose on its wheels, learnt from its own drive.

Zoom and keystone show height and pitch against the keyframe, but their errors add up from keyframe
to keyframe (by 0.4 mm of height a metre, on rendered runs), and a wrong height is a wrong scale.  A
robot comes back to its mean pose, and it does so the better the stiffer it is: what the keyframes
differ by shows how stiff.
"""

from __future__ import annotations

import numpy as np

from vo_core.geometry.wall import Pose
from vo_core.rig import Rig
from vo_core.types import Matrix

STEERED = np.array([5.0, np.radians(1.5)])
"""Beside the axis in mm and heading in rad, one sigma: a round pipe centres a robot, so no more is
assumed of one that was not seen to do more.

The wall shows both by its shear only, from link to link: coding errors add up to 5 mm and 1 degree
where the mean pose is left open."""

UNSTEADY = np.array([15.0, np.radians(6)])
"""The same of the worst driver, and on a floor, which centres nothing."""

SOFTEST = np.array([3.0, np.radians(1), np.radians(1), np.radians(6)])
"""Height in mm, pitch, roll and climb in rad, one sigma, on soft wheels.

Climb is how far the robot turns about the pipe's axis, up the wall to either side; its camera moves
aside, too.  Roll is about itself."""

STIFFEST = np.array([0.05, np.radians(0.01), np.radians(0.1), np.radians(0.1)])
"""The same of a robot of which nothing is seen to move: clearances and a rough wall."""

USUAL = np.array([0.2, np.radians(0.1), np.radians(0.1), np.radians(1)])
"""The same before anything was seen."""

FORGOTTEN_MM = np.array([np.inf, 300.0, 300.0, 25.0, 25.0, 300.0])
"""Way on which a deviation from the mean pose falls to 1/e, in the order of `Pose`: springs and
pebbles are short, steering is longer, and a way is not forgotten.

Springs swing about their mean, so that a deviation does not last: a longer way would let the height
wander, and with it the scale."""

LEAST_SPREAD = 0.05
"""Of the variance of its sway, what a robot may do on no way at all."""

CLEAR = 4.0
"""Times its variance by which a change must exceed 0 to be the robot's and no error."""

_LEARNT = [3, 4, 5, 5]
"""Height, pitch, roll and climb in the order of `Pose`."""

_MEMORY = 40
"""Frames over which the robot's softness is averaged."""

_WORTH = 5
"""Frames for which that counts."""

_WORTH_MM, _MEMORY_MM = 300.0, 3000.0
"""Way for which `STEERED` counts, and over which steering is averaged."""

_BIASED, _BIASED_AFTER = 0.5, 6
"""Share of the squared changes that grow with the way, by which they are an error of the wall's
shape and no sway, and the frames after which that is sure.  A flat bed of silt raises a camera by
the same each step, to 45 mm in 6 m; a robot goes up and down.  Climbs are long, and go round."""

_MOST_BIAS = np.array([0.03, np.radians(0.02), 0.0, 0.0])
"""Height in mm and pitch in rad a mm of way, above which a wrong shape need not be thought of at
once: a flat bed in the place of a pipe makes half of it."""

_PER_STEP = np.array([4.0, 4.0, 4.0, 50.0])
"""Variance about the mean pose over that of the change, of a process that forgets as above; a robot
climbs in waves that are far longer."""


def kept(way_mm: float) -> Matrix:
    """(6,) shares of a deviation that are left after a way (Ornstein & Uhlenbeck 1930)."""
    return np.asarray(np.exp(-abs(way_mm) / FORGOTTEN_MM))


def spread(way_mm: float) -> Matrix:
    """(6,) variance of what came new on a way, over that of the sway."""
    return np.maximum(1 - kept(way_mm) ** 2, LEAST_SPREAD)


class Sway:
    """Takes the changes of height and tilt from keyframe to keyframe."""

    def __init__(self, rig: Rig) -> None:
        diameter_mm = rig.pipe.diameter_mm
        self._arm_mm = None if diameter_mm is None else rig.mount.height_mm - diameter_mm / 2
        """Of the camera above the pipe's axis; a floor has none."""
        self.own = np.eye(6)
        """Takes out of a deviation from the mean pose what a climb does to the height of a camera
        beside the axis: (6, 6), of small angles."""
        if self._arm_mm is not None:
            self.own[3, 5] = -rig.mount.lateral_mm
        self._variance = np.square(USUAL)
        self._count = _WORTH
        self._square, self._with_way, self._way = np.zeros(4), np.zeros(4), 0.0
        """Means of the squared changes, of their products with the way, and of the way squared."""

        self._steering = np.square(UNSTEADY if self._arm_mm is None else STEERED)
        """Mean squares about the mean pose, beside the axis and heading."""
        self._followed_mm, self._last_mm = _WORTH_MM, 0.0

    def learn(self, change: Matrix, variance: Matrix) -> None:
        """Take how a pose differs from its reference's, as measured without any habit.

        Args:
            change: (6,) in the order of `Pose`.
            variance: (6,)
        """
        way_mm, aside_mm, _, down_mm, pitch, turn = (self.own @ change).tolist()
        # What moves the camera aside as a climb does is none of its own roll.
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
        per_step = _PER_STEP / spread(way_mm)[_LEARNT]
        noise = per_step * variance[_LEARNT]
        # A change that is hardly seen is no sign of stiff springs: it counts by its information
        # on the variance (Fisher's, of a normal distribution).  Rolls and climbs are small until
        # they are seen: what is left open there moves the camera aside.
        likely = np.maximum(self._variance, np.square(USUAL))
        weight = np.square(likely / (likely + noise))
        weight[2:] = 1.0
        shown = per_step * np.square(seen) - CLEAR * noise
        self._variance += share * weight * (shown - self._variance)

    def follow(self, pose: Pose, variance: Matrix) -> None:
        """Take a pose as a whole: how far from the axis the robot drives, and how far turned.

        The mean of the squared estimate and its variance does not mistake a pose that is hardly
        seen, and therefore held near the mean one, for a steady drive (expectation maximisation,
        Dempster et al. 1977).

        Args:
            pose: As estimated, with the habit.
            variance: (6,) of it.
        """
        if self._arm_mm is None:
            return
        way_mm, self._last_mm = abs(pose.x_mm - self._last_mm), pose.x_mm
        self._followed_mm += way_mm
        # What a climb moves aside is in the sway already.
        aside_mm = min(pose.y_mm, pose.y_mm - self._arm_mm * pose.roll_rad, key=abs)
        seen = np.square([aside_mm, pose.yaw_rad]) + variance[1:3]
        share = min(way_mm / min(self._followed_mm, _MEMORY_MM), 1.0)
        self._steering += share * (seen - self._steering)

    def mean(self, pose: Pose) -> Matrix:
        """(6,) the mean pose: level, but a camera above the axis comes down while it climbs."""
        if self._arm_mm is None:
            return np.zeros(6)
        return np.array([0.0, 0.0, 0.0, self._arm_mm * (1 - np.cos(pose.roll_rad)), 0.0, 0.0])

    @property
    def covariance(self) -> Matrix:
        """(6, 6) of its `own` deviations, in the order of `Pose`; open along the pipe."""
        height, pitch, roll, climb = np.clip(self._variance, STIFFEST**2, SOFTEST**2)
        aside, yaw = np.clip(self._steering, STEERED**2, UNSTEADY**2)
        covariance = np.diag([1e12, aside, yaw, height, pitch, roll])
        if self._arm_mm is not None:
            direction = np.array([0.0, self._arm_mm, 0.0, 0.0, 0.0, 1.0])
            covariance += climb * np.outer(direction, direction)
        return covariance
