"""A least-squares fit of a camera to boards by OpenCV, and the uncertainty of its fx."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from app.lab.calibration.boards import UnusableBoards, View
from vo_core.geometry.wall import Points
from vo_core.rig import Camera
from vo_core.types import Matrix

LEAST_VIEWS = 5
"""Least number of views; fewer do not determine the lens, as each adds a pose of its own."""

_FIELDS_RAD = (np.pi / 1.25, np.pi / 1.5)
"""Starting values of the angle that the longer side of a picture spans."""

Model = Literal["pinhole", "fisheye"]

_Arrays = list[NDArray[np.float32]]
"""The only type that calibrateCamera accepts."""


@dataclass(frozen=True)
class Lens:
    """A fitted camera and the poses of the boards, in OpenCV's terms."""

    model: Model
    views: Sequence[View]
    """Views that the fit explains."""
    matrix: Matrix
    distortion: Matrix
    turns: Sequence[Matrix]
    """Rotation vectors, board to camera."""
    places_mm: Sequence[Matrix]

    def residuals_px(self) -> list[Points]:
        """Residuals of each view, (N, 2): detected corner minus projected corner."""
        return [view.corners_px - self._project(n)[0] for n, view in enumerate(self.views)]

    def fx_sigma_px(self) -> float:
        """Standard deviation of fx: s^2 (J'J)^-1 of all corners, with the boards' poses eliminated.

        OpenCV returns it for the pinhole model only.
        """
        residuals_px = self.residuals_px()
        information: Matrix = np.zeros((0, 0))
        for n in range(len(self.views)):
            _, by_camera, by_pose = self._project(n)
            cross = by_pose.T @ by_camera
            own = by_camera.T @ by_camera - cross.T @ np.linalg.solve(by_pose.T @ by_pose, cross)
            information = own if n == 0 else information + own
        values = 2 * sum(len(residual) for residual in residuals_px)
        unknown = len(information) + 6 * len(self.views)
        variance_px2 = sum(float((r**2).sum()) for r in residuals_px) / (values - unknown)
        # px and powers of an angle, scaled to one size before inverting
        scale = np.sqrt(np.diag(information))
        cofactor = np.linalg.inv(information / np.outer(scale, scale))[0, 0] / scale[0] ** 2
        # Rounding makes it negative if the boards do not determine fx.
        return float(np.sqrt(variance_px2 * cofactor)) if cofactor > 0 else float("inf")

    def camera(self, size_wh: tuple[int, int]) -> Camera:
        """Convert to the camera part of a rig file.

        Raises:
            UnusableBoards: The values are impossible for a camera.
        """
        try:
            return Camera.model_validate(
                {
                    "model": self.model,
                    "width": size_wh[0],
                    "height": size_wh[1],
                    "fx": round(float(self.matrix[0, 0]), 4),
                    "fy": round(float(self.matrix[1, 1]), 4),
                    "cx": round(float(self.matrix[0, 2]), 4),
                    "cy": round(float(self.matrix[1, 2]), 4),
                    "distortion": [round(float(k), 8) for k in self.distortion],
                }
            )
        except ValidationError as error:
            fields = ", ".join(str(fault["loc"][0]) for fault in error.errors(include_url=False))
            raise UnusableBoards(
                f"The pictures give no possible camera ({fields}); tilt the board by 20 to 45 "
                "degrees to all sides."
            ) from error

    def _project(self, n: int) -> tuple[Points, Matrix, Matrix]:
        """Pixels (N, 2) of the corners of view n; derivatives (2 N, k) by camera and (2 N, 6)."""
        solid = self.views[n].corners_mm[None]
        camera = self.turns[n], self.places_mm[n], self.matrix, self.distortion
        pixels: Any
        slopes: Any
        if self.model == "fisheye":
            pixels, slopes = cv2.fisheye.projectPoints(solid, *camera)
            return pixels.reshape(-1, 2), slopes[:, :8], slopes[:, 8:14]
        pixels, slopes = cv2.projectPoints(solid, *camera)
        return pixels.reshape(-1, 2), slopes[:, 6:], slopes[:, :6]


