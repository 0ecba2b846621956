"""The way of the robot: its state, when the wall was seen last, and how it goes on from there.

Time stamps guide the prediction only: they move no pose that the wall shows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vo_core.clock import Clock
from vo_core.geometry.motion import RATES, parameters
from vo_core.geometry.motion_prior import MotionPrior
from vo_core.geometry.rectify import PatchGrid
from vo_core.geometry.wall import Pose, apart_mm
from vo_core.links.fix import Fix
from vo_core.links.locator import LEAST_OVERLAP
from vo_core.lookout import Lookout
from vo_core.rig import Rig
from vo_core.smoother import Link, joined
from vo_core.state import State
from vo_core.types import Matrix

ACCELERATION_MM_S2 = 2000.0
"""Largest acceleration of a robot; a picture that shows more does not show the robot's motion."""

REACH_PX = 2.0
"""Largest error of a good prediction, in pixels of the patch."""

HELD_MM = 2.0
"""Way of a robot that stands while its camera looks around, one sigma."""

HELD_S = 5.0
"""After this time without a fix nothing shows that the robot still stands."""

UNSEEN_SPEED = 0.1
"""Relative change of speed, one sigma, that may go unseen during a loss."""

UNSEEN_ACCELERATION = np.array([500.0, 200.0, 0.5])
"""Acceleration along and across in mm/s^2, and about the vertical in rad/s^2, one sigma each."""

UNKNOWN_SPEED = np.array([300.0, 20.0, 0.1])
"""Speed along and across in mm/s and of the turn in rad/s, one sigma, before any motion is seen."""

LOST_LIMIT_S = 1.0
"""After this time without a fix the newest picture becomes a reference, at the predicted pose."""


