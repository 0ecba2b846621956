"""A camera that looks along the pipe: where it looks, what it sees there, and when it looks around.

Nobody states where such a camera stands and looks, and an operator turns it. So its picture is
resampled from a vantage that follows the estimated pose; the pipe's axis in the picture shows large
turns before any wall is matched; and what is fixed in the picture is masked.

An operator stops at a defect, turns the camera to it and back.  The gaze then leaves the direction
in which the robot has driven, and returns to it, without any way between.  A camera that is pushed
through the pipe by hand turns as far, but only while it moves: the wall then shows that it drives.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vo_core.geometry.gaze import gaze
from vo_core.geometry.rectify import Rectifier
from vo_core.geometry.wall import Pose
from vo_core.image.axis import AxisFinder
from vo_core.image.overlay import Overlay
from vo_core.links.fix import Fix
from vo_core.links.locator import Locator
from vo_core.links.picture import View
from vo_core.state import State
from vo_core.types import Image, Matrix

CERTAINLY_APART = 3.0
"""Standard deviations of the pose beyond which a camera certainly stands elsewhere."""

UNLIKE_RAD = float(np.radians(5.0))
"""Least difference of the axis in the picture beyond which the camera looks elsewhere."""

ASTRAY = 2.0
"""Angle between the axis in the picture and in the estimated pose that no error explains, in
standard deviations of the axis: 6 degrees in clear pictures.

