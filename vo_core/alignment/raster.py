"""The texture of an unrolled wall, without light and rings, on a raster that two walls share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import ceil, floor, isclose, pi

import cv2
import numpy as np
from numpy.typing import NDArray

from vo_core.errors import InvalidRig
from vo_core.mosaic.layout import UNSEEN_GREY, Layout
from vo_core.types import ByteImage, GrayImage

FINEST_MM = 2.0
"""Finest pixel of the raster: a tenth of it is a fifth of a millimetre, finer than any track."""

MOST_ROWS = 480
"""Most pixels around the pipe."""

_DETAIL_MM = 24.0
"""What is larger than this counts as light, dirt or damp, and not as texture."""
_CONTRAST_MM = 60.0
"""The contrast is evened over this length."""
_STREAK_MM = 600.0
"""What stays the same over this length along the pipe is the camera's or the water's."""
_PIECE_MM = 12_000.0
_BORDER_MM = 800.0
"""The wall is filtered in pieces with borders, so that memory is bounded."""
_LEAST_GREY = 0.7
"""Contrast below which only noise and the coder are left."""
_UNSEEN_WITHIN = 6
"""Grey levels by which the coder changes what was not seen."""
_UNITS = 40.0
"""Steps of the texture per standard deviation."""

Texture = NDArray[np.int8]


@dataclass(frozen=True)
class Wall:
    """An unrolled wall whose tiles are read one by one."""

    layout: Layout
    girth_mm: float | None
    """Circumference of the pipe; None for a floor."""
    tiles: range
    """From the first tile to the last one; some between may be missing."""
    read: Callable[[int], ByteImage | None]
    """Reads the picture of a tile, (height_px, width_px, 3) BGR."""

    @property
    def length_mm(self) -> float:
        """From the first tile to the end of the last one."""
        return len(self.tiles) * self.layout.tile_mm


@dataclass(frozen=True)
class Raster:
    """Texture of a wall: column j is axial_mm + (j + 0.5) mm_per_px, rows go around likewise."""

    texture: Texture
    """(rows, columns), 0 on average; `_UNITS` is one standard deviation."""
    seen: NDArray[np.bool_]
    axial_mm: float
    arc_mm: float
    mm_per_px: float
    row_mm: float
    is_ring: bool
    """Whether the last row is followed by the first one."""

    @property
    def end_mm(self) -> float:
        """Axial coordinate at which it ends."""
        return self.axial_mm + int(self.texture.shape[1]) * self.mm_per_px

    def turned(self) -> Raster:
        """Return the wall as a camera sees it that comes from the other end.

        Its x axis points to the other end and its y axis to the other side, so that both
        coordinates of a place change their sign: the picture is turned by half a turn.
        """
        return replace(
            self,
            texture=self.texture[::-1, ::-1],
            seen=self.seen[::-1, ::-1],
            axial_mm=-self.end_mm,
            arc_mm=-(self.arc_mm + self.texture.shape[0] * self.row_mm),
        )

    def part(self, from_mm: float, to_mm: float, scale: float = 1.0) -> tuple[GrayImage, GrayImage]:
        """Cut out the wall between two places, stretched along the pipe by `scale`.

        Returns:
            Texture in standard deviations, 0 where nothing was seen, and 1 where it was seen; both
            have round((to_mm - from_mm) scale / mm_per_px) columns.
        """
        columns = max(1, round((to_mm - from_mm) * scale / self.mm_per_px))
        first = (from_mm - self.axial_mm) / self.mm_per_px
        low, high = floor(first) - 1, ceil(first + columns / scale) + 2
        inside = slice(max(low, 0), max(min(high, self.texture.shape[1]), 0))
        padding = ((0, 0), (max(0, inside.start - low), 0))
        cut = np.pad(self.texture[:, inside], padding).astype(np.float32)
        seen = np.pad(self.seen[:, inside], padding).astype(np.float32)
        if not cut.shape[1]:
            cut, seen = (np.zeros((len(self.texture), 1), np.float32) for _ in range(2))
        # Column c of the part shows column first + (c + 0.5) / scale - 0.5 of the raster.
        way = np.array([[1 / scale, 0, first - low + 0.5 / scale - 0.5], [0, 1, 0]])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        size_wh = (columns, len(self.texture))
        moved = cv2.warpAffine(cut, way, size_wh, flags=flags)
        weight = (cv2.warpAffine(seen, way, size_wh, flags=flags) > 0.99).astype(np.float32)
        return np.asarray(moved * weight / np.float32(_UNITS), np.float32), weight

    def coarser(self, factor: int) -> Raster:
        """Average squares of `factor` pixels."""
        rows, columns = (side // factor for side in self.texture.shape)
        cut = (slice(0, rows * factor), slice(0, columns * factor))
        size_wh = (columns, rows)
        seen = cv2.resize(self.seen[cut].astype(np.uint8), size_wh, interpolation=cv2.INTER_AREA)
        mean = cv2.resize(self.texture[cut].astype(np.int16), size_wh, interpolation=cv2.INTER_AREA)
        return replace(
            self,
            texture=np.asarray(np.clip(mean * 1.5, -127, 127), np.int8),
            seen=np.asarray(seen, bool),
            mm_per_px=self.mm_per_px * factor,
            row_mm=self.row_mm * factor,
        )


def rasters(one: Wall, other: Wall) -> tuple[Raster, Raster]:
    """Bring two walls of one pipe to the same raster.

    Raises:
        InvalidRig: The pipes have different girths.
    """
    if not isclose(one.girth_mm or 0, other.girth_mm or 0, rel_tol=_SAME_GIRTH):
        raise InvalidRig(
            f"These are different pipes: {_in_words(one)}, and {_in_words(other)}. Correct the "
            "diameter of the rig that is wrong, or choose another survey."
        )
    widest_mm = max(wall.layout.arc_to_mm - wall.layout.arc_from_mm for wall in (one, other))
    mm_per_px = max(
        FINEST_MM, widest_mm / MOST_ROWS, *(wall.layout.mm_per_px for wall in (one, other))
    )
    rows = None if one.girth_mm is None else max(8, round(one.girth_mm / mm_per_px))

    def raster(wall: Wall) -> Raster:
        if rows is None or wall.girth_mm is None:
            return _raster(wall, mm_per_px, mm_per_px)
        return _raster(wall, mm_per_px, wall.girth_mm / rows)  # one angle, whatever is stated

    return raster(one), raster(other)


_SAME_GIRTH = 0.03
"""Share by which two people state the same diameter differently."""


def _in_words(wall: Wall) -> str:
    return "a floor" if wall.girth_mm is None else f"{wall.girth_mm / pi:.0f} mm wide"


def _raster(wall: Wall, mm_per_px: float, row_mm: float) -> Raster:
    layout = wall.layout
    arc_mm = layout.arc_to_mm - layout.arc_from_mm
    is_ring = wall.girth_mm is not None and isclose(arc_mm, wall.girth_mm, rel_tol=1e-6)
    first = 0 if is_ring else ceil(layout.arc_from_mm / row_mm)
    rows = round(arc_mm / row_mm) if is_ring else max(1, floor(layout.arc_to_mm / row_mm) - first)
    own_arc_mm = layout.arc_from_mm if is_ring else first * row_mm
    columns = floor(wall.length_mm / mm_per_px)
    texture, seen = np.zeros((rows, columns), np.int8), np.zeros((rows, columns), np.bool_)
    for begin, cut, grey, known in _pieces(wall, mm_per_px, (rows, row_mm, own_arc_mm), columns):
        detail = _texture(grey, known, mm_per_px)
        width = min(detail.shape[1] - cut, columns - begin, round(_PIECE_MM / mm_per_px))
        there, here = slice(begin, begin + width), slice(cut, cut + width)
        texture[:, there] = np.rint(np.clip(detail[:, here], -3, 3) * _UNITS)
        seen[:, there] = known[:, here]
    axial_mm = wall.tiles.start * layout.tile_mm
    return Raster(texture, seen, axial_mm, own_arc_mm, mm_per_px, row_mm, is_ring)


def _pieces(
    wall: Wall, mm_per_px: float, around: tuple[int, float, float], columns: int
) -> Iterator[tuple[int, int, GrayImage, NDArray[np.bool_]]]:
    """Yield first column, columns of the left border, grey and seen wall of each piece."""
    tile_mm, first_mm = wall.layout.tile_mm, wall.tiles.start * wall.layout.tile_mm
    step = round(_PIECE_MM / mm_per_px)
    for begin in range(0, columns, step):
        border = min(begin, round(_BORDER_MM / mm_per_px))
        from_mm = first_mm + (begin - border) * mm_per_px
        end = min(begin + step + round(_BORDER_MM / mm_per_px), columns)
        to_mm = first_mm + end * mm_per_px
        indices = range(floor(from_mm / tile_mm), ceil(to_mm / tile_mm))
        own = [_grey(wall, index) for index in indices]
        strip, known = (np.hstack(part) for part in zip(*own, strict=True))
        rows, row_mm, arc_mm = around
        layout = wall.layout
        own_row_mm = (layout.arc_to_mm - layout.arc_from_mm) / layout.height_px
        fx, fy = mm_per_px / layout.mm_per_px, row_mm / own_row_mm
        x = (from_mm - indices.start * tile_mm) / layout.mm_per_px + fx / 2 - 0.5
        y = (arc_mm - layout.arc_from_mm) / own_row_mm + fy / 2 - 0.5
        way = np.array([[fx, 0, x], [0, fy, y]])
        size_wh = (end - begin + border, rows)
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        soft = cv2.GaussianBlur(strip, (0, 0), max(0.4 * fx, 0.3), sigmaY=max(0.4 * fy, 0.3))
        grey = cv2.warpAffine(soft, way, size_wh, flags=flags, borderMode=cv2.BORDER_REPLICATE)
        share = cv2.warpAffine(known.astype(np.float32), way, size_wh, flags=flags)
        yield begin, border, np.asarray(grey, np.float32), share > 0.99


def _grey(wall: Wall, index: int) -> tuple[GrayImage, NDArray[np.bool_]]:
    """Grey picture of a tile, and where it was seen."""
    shape = (wall.layout.height_px, wall.layout.width_px)
    picture = wall.read(index) if index in wall.tiles else None
    if picture is None or picture.shape[:2] != shape:
        return np.full(shape, UNSEEN_GREY, np.float32), np.zeros(shape, np.bool_)
    grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.float32)
    unseen = (np.abs(grey - UNSEEN_GREY) <= _UNSEEN_WITHIN).astype(np.uint8)
    unseen = np.asarray(cv2.morphologyEx(unseen, cv2.MORPH_OPEN, np.ones((7, 7), np.uint8)))
    return grey, np.asarray(cv2.dilate(unseen, np.ones((5, 5), np.uint8)) == 0)


def _texture(grey: GrayImage, seen: NDArray[np.bool_], mm_per_px: float) -> GrayImage:
    """Remove light, rings and streaks, and even the contrast; 0 where nothing was seen."""
    mask = seen.astype(np.float32)
    logs = np.log1p(grey) * 100 * mask  # 1 is a hundredth of the brightness
    detail = (logs - _mean(logs, mask, _DETAIL_MM / mm_per_px)) * mask
    for axis, size in ((0, None), (1, round(_STREAK_MM / mm_per_px))):
        detail = (detail - _line_mean(detail, mask, axis, size)) * mask
    contrast = np.sqrt(_mean(detail * detail, mask, _CONTRAST_MM / mm_per_px))
    even = detail / np.maximum(contrast, np.float32(_LEAST_GREY))
    return np.asarray(even * mask, np.float32)


def _mean(values: GrayImage, mask: GrayImage, sigma_px: float) -> GrayImage:
    """Gaussian mean of what was seen, worked out on a quarter of the resolution."""
    few = max(1, int(sigma_px / 4))
    size_wh = tuple(max(1, side // few) for side in values.shape[::-1])

    def blurred(image: GrayImage) -> GrayImage:
        small = cv2.resize(image, size_wh, interpolation=cv2.INTER_AREA)
        return np.asarray(cv2.GaussianBlur(small, (0, 0), sigma_px / few), np.float32)

    mean = blurred(values) / np.maximum(blurred(mask), np.float32(1e-3))
    return np.asarray(cv2.resize(mean, values.shape[::-1]), np.float32)


def _line_mean(values: GrayImage, mask: GrayImage, axis: int, size: int | None) -> GrayImage:
    """Mean over a column (axis 0), or over `size` pixels of a row."""
    if size is None:
        total, count = values.sum(axis, keepdims=True), mask.sum(axis, keepdims=True)
    else:
        total, count = (
            np.asarray(cv2.blur(each, (size, 1), borderType=cv2.BORDER_REFLECT), np.float32)
            for each in (values, mask)
        )
    return np.asarray(total / np.maximum(count, np.float32(1e-3)), np.float32)
