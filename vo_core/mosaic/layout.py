"""The raster of the mosaic."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, pi

from vo_core.geometry.rectify import PATCH_SIDE_PX, PatchGrid, Rectifier
from vo_core.rig import Rig

NODE_PX = 8
"""Positions are computed every 8 pixels of the mosaic, and interpolated between."""

TILE_MM = 500.0
"""Length of a tile along the pipe."""

FINEST_MM = 0.5
"""Finest pixel of the mosaic, if the camera resolves as much; it shows a hair crack."""

MOST_PX = 600_000
"""Most pixels of a tile."""

LONGEST_TILE_PX = 1000
"""Most pixels along one side of a tile."""

SWAY = 0.15
"""Margin on either side, as a share of the visible arc, for the wall that a climb shows."""

UNSEEN_GREY = 44
"""Grey level where no frame was painted."""


@dataclass(frozen=True)
class Layout:
    """The raster of the mosaic: tile k holds raw axial coordinates [k, k + 1) * `tile_mm`.

    Row i covers arc_from_mm + [i, i + 1) * (arc_to_mm - arc_from_mm) / height_px of the developed
    wall, column j of tile k the axial k * tile_mm + [j, j + 1) * mm_per_px.
    """

    tile_mm: float
    mm_per_px: float
    arc_from_mm: float
    arc_to_mm: float
    width_px: int
    height_px: int

    @classmethod
    def of(cls, rig: Rig) -> Layout:
        """Choose the resolution at which the camera sees the wall, within `FINEST_MM` and
        `MOST_PX`.

        Raises:
            InvalidRig: The camera sees no wall, or too narrow a strip of it.
        """
        return cls.over(rig, Rectifier(rig).grid)

    @classmethod
    def over(cls, rig: Rig, grid: PatchGrid) -> Layout:
        """Like `of`, for a camera whose patch grid is known."""
        low_mm = grid.arc_mm - grid.mm_per_px / 2
        seen_mm = grid.shape[0] * grid.mm_per_px
        start_mm, end_mm = low_mm - SWAY * seen_mm, low_mm + (1 + SWAY) * seen_mm
        if rig.pipe.radius_mm is not None:
            half_mm = pi * rig.pipe.radius_mm
            start_mm, end_mm = max(start_mm, -half_mm), min(end_mm, half_mm)
        arc_mm = end_mm - start_mm
        longest = max(rig.camera.width, rig.camera.height)
        finest_mm = max(
            FINEST_MM,
            grid.mm_per_px * PATCH_SIDE_PX / max(longest, PATCH_SIDE_PX),
            (TILE_MM * arc_mm / MOST_PX) ** 0.5,
            arc_mm / LONGEST_TILE_PX,
        )
        width_px = max(1, floor(TILE_MM / finest_mm))
        mm_per_px = TILE_MM / width_px
        height_px = max(1, round(arc_mm / mm_per_px / NODE_PX)) * NODE_PX
        return cls(TILE_MM, mm_per_px, start_mm, end_mm, width_px, height_px)