def fit_lens(views: Sequence[View], model: Model, size_wh: tuple[int, int]) -> Lens:
    """Fit the lens to the boards; views that it cannot place are left out.

    Raises:
        UnusableBoards: No lens fits.
    """
    if model == "pinhole":
        return _fit_pinhole(views, size_wh)
    # From a guess, OpenCV misplaces boards far aside, which determine the lens best, or fails on
    # them.  Each lens from the other boards is a better start, until nearly all are placed.
    lens, placed = _first_fisheye(views, size_wh), 0
    while placed < len(views):
        try:
            start = lens.matrix, lens.distortion
            better = _fit_fisheye(views, size_wh, start, is_checked=True)
        except UnusableBoards:
            return lens
        if len(better.views) <= placed:
            return lens
        lens, placed = better, len(better.views)
    return lens


def _fit_pinhole(views: Sequence[View], size_wh: tuple[int, int]) -> Lens:
    solids, seen = _as_opencv(views)
    found: Sequence[Any]  # all of them float64, which the stubs do not state
    try:
        _, *found = cv2.calibrateCamera(solids, seen, size_wh, np.eye(3), np.zeros(4))
    except cv2.error as error:
        raise UnusableBoards("No pinhole lens fits these pictures.") from error
    matrix, distortion, turns, places_mm = found
    return Lens("pinhole", views, matrix, distortion.ravel(), turns, places_mm)


def _first_fisheye(views: Sequence[View], size_wh: tuple[int, int]) -> Lens:
    """Fit from OpenCV's own guess, or else from others: which one fails depends on rounding."""
    width, height = size_wh
    guesses: list[tuple[Matrix, Matrix] | None] = [None]
    for field_rad in _FIELDS_RAD:
        focal_px = max(size_wh) / field_rad
        matrix = np.array(
            [[focal_px, 0, (width - 1) / 2], [0, focal_px, (height - 1) / 2], [0, 0, 1]]
        )
        guesses.append((matrix, np.zeros(4)))
    for guess in guesses:
        try:
            # Unchecked, as good boards may look degenerate through a guessed lens.
            return _fit_fisheye(views, size_wh, guess, is_checked=False)
        except UnusableBoards as error:
            reason = error
    raise reason


def _fit_fisheye(
    views: Sequence[View],
    size_wh: tuple[int, int],
    start: tuple[Matrix, Matrix] | None,
    *,
    is_checked: bool,
) -> Lens:
    """Fit a fisheye lens to the views that OpenCV can place, which may not be all."""
    flags = cv2.CALIB_RECOMPUTE_EXTRINSIC | cv2.CALIB_FIX_SKEW
    matrix, distortion = np.eye(3), np.zeros(4)
    if start is not None:
        flags |= cv2.CALIB_USE_INTRINSIC_GUESS
        matrix, distortion = start
    if is_checked:
        flags |= cv2.CALIB_CHECK_COND
    kept = list(views)
    while True:
        solids, seen = _as_opencv(kept)
        try:
            found: Sequence[Any]
            _, *found = cv2.fisheye.calibrate(
                solids, seen, size_wh, matrix.copy(), distortion.copy(), flags=flags
            )  # copies, because both are changed in place
        except cv2.error as error:
            # One view fails the whole set (opencv/opencv#23962); only the message names it.
            culprit = re.search(r"input array (\d+)", str(error))
            if culprit is None or len(kept) <= LEAST_VIEWS:
                raise UnusableBoards(
                    "No fisheye lens fits these pictures; is it a pinhole?"
                ) from error
            del kept[int(culprit[1])]
        else:
            matrix, distortion, turns, places_mm = found
            return Lens("fisheye", kept, matrix, distortion.ravel(), turns, places_mm)


def _as_opencv(views: Sequence[View]) -> tuple[_Arrays, _Arrays]:
    """Convert corners in mm and in px to (1, N, k) each."""
    solids = [view.corners_mm[None].astype(np.float32) for view in views]
    return solids, [view.corners_px[None].astype(np.float32) for view in views]
