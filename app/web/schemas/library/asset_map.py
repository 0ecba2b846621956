"""The map of all assets."""

from __future__ import annotations

from datetime import date

from app.search.asset_map import AssetMap, Background, MappedAsset
from app.web.schemas.out import Out

_DECIMALS = 6
"""Of degrees: 0.1 m on the ground."""


class MappedAssetOut(Out):
    """An asset on the map."""

    asset: str
    project: str | None
    worst_severity: int | None
    """Of the newest inspection."""
    inspections: int
    last_at: date | None
    """Day of the newest inspection."""
    line: list[list[float]]
    """Longitude and latitude in degrees from start to end; one point or more."""

    @classmethod
    def of(cls, asset: MappedAsset) -> MappedAssetOut:
        """Convert the service's result."""
        return cls.read_from(
            asset,
            line=[[round(degrees, _DECIMALS) for degrees in point] for point in asset.line],
        )


class AssetMapOut(Out):
    """The wanted assets, the worst first."""

    assets: list[MappedAssetOut]
    placed: int
    """Number of those whose place is known: more than are listed, if there are very many."""
    unplaced: int
    """Number of those whose place is not known."""
    projects: list[str]
    """Of all assets."""
    pending: int
    """Inspections that are not indexed in their present state, so that the answer may lack them."""
    tiles: str | None
    """Address of raster tiles with {z}, {x} and {y}."""
    attribution: str | None
    """Whose tiles they are."""

    @classmethod
    def of(cls, found: AssetMap, background: Background, pending: int) -> AssetMapOut:
        """Convert the service's result."""
        return cls.read_from(
            found,
            background,
            assets=[MappedAssetOut.of(asset) for asset in found.assets],
            pending=pending,
        )
