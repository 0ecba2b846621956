"""What is known of the camera at a frame: its pose, the tilt of its mount, and the first pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vo_core.geometry.motion import POSE, RATES
from vo_core.geometry.wall import Pose
from vo_core.matching.align import Prior
from vo_core.rig import Rig
from vo_core.types import Matrix

START_SIGMA = {
    "circular": (1e-3, 4.0, np.radians(1), 1e-3, 1e-5, 1e-5),
    "flat": (1e-3, 0.5, np.radians(0.2), 1e-3, 1e-5, 1e-5),
}
"""Of the first pose, in the order of `Pose`, mm and rad.  A film may begin anywhere on the way of a
robot that sways, and the pipe shows how it stands; on a floor the first pose defines the axes."""

LEAST_TILT_DEG = 1e-3
"""No mount is known better, so that its uncertainty can be inverted."""

RATE_SIGMA = np.array([100.0, 30.0, 0.3])
"""How well the change of x, y and yaw is known from the frame before, mm/s and rad/s."""

UNKNOWN_RATE = Prior(np.zeros(RATES), np.diag(1 / np.square(RATE_SIGMA)))
"""Before anything moved."""


def tilt_sigma_rad(rig: Rig) -> float:
    """How well the rig states pitch and roll of the mount, one sigma."""
    return float(np.radians(max(rig.tolerance.tilt_deg, LEAST_TILT_DEG)))


@dataclass(frozen=True)
class State:
    """A pose and the tilt of the mount, and how well both are known."""

    pose: Pose
    mount_rad: Matrix
    """(2,) pitch and roll of the mount against the rig."""
    covariance: Matrix
    """(8, 8), in the order of `Pose`, then the mount."""
    rate: Prior
    """(3,) change of x, y and yaw a second, about."""
    start: Matrix
    """(6,) pose of the first frame, as far as it is known by now, in the order of `Pose`."""
    with_start: Matrix
    """(8, 6) covariance of pose and mount with it."""

    @classmethod
    def at_start(cls, rig: Rig) -> State:
        """Before the first frame: at the zero point, as far as the rig and a pipe say."""
        tilt_rad = tilt_sigma_rad(rig)
        covariance = np.diag(np.square([*START_SIGMA[rig.pipe.shape], tilt_rad, tilt_rad]))
        return cls(
            pose=Pose(),
            mount_rad=np.zeros(2),
            covariance=covariance,
            rate=UNKNOWN_RATE,
            start=np.zeros(POSE),
            with_start=covariance[:, :POSE],
        )

    def known_to(self, tilt_rad: float) -> State:
        """The same with the mount known no worse than the rig states, one sigma `tilt_rad`.

        Where the rig is wrong, blocks disagree, and each keyframe adds their scatter to what it
        inherits.  A tilt that the pictures hardly show (the roll of a fisheye on the axis of the
        pipe) would drift away without bound, and with it the sway that it is seen by.  So what
        the rig states is fused in again as far as it was forgotten (Kalman 1960).
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
