"""Peers for a camera that looks down.

Each measures the shift, and some the rotation, from frame to frame, converts it to mm by the
pinhole equation and chains it. None models lens distortion, the cylinder or dirt on the glass.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import cv2
import numpy as np

from app.lab.peers.features import LEAST_MATCHES, OrbMatcher, klt_matches
from vo_core.errors import InvalidRig
from vo_core.image.resample import to_grey
from vo_core.rig import Rig
from vo_core.track import Estimate
from vo_core.types import Image, Matrix

Motion = tuple[float, float, float]
"""Motion of the content about the centre: dx px, dy px, rotation rad from x to y."""


class FrameToFrame(ABC):
    """Chains the motion between consecutive frames to [X, Y, theta].

    Raises:
        InvalidRig: The camera does not look down, so the pinhole equation has no height.
    """

    def __init__(self, rig: Rig) -> None:
        if rig.mount.view != "down":
            raise InvalidRig("mount.view: this method needs a camera that looks down.")
        self._mm_per_px = rig.mount.height_mm / np.array([rig.camera.fx, rig.camera.fy])
        self._mount_rad = float(np.radians(rig.mount.rotation_deg))
        self._before: Image | None = None
        self._position_mm = np.zeros(2)
        self._yaw_rad = 0.0
        self._frame = 0

    @abstractmethod
    def motion(self, before: Image, now: Image) -> Motion | None:
        """Measure the motion of the content between two (H, W) pictures; None if that fails."""

    def step(self, image: Image, t_s: float) -> Estimate:
        """Estimate the pose of the next frame; without a motion it is `lost` and the pose stays."""
        now = to_grey(image)
        moved = (0.0, 0.0, 0.0) if self._before is None else self.motion(self._before, now)
        if moved is not None:
            self._chain(*moved)
        self._before = now
        self._frame += 1
        x_mm, y_mm = self._position_mm.tolist()
        return Estimate(
            frame=self._frame - 1,
            time_s=t_s,
            x_mm=x_mm,
            y_mm=y_mm,
            yaw_deg=float(np.degrees(self._yaw_rad)),
            distance_mm=x_mm,
            sigma_distance_mm=0.0,
            quality=0.0 if moved is None else 1.0,
            status="lost" if moved is None else "ok",
            sigma_registration_mm=0.0,
        )

    def _chain(self, dx_px: float, dy_px: float, rotation_rad: float) -> None:
        """Move the camera opposite to the content, in the axes of the frame before."""
        heading_rad = self._yaw_rad + self._mount_rad
        forward_mm, right_mm = -_rotation(-rotation_rad) @ (dx_px, dy_px) * self._mm_per_px
        self._position_mm += _rotation(heading_rad) @ (forward_mm, right_mm)
        self._yaw_rad -= rotation_rad


class PhaseCorrelate(FrameToFrame):
    """`cv2.phaseCorrelate` under a Hann window."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        self._window = cv2.createHanningWindow((rig.camera.width, rig.camera.height), cv2.CV_32F)

    def motion(self, before: Image, now: Image) -> Motion | None:
        """Measure the shift only; it never fails."""
        # phaseCorrelate multiplies its inputs by the window in place; astype makes copies.
        (dx, dy), _ = cv2.phaseCorrelate(
            before.astype(np.float32), now.astype(np.float32), self._window
        )
        return dx, dy, 0.0


class SkimageCorrelation(FrameToFrame):
    """`skimage.registration.phase_cross_correlation`, to a fiftieth of a pixel."""

    def motion(self, before: Image, now: Image) -> Motion | None:
        """Measure the shift only; it never fails."""
        from skimage.registration import phase_cross_correlation

        (dy, dx), _, _ = phase_cross_correlation(now, before, upsample_factor=50)
        return float(dx), float(dy), 0.0


class Klt(FrameToFrame):
    """Corners tracked by pyramidal Lucas-Kanade, with a similarity by RANSAC."""

    def motion(self, before: Image, now: Image) -> Motion | None:
        """Measure shift and rotation; None with too few corners."""
        return _similarity(*klt_matches(before, now), now.shape)


class Orb(FrameToFrame):
    """Matched ORB features, with a similarity by RANSAC."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        self._matcher = OrbMatcher()

    def motion(self, before: Image, now: Image) -> Motion | None:
        """Measure shift and rotation; None with too few matches."""
        return _similarity(*self._matcher.matches(before, now), now.shape)


def _similarity(before: Matrix, now: Matrix, shape: tuple[int, ...]) -> Motion | None:
    if len(before) < LEAST_MATCHES:
        return None
    matrix, inliers = cv2.estimateAffinePartial2D(
        before, now, method=cv2.RANSAC, ransacReprojThreshold=1.5
    )
    if matrix is None or int(np.sum(inliers)) < LEAST_MATCHES:
        return None
    centre = (np.array(shape[1::-1]) - 1) / 2
    dx, dy = matrix[:, :2] @ centre + matrix[:, 2] - centre
    return float(dx), float(dy), float(np.arctan2(matrix[1, 0], matrix[0, 0]))


def _rotation(angle_rad: float) -> Matrix:
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[cos, -sin], [sin, cos]])
