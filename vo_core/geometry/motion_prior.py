"""The prior of a robot's motion beside its way along the pipe, learnt from its own drive.

Between two pictures that are `way` apart, the deviation d of a pose from the mean pose follows

    d(x + way) = F d(x) + w,   F = exp(-way / L),   w ~ N(0, S * spread),

an Ornstein-Uhlenbeck process on axes that swing about their mean (springs), and a random walk on
the others (L infinite).  Pictures show each step w with an error of covariance C, so its expected
square is w w' + C (expectation maximisation, Dempster, Laird & Rubin 1977).  The mean of these
under an inverse-Wishart prior is S: the evidence of a few steps cannot make it collapse, and steps
that the pictures hardly show leave it as it is.
"""

from __future__ import annotations

import numpy as np

from vo_core.geometry.wall import Pose
from vo_core.rig import Rig
from vo_core.types import Matrix

WAY_MM = 300.0
"""Way over which the steps of a random walk are stated."""

STANDING_MM = 15.0
"""A camera that stands changes its pose as much as one that has driven so far."""

SPRINGS_MM = 25.0
"""Way over which a deviation of height and pitch on wheels falls to 1/e: springs and pebbles.

A longer one would let the height of a camera that looks down wander, and the scale with it."""

CENTRED_MM = 300.0
"""The same for offset, heading and climb of a robot on wheels, which gravity centres in a pipe."""

STEPS = np.array([5.0, np.radians(1.5), 3.0, np.radians(1.0), np.radians(1.0)])
"""Expected steps of y, yaw, z, pitch and roll over `WAY_MM`, one sigma, mm and rad."""

ON_WHEELS = np.array([10.0, np.radians(3.0), 0.2, np.radians(0.1), np.radians(0.1)])
"""The same where the rig states how the camera stands on its wheels; z and pitch about a mean."""

CLIMB = float(np.radians(1.0))
"""Expected turn of a robot about the pipe's axis over `WAY_MM`, up the wall to either side."""

WORTH = 10
"""Weight of the expectation, in pictures."""

MEMORY_STEPS = 40
"""Pictures over which the steps are averaged."""


class MotionPrior:
    """Learns S; poses are in the order of `Pose`, and x, along the pipe, has no prior."""

    def __init__(self, rig: Rig) -> None:
        radius_mm = None if rig.pipe.diameter_mm is None else rig.pipe.diameter_mm / 2
        self._lateral_mm = rig.mount.lateral_mm
        self._arm_mm = 0.0 if radius_mm is None else rig.mount.height_mm - radius_mm
        """Height of the camera above the pipe's axis."""
        on_wheels = not rig.looks_along_pipe
        self._is_round = radius_mm is not None and on_wheels
        self._length_mm = np.full(5, np.inf)
        expected = np.diag(np.square(ON_WHEELS if on_wheels else STEPS))
        if on_wheels:
            self._length_mm[[2, 3]] = SPRINGS_MM
        if self._is_round:
            self._length_mm[[0, 1, 4]] = CENTRED_MM
            climb = np.array([self._arm_mm, 0.0, 0.0, 0.0, 1.0])
            expected += CLIMB**2 * np.outer(climb, climb)
        self._expected = expected
        self._mean_square = np.zeros((5, 5))
        self._offset = np.zeros(5)
        """Mean step of the axes on springs."""
        self._count = 0

    @property
    def steps(self) -> Matrix:
        """(5, 5) covariance S of y, yaw, z, pitch and roll."""
        seen = min(self._count, MEMORY_STEPS)
        return np.asarray((WORTH * self._expected + seen * self._mean_square) / (WORTH + seen))

    def mean(self, pose: Pose) -> Matrix:
        """(6,) mean pose: level, but a robot that climbs takes the camera about the axis."""
        if not self._is_round:
            return np.zeros(6)
        sin, cos = np.sin(pose.roll_rad), np.cos(pose.roll_rad)
        z_mm = self._lateral_mm * sin + self._arm_mm * (1 - cos)
        return np.array([0.0, 0.0, 0.0, z_mm, 0.0, 0.0])

    def kept(self, way_mm: float) -> Matrix:
        """(6,) diagonal of F: shares of a deviation that remain after a way."""
        return np.append(1.0, np.exp(-abs(way_mm) / self._length_mm))

    def covariance(self, way_mm: float) -> Matrix:
        """(5, 5) covariance of w after a way."""
        root = np.sqrt(self._spread(way_mm))
        return np.asarray(self.steps * np.outer(root, root))

    def learn(self, reference: Pose, moving: Pose, covariance: Matrix) -> None:
        """Add the step between two poses.

        Args:
            reference, moving: As estimated with this prior.
            covariance: (12, 12) of moving and reference.
        """
        way_mm = moving.x_mm - reference.x_mm
        kept = self.kept(way_mm)
        before, now = (pose.vector - self.mean(pose) for pose in (reference, moving))
        step = np.hstack([np.eye(6), -np.diag(kept)])[1:]
        scale = 1 / np.sqrt(self._spread(way_mm))
        seen = scale * (step @ np.concatenate([now, before]))
        self._count += 1
        share = 1 / min(self._count, MEMORY_STEPS)
        # Springs swing about their mean: an offset that lasts is an error of the rig or the wall.
        self._offset += share * np.where(self._length_mm == SPRINGS_MM, seen - self._offset, 0.0)
        seen = seen - self._offset
        square = np.outer(seen, seen) + (step @ covariance @ step.T) * np.outer(scale, scale)
        self._mean_square += share * (square - self._mean_square)

    def _spread(self, way_mm: float) -> Matrix:
        """(5,) variance of a step after a way, over that of `steps`."""
        way_mm = abs(way_mm) + STANDING_MM
        swings = np.isfinite(self._length_mm)
        return np.where(swings, 1 - np.exp(-2 * way_mm / self._length_mm), way_mm / WAY_MM)
