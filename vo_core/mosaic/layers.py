"""Joins the unrolled walls of the parts of a film, each painted by itself, into one wall.

A part paints its wall from its own zero point. Moved by whole pixels, so that nothing is resampled,
it is a layer of the joined wall. Layers are blended as `Mosaic` blends frames: what an earlier part
saw completely does not change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from math import isclose, pi

import cv2
import numpy as np

from vo_core.geometry.initial_pose import InitialPose
from vo_core.geometry.rectify import Rectifier
from vo_core.geometry.wall import NOMINAL, cast, develop, enclose, sight
from vo_core.mosaic.layout import UNSEEN_GREY, Layout
from vo_core.mosaic.mosaic import Tile
from vo_core.rig import Rig
from vo_core.track_join import Seam
from vo_core.types import ByteImage, GrayImage

_EVERY_PX = 32
"""The mean shift of a view is computed from every 32nd pixel in each direction."""


@dataclass(frozen=True)
class Shift:
    """Way of a layer to its place on the joined wall, in whole pixels."""

    columns: int
    rows: int


Layer = tuple[Shift, Callable[[int], bytes | None]]
"""Its shift, and how its tiles are read: the PNG file by `png_of`, None where there is none."""


def png_of(tile: Tile) -> bytes:
    """Encode a tile without loss: blue, green, red, and its weight in 255 steps, 0 where unseen."""
    weight = np.ceil(np.minimum(tile.weight, 1) * 255).astype(np.uint8)
    fast = [cv2.IMWRITE_PNG_COMPRESSION, 1]
    _, png = cv2.imencode(".png", np.dstack([tile.picture, weight]), fast)
    return png.tobytes()


def tile_of(index: int, png: bytes) -> Tile:
    """Decode what `png_of` has made."""
    pixels = _decoded(png)
    colour, weight = np.ascontiguousarray(pixels[..., :3]), pixels[..., 3] / np.float32(255)
    return Tile(index, colour, np.asarray(weight, np.float32))


def shift_of(
    rig: Rig, layout: Layout, seam: Seam, *, start: InitialPose, origin: InitialPose
) -> Shift:
    """Compute how far the wall of a later part lies from its place on the joined wall.

    Args:
        rig: Camera, mount and pipe.
        layout: The raster of both walls.
        seam: How the part is moved.
        start: `Odometry.start` of the part, from which it is painted.
        origin: `Odometry.initial_pose` of the first part, from which the joined wall is painted.
    """
    turned = InitialPose(
        *(getattr(seam.initial_pose, n) + getattr(origin, n) - getattr(start, n) for n in _FIELDS)
    )
    grid = Rectifier(rig).grid
    rows, columns = np.mgrid[: grid.shape[0] : _EVERY_PX, : grid.shape[1] : _EVERY_PX]
    pixels = np.stack([columns.ravel(), rows.ravel()], 1)
    rays = sight(rig, NOMINAL, enclose(rig, grid.to_mm(pixels)))
    before, after = (develop(rig, cast(rig, pose, rays)) for pose in (NOMINAL, turned.pose))
    along_mm, around_mm = np.nanmedian(after - before, 0).tolist()
    row_mm = (layout.arc_to_mm - layout.arc_from_mm) / layout.height_px
    return Shift(
        round((seam.x_mm + along_mm) / layout.mm_per_px),
        round(around_mm / row_mm),
    )


def touched(layout: Layout, shift: Shift, index: int) -> range:
    """Indices of the tiles of the joined wall on which a tile of a layer lies."""
    first = index * layout.width_px + shift.columns
    width = layout.width_px
    return range(first // width, (first + width - 1) // width + 1)


def joined_tile(rig: Rig, layout: Layout, index: int, layers: Iterable[Layer]) -> ByteImage | None:
    """Blend one tile of the joined wall, (height_px, width_px, 3) BGR; None if nothing was seen.

    Args:
        rig: Camera, mount and pipe.
        layout: The raster of the walls.
        index: Index of the tile on the joined wall.
        layers: The walls of the parts, in the order of the film.
    """
    shape = (layout.height_px, layout.width_px)
    colour, weight = np.full((*shape, 3), UNSEEN_GREY, np.uint8), np.zeros(shape, np.float32)
    is_ring = rig.pipe.radius_mm is not None and isclose(
        layout.arc_to_mm - layout.arc_from_mm, 2 * pi * rig.pipe.radius_mm
    )
    for shift, read in layers:
        moved = _moved(layout, shift, index, read, is_ring=is_ring)
        if moved is None:
            continue
        new, new_weight = moved
        share = new_weight * (1 - weight)
        both = cv2.blendLinear(colour, new, weight, share)
        colour = np.asarray(cv2.copyTo(both, (share > 0).astype(np.uint8), colour), np.uint8)
        weight += share
    return colour if weight.any() else None


_FIELDS = tuple(each.name for each in fields(InitialPose))


def _moved(
    layout: Layout, shift: Shift, index: int, read: Callable[[int], bytes | None], *, is_ring: bool
) -> tuple[ByteImage, GrayImage] | None:
    """Colour and weight of a layer on a tile of the joined wall; None if it has nothing there."""
    width = layout.width_px
    first, offset = divmod(index * width - shift.columns, width)
    found = [read(first), read(first + 1) if offset else None]
    if found == [None, None]:
        return None
    nothing = np.zeros((layout.height_px, width, 4), np.uint8)
    tiles = [nothing if png is None else _decoded(png) for png in found]
    strip = np.hstack(tiles)[:, offset : offset + width]
    rows = shift.rows
    strip = np.roll(strip, rows, axis=0)
    if not is_ring and rows:
        strip[slice(0, rows) if rows > 0 else slice(rows, None)] = 0
    colour = np.ascontiguousarray(strip[..., :3])
    return colour, np.asarray(strip[..., 3] / np.float32(255), np.float32)


def _decoded(png: bytes) -> ByteImage:
    return np.asarray(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED), np.uint8)
