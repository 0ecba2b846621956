"""The map of all assets: where each is, and how bad its newest inspection found it.

Ways of writing an asset's id that `app.survey.folding.spelling` holds for one are one asset here:
a grade must not be missing at a culvert because its inspection is written without the hyphen.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date

from app.storage.asset_places import AssetPlaces, RegisteredPlace, SurveyedPlace
from app.survey.folding import spelling

MOST_ASSETS = 20_000
"""On one map; of more, the worst."""


@dataclass(frozen=True, kw_only=True)
class WantedAssets:
    """Which assets are wanted; None wants all."""

    project: str | None = None
    asset: str | None = None
    severity_from: int | None = None


@dataclass(frozen=True)
class MappedAsset:
    """An asset with its place and its inspections in figures."""

    asset: str
    project: str | None
    """Of the register, else of its newest inspection."""
    worst_severity: int | None
    """Of its newest inspection: what was repaired since an older one does not count."""
    inspections: int
    last_on: date | None
    """Day of its newest inspection; None if it was never inspected."""
    line: list[list[float]]
    """Longitude and latitude in degrees from start to end; empty if unknown."""


@dataclass(frozen=True)
class AssetMap:
    """What a map shows of the wanted assets."""

    assets: list[MappedAsset]
    """Those whose place is known, the worst first, MOST_ASSETS at most."""
    placed: int
    """Number of those whose place is known."""
    unplaced: int
    """Number of the others."""
    projects: list[str]
    """Of all assets, whatever project and grade are wanted."""


@dataclass(frozen=True)
class Background:
    """Pictures below the map, from a server of the administrator's choice."""

    tiles: str | None
    """Address with {z}, {x} and {y}; None for none."""
    attribution: str | None
    """Whose pictures they are."""


class AssetMaps:
    """Makes maps of the assets."""

    def __init__(self, places: AssetPlaces, background: Background) -> None:
        self._places = places
        self.background = background

    def map_of(self, wanted: WantedAssets) -> AssetMap:
        """Return the map of the wanted assets."""
        only = None if wanted.asset is None else spelling(wanted.asset)
        every = list(assets_of(*self._places.read(only)))
        found = [asset for asset in every if _is_wanted(asset, wanted)]
        placed = sorted((asset for asset in found if asset.line), key=_worst_first)
        return AssetMap(
            assets=placed[:MOST_ASSETS],
            placed=len(placed),
            unplaced=len(found) - len(placed),
            projects=sorted({asset.project for asset in every if asset.project}),
        )


def assets_of(
    register: Iterable[RegisteredPlace], surveys: Iterable[SurveyedPlace]
) -> Iterator[MappedAsset]:
    """Yield each asset of the register, and every other one that was inspected.

    Args:
        register: The assets of the register.
        surveys: Their inspections and those of others, from the oldest to the newest.
    """
    by_spelling: dict[str, list[SurveyedPlace]] = {}
    for survey in surveys:
        by_spelling.setdefault(survey.spelling, []).append(survey)
    registered = set()
    for one in register:
        registered.add(one.spelling)
        own = by_spelling.get(one.spelling, [])
        yield _asset(one.asset, one.project, one.line, own)
    for name, own in by_spelling.items():
        if name not in registered:
            yield _asset(own[-1].asset, None, [], own)


def _asset(
    asset: str,
    project: str | None,
    line: list[list[float]],
    surveys: Sequence[SurveyedPlace],
) -> MappedAsset:
    newest = surveys[-1] if surveys else None
    return MappedAsset(
        asset=asset,
        project=project or (newest.project if newest else None),
        worst_severity=newest.worst_severity if newest else None,
        inspections=len(surveys),
        last_on=newest.surveyed_on if newest else None,
        line=line or next((one.line for one in reversed(surveys) if one.line), []),
    )


def _is_wanted(asset: MappedAsset, wanted: WantedAssets) -> bool:
    if wanted.project is not None and asset.project != wanted.project:
        return False
    worst = asset.worst_severity
    return wanted.severity_from is None or (worst is not None and worst >= wanted.severity_from)


def _worst_first(asset: MappedAsset) -> tuple[int, str]:
    worst = asset.worst_severity
    return (0 if worst is None else -1 - worst, asset.asset)
