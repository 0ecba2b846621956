"""How well each part of a picture resolves the wall, and where the wall lies in the picture."""

from __future__ import annotations

from dataclasses import replace
from math import ceil, floor

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.errors import InvalidRig
from vo_core.geometry.rectify import developed, no_wall_in_view
from vo_core.geometry.wall import Points, Pose, enclose, robot_pixels, sight
from vo_core.matching.blocks import BlockGrid
from vo_core.mosaic.layout import NODE_PX
from vo_core.rig import Rig
from vo_core.types import ByteImage, GrayImage, Matrix

Mask = NDArray[np.bool_]

PEAK = 1000.0
"""Weight of the best place of a picture; large, because `cv2.blendLinear` adds 1e-5 to it."""

LEAST_SIDE_PX = 8
"""Shortest side of a reduced picture from which a mosaic can be painted."""

COARSER = 2.0
"""A place is painted if its mm per px is at most this many times the finest of its lane."""

LANES = 64
"""Number of lanes into which the arc is divided."""

SHORTEST = 0.3
"""Least view of the pipe in a lane that is painted, relative to the longest.

A lane with a shorter view, as in the corners of a turned camera, passes too quickly and would be
painted with gaps."""

RIDGE = 8
"""The weight falls to a quarter within this fraction of the length of the view."""

BORDER = 0.08
"""Share of the shorter side over which the weight rises from the border of the picture."""

TURN_RAD = 0.12
"""Largest turn of a robot for which the canvas has a margin."""

_STEP_PX = 4
"""The optics are computed at every 4th pixel of the frame in each direction."""


class Optics:
    """The picture, reduced to the resolution of a mosaic, with weights.

    Raises:
        InvalidRig: The camera sees no wall.
    """

    def __init__(self, rig: Rig, mm_per_px: float) -> None:
        camera = rig.camera
        self._frame_wh = np.array([camera.width, camera.height])
        u, v = np.meshgrid(
            np.arange(0.0, camera.width, _STEP_PX), np.arange(0.0, camera.height, _STEP_PX)
        )
        wall_mm = developed(rig, np.stack([u, v], -1).reshape(-1, 2)).reshape(*u.shape, 2)
        resolution = _resolution(wall_mm)
        if not _seen(wall_mm, resolution).any():
            raise no_wall_in_view(rig)
        finest_mm = float(np.nanmin(resolution))
        reduction = max(1, floor(mm_per_px / finest_mm))
        self.size_wh = (round(camera.width / reduction), round(camera.height / reduction))
        if min(self.size_wh) < LEAST_SIDE_PX:
            raise InvalidRig(
                f"One place of the picture shows the wall {reduction} times finer than the rest: "
                "the lens is not that near to the wall. Check mount.height_mm and the tilts."
            )
        self.good = _good(wall_mm, resolution)
        """(H / 4, W / 4), whether the wall is resolved finely enough there."""
        self.log_resolution = np.log(np.where(self.good, resolution, finest_mm) / finest_mm)
        """(H / 4, W / 4) logarithm of mm per px over the finest, so 0 where the picture is
        finest."""
        axial_mm = wall_mm[..., 0]
        self.axial_mm = (float(axial_mm[self.good].min()), float(axial_mm[self.good].max()))
        """Axial range of the painted wall, from the camera."""
        weight = _weights(axial_mm, self.log_resolution, self.good).astype(np.float32)
        self.weight = np.asarray(
            cv2.resize(weight, self.size_wh, interpolation=cv2.INTER_LINEAR), np.float32
        )
        """Weight of each place of the reduced picture, 0 to `PEAK`."""

    def reduce(self, picture: ByteImage) -> ByteImage:
        """Reduce a picture to the size of `weight`, (H, W, 3) as Y Cr Cb."""
        if picture.shape[1::-1] != self.size_wh:
            picture = np.asarray(
                cv2.resize(picture, self.size_wh, interpolation=cv2.INTER_AREA), np.uint8
            )
        if picture.ndim == 2:
            picture = np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), np.uint8)
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YCrCb), np.uint8)

    def reduced_px(self, uv: Points) -> Points:
        """Convert pixels of the frame to pixels of the reduced picture."""
        return np.asarray((uv + 0.5) * (np.array(self.size_wh) / self._frame_wh) - 0.5)


def _resolution(wall_mm: Points) -> Matrix:
    """mm of wall per pixel of the frame, along the row or the column, whichever is larger."""
    along_u, along_v = (
        np.linalg.norm(np.gradient(wall_mm, float(_STEP_PX), axis=axis), axis=-1) for axis in (1, 0)
    )
    coarser = np.maximum(along_u, along_v)
    # Where the arc jumps at the crown, the neighbours have the right value.
    filled = np.where(np.isfinite(coarser), coarser, np.inf)
    least = np.asarray(cv2.erode(filled, np.ones((5, 5), np.uint8)), np.float64)
    return np.where(np.isfinite(least), least, np.nan)


