"""Resamples every frame onto the developed wall of the known pipe.

There the robot's motion is nearly one shift of the whole picture (see `motion` for the rest), for
any lens and mount. This makes the paper's direct method valid in a pipe, not only over a plane.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np

from vo_core.errors import NoWallInView
from vo_core.geometry.wall import (
    NOMINAL,
    Points,
    Pose,
    cast,
    develop,
    enclose,
    in_camera,
    project,
    robot_rays,
    rotation,
    sight,
)
from vo_core.image.resample import grey_frame, reduce_to
from vo_core.rig import Rig
from vo_core.types import AnyImage, ByteImage, GrayImage, Image, Matrix

PATCH_SIDE_PX = 320
"""Approximate longest side of a patch.

Frames are first reduced to this size, or to twice this size (see `EVEN`), because noise and cost
fall with the square of the reduction."""

COARSEST = 3.0
"""Parts of the picture whose pixels cover this many times the finest mm per px are left out."""

BEYOND_RING = 1.1
"""A camera that looks ahead sees a whole ring of the wall only from some distance on; the patch
reaches at least this many times as far."""

EVEN = 1.3
"""Above this unevenness frames are averaged on the wall instead of in the picture.

Where the picture is compressed towards its border, an average in the picture lies outward of its
centre, and every distance reads too long (by 0.06 % looking forward)."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Every `step`-th row of a picture from the row `first` on."""

    first: int
    step: int

    def of(self, image: AnyImage) -> AnyImage:
        """Select these rows of a picture, (H / step, W, ...)."""
        return image[self.first :: self.step]


WHOLE = Rows(0, 1)
TOP = Rows(0, 2)
"""The top field of an interlaced picture."""
BOTTOM = Rows(1, 2)
"""The bottom field of an interlaced picture."""


@dataclass(frozen=True)
class PatchGrid:
    """An even raster over the rectangle of the developed wall that a rig sees."""

    axial_mm: float
    """Axial coordinate of the centre of pixel (0, 0), from the camera."""
    arc_mm: float
    """Arc coordinate of the centre of pixel (0, 0)."""
    mm_per_px: float
    shape: tuple[int, int]
    """(rows along the arc, columns along the axis)."""

    def to_mm(self, xy_px: Points) -> Points:
        """Convert (..., 2) patch pixels (column, row) to (axial mm, arc mm)."""
        return np.asarray(xy_px * self.mm_per_px + (self.axial_mm, self.arc_mm))

    def to_px(self, axial_arc_mm: Points) -> Points:
        """Convert (..., 2) (axial mm, arc mm) to patch pixels (column, row)."""
        return np.asarray((axial_arc_mm - (self.axial_mm, self.arc_mm)) / self.mm_per_px)

    def common(self, one: Pose, other: Pose) -> float:
        """Approximate share of the wall in view that is seen from both poses."""
        rows, columns = self.shape
        axial = abs(other.x_mm - one.x_mm) / (columns * self.mm_per_px)
        arc = abs(other.y_mm - one.y_mm) / (rows * self.mm_per_px)
        return max(0.0, 1 - axial) * max(0.0, 1 - arc)

    def finer(self, times: int) -> PatchGrid:
        """The same rectangle with each pixel divided into `times` by `times`."""
        step_mm = self.mm_per_px / times
        back_mm = (self.mm_per_px - step_mm) / 2
        rows, columns = self.shape
        return PatchGrid(
            self.axial_mm - back_mm, self.arc_mm - back_mm, step_mm, (times * rows, times * columns)
        )


