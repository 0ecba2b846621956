"""The map of all assets: where each is, and how bad its newest inspection found it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date

from app.storage.index.asset_places import AssetPlaces, RegisteredPlace, SurveyedPlace
from app.survey.folding import normalised_id

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
    projects: frozenset[str]
    """All that it belongs to: that of the register, and those of its inspections."""
    worst_severity: int | None
    """Of its newest inspection: what was repaired since an older one does not count."""
    inspections: int
    last_at: date | None
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
        only = None if wanted.asset is None else normalised_id(wanted.asset)
        every = list(assets_of(*self._places.read(only)))
        found = [asset for asset in every if _is_wanted(asset, wanted)]
        placed = sorted((asset for asset in found if asset.line), key=_worst_first)
        return AssetMap(
            assets=placed[:MOST_ASSETS],
            placed=len(placed),
            unplaced=len(found) - len(placed),
            projects=sorted(frozenset[str]().union(*(asset.projects for asset in every))),
        )


def assets_of(
    register: Sequence[RegisteredPlace], surveys: Iterable[SurveyedPlace]
) -> Iterator[MappedAsset]:
    """Yield each asset of the register, and every other one that was inspected.

    One without a place of its own has that of an asset whose id is spelled alike: a grade must not
    be missing at a culvert because its inspection is written without the hyphen.

    Args:
        register: The assets of the register.
        surveys: Their inspections and those of others, from the oldest to the newest.
    """
    by_asset: dict[str, list[SurveyedPlace]] = {}
    for survey in surveys:
        by_asset.setdefault(survey.asset, []).append(survey)
    lines = {asset: _newest_line(own) for asset, own in by_asset.items()}
    alike = {own[0].normalised_id: lines[asset] for asset, own in by_asset.items() if lines[asset]}
    alike |= {one.normalised_id: one.line for one in register if one.line}
    for one in register:
        line = one.line or lines.get(one.asset) or alike.get(one.normalised_id, [])
        yield asset_with(one.asset, one.project, line, by_asset.pop(one.asset, []))
    for asset, own in by_asset.items():
        yield asset_with(asset, None, lines[asset] or alike.get(own[0].normalised_id, []), own)


def _newest_line(surveys: Sequence[SurveyedPlace]) -> list[list[float]]:
    """Return the ends by the newest survey that states one."""
    return next((survey.line for survey in reversed(surveys) if survey.line), [])


def asset_with(
    asset: str,
    project: str | None,
    line: list[list[float]],
    surveys: Sequence[SurveyedPlace],
) -> MappedAsset:
    """Return an asset with its inspections in figures.

    Args:
        asset, project, line: Of the register, as far as it is in there.
        surveys: Its inspections, from the oldest to the newest.
    """
    newest = _newest(surveys)
    return MappedAsset(
        asset=asset,
        project=project or max((one.project for one in newest if one.project), default=None),
        projects=frozenset(name for name in (project, *(s.project for s in surveys)) if name),
        worst_severity=max(
            (one.worst_severity for one in newest if one.worst_severity is not None), default=None
        ),
        inspections=len(surveys),
        last_at=newest[0].surveyed_on if newest else None,
        line=line,
    )


def _newest(surveys: Sequence[SurveyedPlace]) -> list[SurveyedPlace]:
    """Return the newest survey: the inspections of one day."""
    return [
        one
        for one in surveys
        if (one.has_run, one.surveyed_on) == (surveys[-1].has_run, surveys[-1].surveyed_on)
    ]


def _is_wanted(asset: MappedAsset, wanted: WantedAssets) -> bool:
    worst = asset.worst_severity
    return (
        (wanted.asset is None or asset.asset == wanted.asset)
        and (wanted.project is None or wanted.project in asset.projects)
        and (wanted.severity_from is None or (worst is not None and worst >= wanted.severity_from))
    )


def _worst_first(asset: MappedAsset) -> tuple[int, str]:
    worst = asset.worst_severity
    return (0 if worst is None else -1 - worst, asset.asset)