class Course:
    """The state at the last frame and at the last fix, and the speed between the last two fixes."""

    def __init__(self, rig: Rig, grid: PatchGrid, lookout: Lookout | None) -> None:
        self.clock = Clock()
        self.motion = MotionPrior(rig)
        self.state = self.fixed = State.at_start(rig)
        """State at the last frame, and at the last frame with a fix."""
        self.velocity: Matrix | None = None
        """(3,) mm along, mm across and rad per frame period; None before the second fix."""
        self._lookout = lookout
        self._looks_along_pipe = rig.looks_along_pipe
        self._mm_per_px, self._view_mm = grid.mm_per_px, grid.shape[1] * grid.mm_per_px
        self._fixed_frame = -1
        """Frame from which those without a fix follow; -1 before the first one."""
        self._fix_periods = 0.0
        """`Clock.periods` at the last fix."""

    @property
    def gone(self) -> float:
        """Frame periods since the last fix."""
        return self.clock.periods - self._fix_periods

    @property
    def gone_s(self) -> float:
        """Seconds since the last fix."""
        return self.gone * self.clock.period_s

    @property
    def way(self) -> Matrix | None:
        """(3,) mm along, mm across and rad that are expected since the last fix."""
        return None if self.velocity is None else self.velocity * self.gone

    @property
    def most_periods(self) -> float:
        """Frame periods in which the robot leaves the wall that it saw at the last fix."""
        if self.velocity is None:
            return 0.0
        return float(self._view_mm / max(abs(self.velocity[0]), 1e-9))

    @property
    def reach_mm(self) -> float:
        """Largest error of the predicted place; inf if the speed is unknown."""
        if self.velocity is None:
            return np.inf
        way_mm = float(np.hypot(*self.velocity[:2])) * self.gone
        reach_mm = ACCELERATION_MM_S2 * self.gone_s**2 + REACH_PX * self._mm_per_px
        return reach_mm + self.clock.jitter * way_mm

    @property
    def rate(self) -> Matrix | None:
        """(3,) change of x, y and yaw per second between the last two fixes."""
        return None if self.velocity is None else self.velocity / self.clock.period_s

    @property
    def unknown_way_mm(self) -> float:
        """Way since the first frame of a robot that nobody has seen moving, one sigma."""
        return float(self.clock.periods * self.clock.period_s * UNKNOWN_SPEED[0])

    @property
    def is_out_of_sight(self) -> bool:
        """Whether the wall that was seen at the last fix is out of sight, or long lost."""
        has_left = self.gone > (1 - LEAST_OVERLAP) * self.most_periods > 0
        return has_left or self.gone_s > LOST_LIMIT_S

    @property
    def is_around(self) -> bool:
        """Whether the camera looks around while the robot stands."""
        return self._lookout is not None and self._lookout.is_around

    @property
    def is_held(self) -> bool:
        """Whether a robot whose camera looks around still stands, as far as is known."""
        return self.is_around and self.gone_s < HELD_S

    def predict(self) -> Pose:
        """Continue the motion as before, but not beyond the wall seen at the last fix."""
        at = self.fixed.pose
        if self._lookout is not None:
            at = self._lookout.turned(self.fixed, self.gone)
            if self._lookout.is_around:
                return replace(at, x_mm=self._lookout.held_mm)
        if self.velocity is None:
            return at
        x, y, yaw = self.velocity * self.gone * min(1.0, self.most_periods / self.gone)
        return replace(at, x_mm=at.x_mm + x, y_mm=at.y_mm + y, yaw_rad=at.yaw_rad + yaw)

    @property
    def step_mm(self) -> Matrix:
        """(2,) predicted motion along and across since the last frame."""
        return (self.predict().vector - self.state.pose.vector)[:2]

    def guesses(self) -> list[Pose]:
        """The predicted pose, and that of the last fix if both predictions cannot be good."""
        predicted, last = self.predict(), self.fixed.pose
        is_apart = apart_mm(predicted, last) > 2 * REACH_PX * self._mm_per_px
        is_turned = (predicted.yaw_rad, predicted.pitch_rad) != (last.yaw_rad, last.pitch_rad)
        return [predicted, last] if is_apart or is_turned else [predicted]

    def begin(self) -> None:
        """Take the present state for that of a fix."""
        self.fixed, self._fix_periods = self.state, self.clock.periods

    def begin_anew(self, anew: State) -> None:
        """Go on from another state, of which no frame has shown anything; keep the distance."""
        at, covariance = self.state, anew.covariance.copy()
        covariance[0, 0] += at.covariance[0, 0]
        pose = replace(anew.pose, x_mm=at.pose.x_mm)
        start = np.concatenate([at.start[:1], anew.start[1:]])
        self.state = self.fixed = replace(anew, pose=pose, covariance=covariance, start=start)
        self._fix_periods, self._fixed_frame = self.clock.periods - 1, -1

    def take(self, fix: Fix, frame: int, *, shows_speed: bool, is_coarse: bool) -> Link:
        """Go on from a fix of a frame; return how it follows from the reference.

        A standstill that may be dirt shows no speed, so that the next frame can disprove it.
        """
        if shows_speed:
            velocity = (fix.mean.pose.vector - self.fixed.pose.vector)[:RATES] / self.gone
            if self._looks_along_pipe:
                velocity[1:] = 0.0
            if is_coarse and self.velocity is not None:
                # Dead reckoning would extrapolate the noise of a single step.
                velocity = np.array([(velocity[0] + self.velocity[0]) / 2, 0.0, 0.0])
            self.velocity = velocity
        else:
            self.velocity = None
        self.state = self.fixed = fix.mean
        self._fixed_frame, self._fix_periods = frame, self.clock.periods
        before = Pose.of(fix.anew.vector + fix.reference.offset)
        mean = parameters(fix.mean.pose, before, fix.state.mount_rad)
        return Link(fix.reference.frame, mean, fix.joint, is_seen=True)

    def reckon(self) -> None:
        """Go on without a fix: the motion continues, and the uncertainty grows with the time."""
        unknown = UNKNOWN_SPEED * self.clock.period_s
        if self.velocity is not None:
            unknown = UNSEEN_SPEED * np.abs(self.velocity)
            beyond = max(0.0, 1 - self.most_periods / self.gone)
            unknown[0] += abs(self.velocity[0]) * beyond
        drift = unknown * self.gone
        drift += np.minimum(UNSEEN_ACCELERATION * self.gone_s / 2, UNKNOWN_SPEED) * self.gone_s
        covariance = self.fixed.covariance.copy()
        covariance[:3, :3] += np.diag(np.square(drift))
        covariance[3:6, 3:6] += self.motion.steps[2:, 2:] * min(self.gone_s, 1.0)
        self.state = replace(self.fixed, pose=self.predict(), covariance=covariance)

    def hold(self) -> None:
        """Keep the distance of a robot that stands, while its camera looks elsewhere."""
        covariance = self.fixed.covariance.copy()
        covariance[0, 0] += HELD_MM**2
        self.state = replace(self.fixed, pose=self.predict(), covariance=covariance)

    def unseen(self, frame: int) -> Link:
        """How a frame follows from the last one with a fix, which its picture does not show."""
        now, before = self.state, self.fixed
        mean = parameters(now.pose, before.pose, now.mount_rad)
        joint = joined(now.covariance, before.covariance)
        link = Link(self._fixed_frame, mean, joint, is_seen=False)
        if self._fixed_frame < 0:
            self._fixed_frame = frame
        return link

    def shift(self, x_mm: float, y_mm: float) -> None:
        """Shift all poses by a move of the zero point."""
        self.state, self.fixed = (each.shifted(x_mm, y_mm) for each in (self.state, self.fixed))