In the first 400 frames of seven rendered films no angle above 4.3 degrees lasts for 8 frames; a
later pan by 50 degrees has larger ones, so a camera that looks around does not count."""

ASIDE_RAD = float(np.radians(10.0))
"""Angle between gaze and driving direction from which the camera looks around."""

BACK_RAD = float(np.radians(6.0))
"""Angle below which it looks ahead again."""

SURE_FRAMES = 3
"""Consecutive frames in which an axis far from where the camera looked, or a wall that shows a held
robot elsewhere, is no chance."""


class Lookout:
    """Follows the gaze of a camera that looks along the pipe."""

    def __init__(self, locator: Locator, rectify: Rectifier, overlay: Overlay) -> None:
        camera, diameter_mm = rectify.rig.camera, rectify.rig.pipe.diameter_mm or 0.0
        self._locator, self._rectify, self._overlay = locator, rectify, overlay
        self._find_axis = AxisFinder((camera.width, camera.height))
        # From these turns and ways aside the picture is resampled from another vantage; a turn
        # about the axis only shifts the patch along its arc.
        turn_rad, aside_mm = float(np.radians(3.0)), 0.04 * diameter_mm
        self._stray = np.array([np.inf, aside_mm, turn_rad, aside_mm, turn_rad, 4 * turn_rad])
        self.view: View = locator.view(rectify, overlay.mask)
        """What the camera sees from the vantage of the next picture."""
        self.gaze: Matrix | None = None
        """(2,) yaw and pitch by the axis in the last picture; None if it does not show."""
        self.gaze_rad = 0.0
        """Standard deviation of each."""
        self._gaze_fixed: Matrix | None = None
        """The same in the last picture with a fix."""
        self._turn = np.zeros(2)
        """(2,) change of yaw and pitch a frame period, between the last two fixes."""
        self._ahead: Matrix | None = None
        """(2,) yaw and pitch of the driving direction; None before the first fix."""
        self._last_mm = 0.0
        """Where the camera looked ahead last."""
        self.is_around = False
        """Whether the camera looks around."""
        self._drives = 0
        """Number of consecutive frames whose wall shows that the robot is not where it is held."""
        self._jumps = 0
        """Number of consecutive frames whose axis is far from where the camera looked."""
        self._astray, self._astray_s = 0, 0.0
        """Number of frames, and time, since the axis was where the estimated pose shows it."""

    @property
    def is_astray(self) -> bool:
        """Whether the axis has long been elsewhere than the estimated pose shows it."""
        astray_frames = 4  # least number of consecutive frames in that time
        astray_s = 0.25  # time after which the estimated pose is given up
        return self._astray >= astray_frames and self._astray_s >= astray_s

    @property
    def held_mm(self) -> float:
        """Where the robot stands while the camera looks around."""
        return self._last_mm

    @property
    def _unlike_rad(self) -> float:
        """Difference of the axis in the picture beyond which the camera looks elsewhere."""
        return max(UNLIKE_RAD, ASTRAY * self.gaze_rad)

    def see(self, image: Image, state: State, period_s: float) -> None:
        """Find the axis in the next picture, (H, W) grey, a frame period after the last one."""
        # A camera turns by less from frame to frame: an axis farther away is a chance.
        jump_rad = float(np.radians(20.0))
        memory_s = 2.0  # time over which an axis stays uncertain that was: mist clears slowly
        # Standard deviation of the gaze by the axis in a clear picture; it is much the same in the
        # next. The middle of the far rings is off the axis if the camera is, and light falls from
        # one side.
        off_axis_rad = float(np.radians(2.0))
        axis = self._find_axis(image)
        roll_rad = state.pose.roll_rad + state.mount_rad[1]
        seen = None if axis is None else gaze(self._rectify.rig, axis.pixel_uv, roll_rad)
        if axis is not None:
            seen_rad = axis.sigma_px / self._rectify.rig.camera.fx
            kept_rad = self.gaze_rad * np.exp(-period_s / memory_s)
            self.gaze_rad = float(max(np.hypot(seen_rad, off_axis_rad), kept_rad))
        off_rad = 0.0 if seen is None else float(np.abs(seen - state.gaze).max())
        # Before the first fix nothing shows where the camera looked before.
        jumps = off_rad > jump_rad and self._ahead is not None
        self._jumps = self._jumps + 1 if jumps else 0
        self.gaze = seen if not jumps or self._jumps >= SURE_FRAMES else None
        if self.is_around and self.gaze is not None and self._ahead is not None:
            self.is_around = bool((np.abs(self.gaze - self._ahead) > BACK_RAD).any())
        # Near the border of the picture, where a pan takes it, the axis is less exact.
        is_off = self.gaze is not None and off_rad > ASTRAY * self.gaze_rad and not self.is_around
        self._astray = self._astray + 1 if is_off else 0
        self._astray_s = self._astray * period_s

    def begin(self) -> State:
        """State before the first frame: the rig's gaze, unless the picture clearly shows another.

        The axis in a picture is known to a few degrees only.
        """
        self._gaze_fixed, self._astray, self._astray_s = self.gaze, 0, 0.0
        is_stated = self.gaze is None or bool((np.abs(self.gaze) < self._unlike_rad).all())
        return State.at_start(self._rectify.rig, None if is_stated else self.gaze)

    def turned(self, fixed: State, periods: float) -> Pose:
        """Turn the pose of the last fix, `periods` frame periods ago, to where the camera looks."""
        most_periods = 10.0  # frame periods for which a turn goes on unseen
        # Change of the gaze by the axis from frame to frame that may be an error: 1.5 degrees in
        # clear pictures.
        noise_rad = 0.75 * self.gaze_rad
        pose, turn = fixed.pose, np.zeros(2)
        if self.gaze is not None:
            before = fixed.gaze if self._gaze_fixed is None else self._gaze_fixed
            turn = self.gaze - before
            turn = np.sign(turn) * np.maximum(np.abs(turn) - noise_rad, 0.0)
        elif self.is_around:
            turn = self._turn * min(periods, most_periods)
        yaw, pitch = turn.tolist()
        return replace(pose, yaw_rad=pose.yaw_rad + yaw, pitch_rad=pose.pitch_rad + pitch)

    def aim(self, pose: Pose, state: State) -> bool:
        """Choose the vantage of the next picture, and return whether it has changed.

        A camera that turns sees much more of one side of the wall and much less of the other.

        Args:
            pose: Predicted pose of the camera.
            state: State at the last frame.
        """
        pitch, roll = state.mount_rad
        at = replace(
            pose, x_mm=0.0, pitch_rad=pose.pitch_rad + pitch, roll_rad=pose.roll_rad + roll
        )
        vantage = self.view.vantage
        off = np.abs(at.vector - vantage.vector)
        strays = bool((off > np.maximum(self._stray, CERTAINLY_APART * state.absolute_sigma)).any())
        if self.gaze is not None:
            aside = np.abs(self.gaze - (vantage.yaw_rad, vantage.pitch_rad))
            strays |= bool((aside > self._unlike_rad).any())
        if strays:
            self.view = self._locator.view(self._rectify.at(at), self._overlay.mask)
        return strays

    def mask(self) -> None:
        """Take over the mask of the overlay."""
        self.view = self._locator.view(self.view.rectify, self._overlay.mask)

    def follow(self, fix: Fix, before: State, periods: float) -> Fix:
        """Add a frame with a fix, and see whether the camera looks around.

        Args:
            fix: The fix.
            before: State at the fix before.
            periods: Frame periods between the two.
        Returns:
            The fix, at the place that the wall alone shows if a robot that was held drives.
        """
        memory_mm = 20.0  # way over which the driving direction is averaged
        now, x_mm = fix.state.gaze, fix.pose.x_mm
        self._gaze_fixed = self.gaze
        self._turn = (now - before.gaze) / periods
        if self._ahead is None:
            self._ahead, self._last_mm = now, x_mm
        self._drives = self._drives + 1 if self.is_around and self._is_elsewhere(fix) else 0
        if self._drives >= SURE_FRAMES:
            fix = fix.unheld
            self._ahead, x_mm = now, fix.pose.x_mm
        driven = 1 - np.exp(-abs(x_mm - self._last_mm) / memory_mm)
        ahead = self._ahead + (now - self._ahead) * driven
        aside_rad = float(np.abs(now - ahead).max())
        self.is_around = aside_rad > (BACK_RAD if self.is_around else ASIDE_RAD)
        if not self.is_around:
            self._ahead, self._last_mm = ahead, x_mm
        return fix

    def _is_elsewhere(self, fix: Fix) -> bool:
        """Whether the wall alone shows the robot elsewhere than where it is held."""
        # Error of the distance while a robot stands and its camera turns, one sigma.
        stands_mm = 1.0
        off_mm = fix.unheld.pose.x_mm - self._last_mm
        sigma_mm = np.hypot(np.sqrt(fix.change_variance[0]), stands_mm)
        return bool(abs(off_mm) > CERTAINLY_APART * sigma_mm)
