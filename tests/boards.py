"""Rendered pictures of calibration boards, by ray casting onto a plane, with known intrinsics."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vo_core.geometry.wall import pixel_rays
from vo_core.rig import Camera
from vo_core.types import ByteImage, Matrix

SQUARE_MM, MARKER_MM = 20.0, 15.0
TEXTURE_PX_PER_MM = 6
FINER = 2
"""Rays for each pixel, along the rows and along the columns."""

PINHOLE = Camera(
    model="pinhole",
    width=640,
    height=480,
    fx=612.0,
    fy=615.0,
    cx=324.0,
    cy=236.0,
    skew=0.0,
    distortion=[-0.21, 0.07, 0.0008, -0.0005],
)
FISHEYE = Camera(
    model="fisheye",
    width=640,
    height=480,
    fx=282.0,
    fy=283.0,
    cx=318.0,
    cy=243.0,
    skew=0.0,
    distortion=[0.02, -0.006, 0.001, 0.0],
)


@dataclass(frozen=True)
class Print:
    """A printed board: its picture, `TEXTURE_PX_PER_MM`, with a white border of a square."""

    texture: ByteImage
    columns: int
    """Columns as `chainage calibrate` counts: inner corners of a checkerboard, squares of a
    ChArUco."""
    rows: int


def checkerboard(columns: int = 9, rows: int = 6) -> Print:
    side = round(SQUARE_MM * TEXTURE_PX_PER_MM)
    parity = np.indices((rows + 1, columns + 1)).sum(axis=0) % 2
    return Print(
        _bordered(np.kron(parity, np.ones((side, side))).astype(np.uint8) * 255), columns, rows
    )


def charuco(columns: int = 9, rows: int = 7, family: int = cv2.aruco.DICT_5X5_100) -> Print:
    words = cv2.aruco.getPredefinedDictionary(family)
    board = cv2.aruco.CharucoBoard((columns, rows), SQUARE_MM, MARKER_MM, words)
    side = round(SQUARE_MM * TEXTURE_PX_PER_MM)
    return Print(_bordered(board.generateImage((columns * side, rows * side))), columns, rows)


def _bordered(texture: ByteImage) -> ByteImage:
    border = round(SQUARE_MM * TEXTURE_PX_PER_MM)
    return cv2.copyMakeBorder(texture, *(border,) * 4, cv2.BORDER_CONSTANT, value=255)


class Studio:
    """Takes pictures of a board with one camera; the rays are computed once."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera
        u = (np.arange(camera.width * FINER) + 0.5) / FINER - 0.5
        v = (np.arange(camera.height * FINER) + 0.5) / FINER - 0.5
        uv = np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)
        self._rays = np.nan_to_num(pixel_rays(camera, uv)).astype(np.float32)

    def shoot(self, board: Print, tilt: Matrix, place_mm: Matrix) -> ByteImage:
        """Return the picture of a board, with its centre at `place_mm` before the camera, turned by
        `tilt`.
        """
        turn, _ = cv2.Rodrigues(np.asarray(tilt, np.float64))
        # Points of the plane p = place + R (x, y, 0) lie on the ray d where (d s - place) is in it.
        to_plane = np.linalg.inv(np.column_stack([turn[:, :2], place_mm])).astype(np.float32)
        a, b, depth = (self._rays @ to_plane.T).T
        with np.errstate(divide="ignore", invalid="ignore"):
            x_mm, y_mm = np.where(depth > 1e-6, [a / depth, b / depth], -1e6)
        height, width = board.texture.shape
        shape = (self.camera.height * FINER, self.camera.width * FINER)
        x = (x_mm * TEXTURE_PX_PER_MM + (width - 1) / 2).reshape(shape).astype(np.float32)
        y = (y_mm * TEXTURE_PX_PER_MM + (height - 1) / 2).reshape(shape).astype(np.float32)
        fine = cv2.remap(board.texture, x, y, cv2.INTER_LINEAR, borderValue=120)
        size = (self.camera.width, self.camera.height)
        light = 20 + 0.8 * cv2.resize(fine, size, interpolation=cv2.INTER_AREA).astype(np.float32)
        rng = np.random.default_rng(abs(int(1000 * place_mm[0])))  # the same whoever shot before
        noisy = light + rng.normal(0, 1.5, light.shape)
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def poses(
    count: int, distance_mm: float, spread: float, tilt_rad: float = 0.6
) -> list[tuple[Matrix, Matrix]]:
    """Of a board as a careful person holds it: tilted to all sides, all over the picture.

    Each is (rotation vector, place of the board's centre in mm).
    """
    found = []
    for n in range(count):
        around, reach = 2 * np.pi * n / count, spread * (0.55 + 0.45 * (n % 2))
        tilt = tilt_rad * np.array([np.sin(2.4 * n), np.cos(2.4 * n), 0.15 * np.sin(n)])
        direction = [1.15 * reach * np.cos(around), 0.85 * reach * np.sin(around), 1.0]
        found.append((tilt, distance_mm * (0.9 + 0.08 * (n % 4)) * np.array(direction)))
    return found