def _seen(wall_mm: Points, resolution: Matrix) -> Mask:
    return np.asarray(np.isfinite(wall_mm).all(-1) & np.isfinite(resolution))


def _good(wall_mm: Points, resolution: Matrix) -> Mask:
    """Where a picture resolves the wall nearly as finely as anywhere in the same lane."""
    seen = _seen(wall_mm, resolution)
    arc_mm = np.where(seen, wall_mm[..., 1], 0.0)
    low_mm, high_mm = arc_mm[seen].min(), arc_mm[seen].max()
    lane = np.clip((arc_mm - low_mm) / (high_mm - low_mm) * LANES, 0, LANES - 1).astype(np.int64)
    finest = np.full(LANES, np.inf)
    np.minimum.at(finest, lane[seen], resolution[seen])
    with np.errstate(invalid="ignore"):
        good = seen & (resolution <= COARSER * finest[lane])
    length = _longest_run(lane[good], wall_mm[..., 0][good])
    return np.asarray(good & (length[lane] > SHORTEST * length.max()))


def _longest_run(lane: NDArray[np.int64], axial_mm: Matrix) -> Matrix:
    """(lanes,) longest view of the pipe without a gap in each lane, as a share of the whole."""
    low_mm, high_mm = axial_mm.min(), axial_mm.max()
    place = ((axial_mm - low_mm) / (high_mm - low_mm) * (LANES - 1)).astype(np.int64)
    seen = np.zeros((LANES, LANES), np.uint8)
    seen[lane, place] = 1
    # Far away, neighbouring pixels lie some places apart.
    seen = np.asarray(cv2.morphologyEx(seen, cv2.MORPH_CLOSE, np.ones((1, 7), np.uint8)), np.uint8)
    longest, run = np.zeros(LANES), np.zeros(LANES)
    for column in seen.T:
        run = (run + 1) * column
        longest = np.maximum(longest, run)
    return longest / LANES


def _weights(axial_mm: Matrix, log_resolution: Matrix, good: Mask) -> Matrix:
    """Weights of the parts of the picture: highest where it is finest, and 0 at the border.

    They form a narrow ridge across the pipe: averaged over the whole view, an error of the camera's
    height would show each crack twice.
    """
    inside = cv2.copyMakeBorder(good.astype(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    depth = np.asarray(cv2.distanceTransform(inside, cv2.DIST_L2, 5))[1:-1, 1:-1] - 1
    ramp = np.clip(depth / (BORDER * min(good.shape)), 0, 1)
    fine = ramp * np.exp(-4 * log_resolution)
    axial = np.where(good, axial_mm, 0.0)
    best_mm = (fine * axial).sum() / max(fine.sum(), 1e-12)
    off = (axial - best_mm) / (axial[good].max() - axial[good].min()) * RIDGE
    weight = fine / np.square(1 + off * off)
    return np.asarray(PEAK * weight / max(weight.max(), 1e-12))


class Canvas:
    """The part of the mosaic's raster that a camera sees from any usual pose.

    It moves along with the camera in whole columns; rows cover `arc_mm` evenly.
    """

    def __init__(
        self, rig: Rig, optics: Optics, arc_mm: tuple[float, float], rows: int, mm_per_px: float
    ) -> None:
        self._rig, self._optics, self._mm_per_px = rig, optics, mm_per_px
        begin_mm, end_mm = optics.axial_mm
        reach_mm = min(float(np.ptp(arc_mm)) / 2, rig.pipe.diameter_mm or np.inf)
        margin_mm = TURN_RAD * reach_mm
        self._begin = floor((begin_mm - margin_mm) / mm_per_px)
        blocks = ceil((end_mm - begin_mm + 2 * margin_mm) / mm_per_px / NODE_PX)
        self.columns = blocks * NODE_PX
        self._grid = BlockGrid(rows // NODE_PX, blocks, NODE_PX, 0, 0)
        column, row = self._grid.nodes().T
        axial_mm = (self._begin + column + 0.5) * mm_per_px
        row_mm = arc_mm[0] + (row + 0.5) * (arc_mm[1] - arc_mm[0]) / rows
        self._nodes = enclose(rig, np.column_stack([axial_mm, row_mm]))

    def first_column(self, distance_mm: float) -> int:
        """Column of the raster at which the canvas begins."""
        return floor(distance_mm / self._mm_per_px) + self._begin

    def positions(self, pose: Pose) -> GrayImage:
        """(rows, columns, 2): where each pixel of the canvas lies in the reduced picture."""
        # Axial coordinates from the nearest column keep their precision far into a pipe.
        near = replace(pose, x_mm=pose.x_mm % self._mm_per_px)
        uv = robot_pixels(self._rig, sight(self._rig, near, self._nodes))
        positions = self._grid.dense(self._optics.reduced_px(uv))
        blind = np.isnan(uv).any(1)
        if blind.any():  # no interpolation between a visible place and an invisible one
            near_blind = self._grid.dense(np.column_stack([blind, blind]).astype(np.float64))
            positions[near_blind[..., 0] > 0] = -1e4
        return positions
