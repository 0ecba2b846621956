"""The result of a measurement, and what is known before it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from vo_core.geometry.motion import POSE, RATES
from vo_core.geometry.motion_prior import MotionPrior
from vo_core.geometry.wall import Pose
from vo_core.links.picture import Reference
from vo_core.matching.align import Alignment
from vo_core.matching.template import Likeness
from vo_core.state import State
from vo_core.types import Matrix


@dataclass(frozen=True, eq=False)
class Fix:
    """A pose measured against a reference."""

    state: State
    """Includes the uncertainty of the reference."""
    reference: Reference
    alignment: Alignment
    moved_px: float
    """Median displacement of the blocks from where the reference shows them."""
    change: Matrix
    """(6,) change of the pose since the reference, without the prior of the motion."""
    change_variance: Matrix
    """(6,) variances of `change`."""
    anew: Pose
    """Pose of the reference as the picture shows it."""
    joint: Matrix
    """(14, 14) covariance of the pose, of `anew` and of the mount."""
    is_ambiguous: bool = False
    """Whether another pose fits equally well, as on a wall that repeats itself."""
    is_doubtful: bool = False
    """Whether this standstill would count as a fixed pattern if the other motion were in reach."""
    found: tuple[Fix, ...] = ()
    """All fixes that may show the wall, if there are several."""
    share: float = 0.0
    """Share of another exposure in the picture, see `Mixing`."""
    offset: Matrix = field(default_factory=lambda: np.zeros(POSE))
    """(6,) from the pose, at one exposure, to that at the time of the picture, between two."""

    @property
    def likeness(self) -> Likeness:
        """How the picture agrees with the reference."""
        return self.alignment.ncc, self.alignment.agreement

    @property
    def mean(self) -> State:
        """The state at the time of the picture."""
        return replace(self.state, pose=Pose.of(self.pose.vector + self.offset))

    @property
    def pose(self) -> Pose:
        """Pose of the camera in the located frame."""
        return self.state.pose

    @property
    def unheld(self) -> Fix:
        """The same, at the place along the pipe that follows without the prior of the motion."""
        x_mm = self.reference.pose.x_mm + float(self.change[0])
        return replace(self, state=replace(self.state, pose=replace(self.pose, x_mm=x_mm)))


@dataclass(frozen=True)
class Outlook:
    """What is known about the robot and the lens before a picture is located."""

    reach_mm: float
    """Largest distance of the robot from the guess; inf if unknown."""
    last: Pose
    """Pose at the last fix."""
    since_s: float
    """Time since the last fix."""
    ncc_weights: Matrix | None
    """(blocks,) mean normalised correlation of each block while the robot moved: low where dirt or
    water lies. None before the robot has moved."""
    motion: MotionPrior
    """How far this robot leaves its way."""
    rate: Matrix | None
    """(3,) change of x, y and yaw per second between the last two fixes."""
    shear_rad: float = 0.0
    """Standard deviation of the shear by coding; 0 in a film that is not coarsely coded."""
    gaze: Matrix | None = None
    """(2,) yaw and pitch of the camera in the pipe by the axis in the picture; None if unknown."""
    gaze_rad: float = 0.0
    """Standard deviation of each."""
    unexplained: float = 1.0
    """Share of the last picture that its pose did not explain."""
    is_around: bool = False
    """Whether the camera looks around, while the robot stands."""
    is_bound: bool = False
    """Whether every pose out of reach is rejected, even a standstill."""

    def rate_at(self, pose: Pose) -> Matrix:
        """(3,) change of x, y and yaw per second since the last fix, to a pose."""
        way = (pose.vector - self.last.vector)[:RATES]
        return np.asarray(way / max(self.since_s, 1e-3))
