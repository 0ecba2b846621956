"""The method of "Monocular visual odometry for in-pipe inspection robot", exactly as published.

It serves comparison and teaching; use `Odometry` for measurements.  Nothing is added to the paper's
method: no window, no sub-pixel peak, no keyframe and no rejection, and the wall is a plane.
"""

from __future__ import annotations

import cv2
import numpy as np

from vo_core.errors import InvalidRig
from vo_core.geometry.initial_pose import AS_STATED
from vo_core.geometry.wall import Pose
from vo_core.image.resample import grey_frame
from vo_core.rig import Camera, Rig
from vo_core.track import Estimate
from vo_core.types import GrayImage, Image

ANGLES_DEG = tuple(range(-10, 11))
"""Rotations that are tried: theta = -10 .. 10 degrees, equation (7)."""


def phase_correlation(previous: Image, current: Image) -> GrayImage:
    """c of equations (5) and (6), (H, W), from two spectra; 1 at a perfect match.

    F{C} = F{I_t-1} F*{I_t} / |F{I_t-1} F*{I_t}|, c = F^-1{C}, element by element. The maximum lies
    at minus the motion of the content.
    """
    product = cv2.mulSpectrums(previous, current, 0, conjB=True)
    magnitude = cv2.magnitude(product[..., 0], product[..., 1])
    product = product / np.maximum(magnitude, 1e-9)[..., None]
    flags = cv2.DFT_INVERSE | cv2.DFT_SCALE | cv2.DFT_REAL_OUTPUT
    return np.asarray(cv2.dft(product, flags=flags))


def displacement(previous: GrayImage, current: GrayImage) -> tuple[float, float, float, float]:
    """(dx px, dy px, dtheta deg, peak): equations (6) and (7).

    dtheta is the rotation of I_t-1 with the highest peak; (dx, dy) is the position of that peak.
    """
    height, width = previous.shape
    centre = ((width - 1) / 2, (height - 1) / 2)
    spectrum = cv2.dft(current, flags=cv2.DFT_COMPLEX_OUTPUT)
    best = (0.0, 0.0, 0.0, -np.inf)
    for theta_deg in ANGLES_DEG:
        # OpenCV counts angles in the opposite sense, from x towards -y.
        turn = cv2.getRotationMatrix2D(centre, -theta_deg, 1.0)
        turned = cv2.warpAffine(previous, turn, (width, height), flags=cv2.INTER_LINEAR)
        surface = phase_correlation(cv2.dft(turned, flags=cv2.DFT_COMPLEX_OUTPUT), spectrum)
        row, column = divmod(int(surface.argmax()), width)
        peak = float(surface[row, column])
        if peak > best[3]:
            dx = column - width if column > width / 2 else column
            dy = row - height if row > height / 2 else row
            best = (float(dx), float(dy), float(theta_deg), peak)
    return best


def wall_motion_mm(
    camera: Camera, height_mm: float, dx_px: float, dy_px: float
) -> tuple[float, float]:
    """(dX, dY) in mm in the camera's axes: equation (8).

    dY = dy Z / fy,  dX = (dx - (alpha / Z) dY) Z / fx.  The paper prints alpha without a unit;
    with K's off-diagonal term in px, u = fx X/Z + alpha Y/Z + cx gives dx = (fx dX + alpha dY) /
    Z, which is the same equation: (alpha / Z) dY is px, since Z and dY are both mm.
    """
    dy_mm = dy_px * height_mm / camera.fy
    dx_mm = (dx_px - camera.skew / height_mm * dy_mm) * height_mm / camera.fx
    return dx_mm, dy_mm


class PaperOdometry:
    """Tracks frame to frame by the paper's equations, chained to [X, Y, theta].

    Raises:
        InvalidRig: The camera does not look down; the paper has no equations for that.
    """

    def __init__(self, rig: Rig) -> None:
        if rig.mount.view != "down":
            raise InvalidRig("mount.view: the paper's method needs a camera that looks down.")
        self.rig = rig
        self.initial_pose = AS_STATED
        """Where the rig states: the method estimates no other place."""
        self._previous: GrayImage | None = None
        self._x_mm = self._y_mm = self._yaw_rad = 0.0
        self._variance_mm2 = 0.0
        self._frame = 0

    def step(self, image: Image, t_s: float) -> Estimate:
        """Estimate the pose of the next frame; the paper rejects none, so the status is always
        `ok`.

        Raises:
            ShapeMismatch: The size of the image is not the one that the rig states.
        """
        camera, height_mm = self.rig.camera, self.rig.mount.height_mm
        current = np.asarray(grey_frame(camera, image), np.float32)
        peak = 1.0
        if self._previous is not None:
            dx_px, dy_px, theta_deg, peak = displacement(self._previous, current)
            self._chain(
                *wall_motion_mm(camera, height_mm, dx_px, dy_px), float(np.radians(theta_deg))
            )
            # The only error that the method knows: the peak lies on a whole pixel.
            self._variance_mm2 += (height_mm / camera.fx) ** 2 / 12
        self._previous = current
        self._frame += 1
        sigma_mm = float(np.sqrt(self._variance_mm2))
        return Estimate.of(
            Pose(self._x_mm, self._y_mm, self._yaw_rad),
            frame=self._frame - 1,
            time_s=t_s,
            sigma_distance_mm=sigma_mm,
            quality=float(np.clip(peak, 0.0, 1.0)),
            status="ok",
            sigma_registration_mm=sigma_mm,
        )

    def _chain(self, dx_mm: float, dy_mm: float, turn_rad: float) -> None:
        """Add a step; the content turned by `turn_rad`, so the camera turned by minus that.

        The peak of (5) lies at minus the motion of the content. That is the motion of the camera in
        the axes of the current picture, as the reference was rotated before it was correlated.
        """
        mount_rad = float(np.radians(self.rig.mount.rotation_deg))
        heading_rad = self._yaw_rad - turn_rad + mount_rad
        self._x_mm += np.cos(heading_rad) * dx_mm - np.sin(heading_rad) * dy_mm
        self._y_mm += np.sin(heading_rad) * dx_mm + np.cos(heading_rad) * dy_mm
        self._yaw_rad -= turn_rad