class Rectifier:
    """Resamples frames of one rig onto the developed wall, with maps that are computed once.

    Patches are (rows, columns); columns run forward along the pipe and rows to the right.
    `unevenness` is the picture's coarsest resolution on the wall over its finest, 1 to
    `COARSEST` or more.
    The maps hold for a camera at the pose `vantage`; another one sees the wall a little bent.

    Raises:
        NoWallInView: The camera sees no wall, or too narrow a strip of it.
    """

    def __init__(self, rig: Rig, *, coarsest: float = COARSEST) -> None:
        """`coarsest` replaces `COARSEST`, for a patch that reaches farther."""
        self.rig = rig
        self.vantage = NOMINAL
        camera = rig.camera
        longest = max(camera.width, camera.height)
        self.grid, self.unevenness = _visible_grid(rig, coarsest)
        self._fineness = 1 if self.unevenness < EVEN else 2
        reduction = max(1.0, longest / (self._fineness * PATCH_SIDE_PX))
        self._frame_wh = (camera.width, camera.height)
        self._reduced_wh = (round(camera.width / reduction), round(camera.height / reduction))
        self._maps, self.valid = self._lookup(self.grid.finer(self._fineness))
        if not self.valid.any():  # the patch is that of a camera along the pipe
            raise no_wall_in_view(rig)
        self._field_rows: dict[Rows, Image] = {}

    def at(self, vantage: Pose) -> Rectifier:
        """A rectifier of the same grid for a camera that stands at `vantage`, at x = 0."""
        other = copy(self)
        other.vantage = vantage
        other._maps, other.valid = other._lookup(self.grid.finer(self._fineness))
        other._field_rows = {}
        return other

    def shows(self, mask: ByteImage) -> ByteImage:
        """Resample a mask of the frame, of any size, to the patch: 1 where any of it is 1."""
        import cv2

        whole = cv2.resize(mask, self._reduced_wh, interpolation=cv2.INTER_NEAREST)
        fine = cv2.remap(whole, *self._maps, cv2.INTER_NEAREST)
        rows, columns = self.grid.shape
        n = self._fineness
        return np.asarray(fine.reshape(rows, n, columns, n).max((1, 3)), np.uint8)

    def __call__(self, image: Image, rows: Rows = WHOLE) -> GrayImage:
        """Resample a frame to its patch, (rows, columns) float32, meaningless outside `valid`.

        Args:
            rows: The rows of the frame to use, each at its own place.
        Raises:
            ShapeMismatch: The size of the frame is not the one that the rig states.
        """
        import cv2

        seen = rows.of(grey_frame(self.rig.camera, image))
        reduced = reduce_to(seen, self._reduced(seen.shape[0]))
        maps = (self._maps[0], self._rows_in(rows, seen.shape[0]))
        # The border is continued outside the frame, because a black edge would count as texture.
        fine = cv2.remap(reduced, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return reduce_to(fine, self.grid.shape[::-1])

    def _reduced(self, height: int) -> tuple[int, int]:
        """Width and height to which a frame, or a field of `height` rows, is reduced."""
        return self._reduced_wh[0], min(self._reduced_wh[1], height)

    def _rows_in(self, rows: Rows, height: int) -> Image:
        """The row map for the reduced picture of these rows of a frame, `height` of them.

        Each ray keeps its place in the frame, so nothing moves by half a row as it would if a field
        were doubled.
        """
        if rows == WHOLE:
            return self._maps[1]
        if rows not in self._field_rows:
            in_frame = (self._maps[1] + 0.5) * (self._frame_wh[1] / self._reduced_wh[1]) - 0.5
            in_field = (in_frame - rows.first) / rows.step
            places = (in_field + 0.5) * (self._reduced(height)[1] / height) - 0.5
            self._field_rows[rows] = places.astype(np.float32)
        return self._field_rows[rows]

    def _lookup(self, fine: PatchGrid) -> tuple[tuple[Image, Image], ByteImage]:
        """Positions of the fine grid in the reduced frame, and the mask of the patch."""
        rows, columns = fine.shape
        # The axial coordinate turns each ray by the same vector along a row, so rays are sums.
        row_mm = fine.to_mm(np.stack([np.zeros(rows), np.arange(rows)], 1).astype(np.float64))
        first = sight(self.rig, self.vantage, enclose(self.rig, row_mm))
        ahead = fine.mm_per_px * rotation(self.vantage)[0]
        x, y, z = (
            first[:, None] + ahead * np.arange(columns)
            for first, ahead in zip(
                in_camera(self.rig, first).T, in_camera(self.rig, ahead), strict=True
            )
        )
        uv = project(self.rig.camera, x, y, z)
        inside = np.ones((rows, columns), np.bool_)
        maps = []
        for places, whole, reduced in zip(uv, self._frame_wh, self._reduced_wh, strict=True):
            with np.errstate(invalid="ignore"):
                inside &= (places >= 0) & (places <= whole - 1)
            scaled = (np.nan_to_num(places, nan=-1.0) + 0.5) * (reduced / whole) - 0.5
            maps.append(scaled.astype(np.float32))
        n = self._fineness
        valid = np.all(inside.reshape(rows // n, n, columns // n, n), axis=(1, 3))
        return (maps[0], maps[1]), np.asarray(valid, np.uint8)


def require_wall_in_view(rig: Rig) -> None:
    """Check that the camera of a rig sees enough of the wall.

    Raises:
        NoWallInView: It sees none, or too narrow a strip of it.
    """
    Rectifier(rig)


def no_wall_in_view(rig: Rig) -> NoWallInView:
    """The error for a camera in which no pixel shows the wall, with what to check."""
    mount = rig.mount
    return NoWallInView(
        f"With this rig the camera looks past the wall: view '{mount.view}', pitch_deg "
        f"{mount.pitch_deg:g}, roll_deg {mount.roll_deg:g}. Check which way it looks, and the "
        "signs of the tilts: nose up and right side down are positive."
    )


def _visible_grid(rig: Rig, coarsest: float) -> tuple[PatchGrid, float]:
    """Bounding rectangle of the wall that the picture shows finely enough (see `COARSEST`).

    The second value is the unevenness: the coarsest mm per px there over the finest.
    """
    least_px = 16  # shortest side of a patch on which motion can be measured
    # Sides of a patch are multiples of this: reductions by whole numbers are many times faster.
    multiple_px = 4
    camera = rig.camera
    if rig.looks_along_pipe:
        rig = _straight(rig)
    u = np.linspace(0, camera.width - 1, 65)
    v = np.linspace(0, camera.height - 1, 49)
    wall_mm = developed(rig, np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)).reshape(49, 65, 2)
    along_u = _lengths_mm(rig, np.diff(wall_mm, axis=1))[:-1] / (u[1] - u[0])
    along_v = _lengths_mm(rig, np.diff(wall_mm, axis=0))[:, :-1] / (v[1] - v[0])
    mm_per_px = np.maximum(along_u, along_v)  # (48, 64), nan where no wall is seen
    if np.isnan(mm_per_px).all():
        raise no_wall_in_view(rig)
    finest = float(np.nanmin(mm_per_px))
    with np.errstate(invalid="ignore"):
        good = mm_per_px <= coarsest * finest
        if rig.looks_along_pipe:
            good |= wall_mm[:-1, :-1, 0] <= BEYOND_RING * _ring_mm(wall_mm)
    corners = np.zeros((49, 65), bool)
    corners[:-1, :-1] |= good
    corners[1:, 1:] |= good
    points = wall_mm[corners]
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    # No more pixels than the reduced frame has: with a wide lens more would add cost and no detail.
    least_mm = float(np.sqrt(np.prod(high - low) / (camera.width * camera.height)))
    reduction = max(1.0, max(camera.width, camera.height) / PATCH_SIDE_PX)
    step_mm = max(float(np.median(mm_per_px[good])), least_mm) * reduction
    size = np.floor((high - low) / step_mm).astype(int) + 1
    columns, rows = size // multiple_px * multiple_px
    if min(columns, rows) < least_px:
        raise NoWallInView(
            f"With this rig the camera sees a strip of wall of {columns}x{rows} px only, too "
            "narrow to measure on. Check which way it looks, its tilts, and that the lens is that "
            "of this film."
        )
    axial, arc = (low + high) / 2 - (np.array([columns, rows]) - 1) / 2 * step_mm
    grid = PatchGrid(float(axial), float(arc), step_mm, (int(rows), int(columns)))
    return grid, float(mm_per_px[good].max()) / finest


def _straight(rig: Rig) -> Rig:
    """The rig with its camera on the axis of the pipe and along it: it may look anywhere later."""
    mount = {"pitch_deg": 0.0, "roll_deg": 0.0}
    if rig.pipe.diameter_mm is not None:
        mount |= {"lateral_mm": 0.0, "height_mm": rig.pipe.diameter_mm / 2}
    return rig.model_copy(update={"mount": rig.mount.model_copy(update=mount)})


def _lengths_mm(rig: Rig, steps_mm: Matrix) -> Matrix:
    """Lengths of steps on the developed wall, (..., 2); at the crown the arc begins anew."""
    axial, arc = np.moveaxis(steps_mm, -1, 0)
    if rig.pipe.radius_mm is not None:
        half_mm = np.pi * rig.pipe.radius_mm
        arc = np.remainder(arc + half_mm, 2 * half_mm) - half_mm
    return np.asarray(np.hypot(axial, arc))


def _ring_mm(wall_mm: Matrix) -> float:
    """Distance from which on a whole ring of the wall is in the picture; 0 if none is.

    `wall_mm` is (rows, columns, 2), the developed wall under points spread over the picture.
    """
    border = [wall_mm[0], wall_mm[-1], wall_mm[:, 0], wall_mm[:, -1]]
    farthest = max(float(side[:, 0].max()) for side in border)  # nan is none
    return farthest if farthest < np.nanmax(wall_mm[..., 0]) / BEYOND_RING else 0.0


def developed(rig: Rig, pixels_uv: Points) -> Points:
    """Project pixels to (axial mm, arc mm) from the nominal pose; nan where no wall is seen."""
    return develop(rig, cast(rig, NOMINAL, robot_rays(rig, pixels_uv)))
