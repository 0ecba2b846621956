"""The unrolled wall."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pydantic import BaseModel

from app.tracking.unrolled import Tile
from app.web.schemas.out import Out
from vo_core.mosaic.layout import Layout


class WallTileOut(BaseModel):
    """A picture of a part of the wall."""

    index: int
    revision: int
    from_m: float
    """Corrected distance of its left border."""
    to_m: float


class UnrolledOut(Out):
    """The unrolled wall; row 0 of a picture is at arc_from_mm, columns run with the distance."""

    tile_m: float
    mm_per_px: float
    arc_from_mm: float
    arc_to_mm: float
    width_px: int
    height_px: int
    tiles: list[WallTileOut]

    @classmethod
    def of(
        cls, layout: Layout, tiles: Sequence[Tile], chainage_mm: Callable[[float], float]
    ) -> UnrolledOut:
        """Convert the service's tiles; `chainage_mm` corrects a raw distance."""
        return cls.read_from(
            layout,
            tile_m=layout.tile_mm / 1000,
            tiles=[
                WallTileOut(
                    index=tile.index,
                    revision=tile.revision,
                    from_m=round(chainage_mm(tile.index * layout.tile_mm) / 1000, 4),
                    to_m=round(chainage_mm((tile.index + 1) * layout.tile_mm) / 1000, 4),
                )
                for tile in tiles
            ],
        )
