"""The state that is estimated at each frame: pose, tilt of the mount, and the pose of frame 0."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vo_core.geometry.initial_pose import InitialPose
from vo_core.geometry.motion import POSE, RATES
from vo_core.geometry.tilt import MountTilt
from vo_core.geometry.wall import Pose
from vo_core.matching.align import Prior
from vo_core.rig import Rig
from vo_core.types import Matrix

START_SIGMA = {
    "circular": (1e-3, 4.0, np.radians(1), 1e-3, 1e-5, 1e-5),
    "flat": (1e-3, 0.5, np.radians(0.2), 1e-3, 1e-5, 1e-5),
}
"""Standard deviation of the first pose by shape of the pipe, in the order of `Pose`, mm and rad.

A film may begin anywhere on the path of a robot that sways; a pipe shows how the robot stands then.
On a floor the first pose defines the axes."""

ASIDE_AT_START = 0.035
"""Distance of the first pose from the pipe's axis, one sigma, as a share of the diameter, where the
camera looks along the pipe."""

TURNED_AT_START_RAD = np.radians(2.5)
"""Its turn against the axis, one sigma."""

RATE_SIGMA = np.array([100.0, 30.0, 0.3])
"""Standard deviation of the rate of x, y and yaw predicted from the frame before, mm/s and
rad/s."""

UNKNOWN_RATE = Prior(np.zeros(RATES), np.diag(1 / np.square(RATE_SIGMA)))
"""Prior of the rate before any motion was measured."""


def tilt_sigma_rad(rig: Rig) -> float:
    """Standard deviation of the mount's pitch and roll by the tolerance of the rig, rad."""
    return float(np.radians(max(rig.tolerance.tilt_deg, 1e-3)))  # 0 has no inverse


@dataclass(frozen=True)
class State:
    """Pose of the camera and tilt of the mount, with their covariance."""

    pose: Pose
    mount_rad: Matrix
    """(2,) pitch and roll of the mount against the rig."""
    covariance: Matrix
    """(8, 8): the pose in the order of `Pose`, then the mount."""
    rate: Prior
    """(3,) approximate change of x, y and yaw per second."""
    start: Matrix
    """(6,) current estimate of the pose of frame 0, in the order of `Pose`."""
    with_start: Matrix
    """(8, 6) covariance of pose and mount with `start`."""

    @classmethod
    def at_start(cls, rig: Rig, gaze: Matrix | None = None) -> State:
        """State before the first frame: the zero point, with the uncertainty of rig and pipe.

        `gaze` is (2,), yaw and pitch of a camera that looks ahead, if they are not the rig's.
        """
        tilt_rad = tilt_sigma_rad(rig)
        start = np.array(START_SIGMA[rig.pipe.shape])
        if rig.looks_along_pipe and rig.pipe.diameter_mm is not None:
            aside_mm = ASIDE_AT_START * rig.pipe.diameter_mm
            start[1:5] = aside_mm, TURNED_AT_START_RAD, aside_mm, TURNED_AT_START_RAD
        covariance = np.diag(np.square([*start, tilt_rad, tilt_rad]))
        yaw_rad, pitch_rad = (0.0, 0.0) if gaze is None else gaze.tolist()
        pose = Pose(yaw_rad=yaw_rad, pitch_rad=pitch_rad)
        return cls(
            pose=pose,
            mount_rad=np.zeros(2),
            covariance=covariance,
            rate=UNKNOWN_RATE,
            start=pose.vector,
            with_start=covariance[:, :POSE],
        )

    def shifted(self, x_mm: float, y_mm: float) -> State:
        """The same state after a move of the zero point."""
        return replace(self, pose=self.pose.shifted(x_mm, y_mm))

    def widened(self, variance: Matrix) -> State:
        """The same state, less certain by these variances, (8,)."""
        return replace(self, covariance=self.covariance + np.diag(variance))

    @property
    def tilt(self) -> MountTilt:
        """Tilt of the mount against the rig."""
        pitch, roll = np.degrees(self.mount_rad).tolist()
        variance = np.diag(self.covariance)[POSE:]
        pitch_sigma, roll_sigma = np.degrees(np.sqrt(variance)).tolist()
        return MountTilt(pitch, roll, pitch_sigma, roll_sigma)

    def start_in_pipe(self, rig: Rig) -> InitialPose:
        """Pose of the camera in the pipe at the first frame, as it is known by now.

        A camera that looks down is turned by its mount in the rig, see `tilt`; one that looks along
        the pipe shows only how it is turned in all.
        """
        _, y_mm, yaw, z_mm, pitch, roll = self.start.tolist()
        mount_rad = self.mount_rad if rig.looks_along_pipe else np.zeros(2)
        yaw_deg, pitch_deg, roll_deg = np.degrees([yaw, *mount_rad + (pitch, roll)]).tolist()
        return InitialPose(y_mm, yaw_deg, z_mm, pitch_deg, roll_deg)

    @property
    def gaze(self) -> Matrix:
        """(2,) yaw and pitch of the camera in the pipe, rad."""
        return np.array([self.pose.yaw_rad, self.pose.pitch_rad + self.mount_rad[0]])

    @property
    def absolute_sigma(self) -> Matrix:
        """(6,) standard deviation of the camera's pose in the pipe, with the tilt of the mount."""
        whole = np.eye(POSE, POSE + 2)
        whole[4, POSE] = whole[5, POSE + 1] = 1.0
        return np.asarray(np.sqrt(np.diag(whole @ self.covariance @ whole.T)))

    def known_to(self, tilt_rad: float) -> State:
        """Limit the mount's uncertainty to what the rig states, `tilt_rad`.

        Where the rig is wrong, blocks disagree, and each keyframe adds their scatter to the
        uncertainty that it inherits.  A tilt that the pictures hardly show (the roll of a fisheye
        on the axis of the pipe) would then drift without bound, and the estimated sway with it.
        So the rig's statement is fused in again as far as it was forgotten (Kalman 1960).
        """
        mean, start = np.concatenate([self.pose.vector, self.mount_rad]), self.start
        covariance, with_start = self.covariance, self.with_start
        for tilt in (POSE, POSE + 1):
            variance = covariance[tilt, tilt]
            if variance > tilt_rad**2:
                forgotten = 1 / (1 / tilt_rad**2 - 1 / variance)
                gain = covariance[:, tilt] / (variance + forgotten)
                start = start - with_start[tilt] / (variance + forgotten) * mean[tilt]
                with_start = with_start - np.outer(gain, with_start[tilt])
                mean = mean - gain * mean[tilt]
                covariance = covariance - np.outer(gain, covariance[tilt])
        return State(Pose.of(mean[:POSE]), mean[POSE:], covariance, self.rate, start, with_start)
