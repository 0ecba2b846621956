"""The three collections: their parameters, and each of their rows as a GeoJSON feature."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from app.search.asset_map import asset_with
from app.storage.index.asset_places import SurveyedPlace
from app.storage.index.features import FeatureIndex, FeaturePage, Inspected, Key, Listed, Seen
from app.survey.assets.search_terms import FeatureFilter

AFTER = "after"
"""Begins a page behind a feature; a client takes it from the link `next`."""
Feature = dict[str, Any]


class Features:
    """Reads the collections."""

    def __init__(self, index: FeatureIndex) -> None:
        self._index = index

    def page(
        self, kind: Collection, wanted: FeatureFilter, after: Key | None, limit: int
    ) -> FeaturePage[Any]:
        """Return rows of a collection, those behind the key `after`."""
        return kind.read(self._index, wanted, after, limit)


@dataclass(frozen=True)
class Collection:
    """A collection of features."""

    id: str
    title: str
    description: str
    parameters: tuple[str, ...]
    read: Callable[[FeatureIndex, FeatureFilter, Key | None, int], FeaturePage[Any]]
    feature: Callable[[Any, str], Feature]
    """Makes a feature of a row, with links that begin with the address of the server."""

    def key(self, feature_id: str) -> Key | None:
        """Return the key of a feature; None if no feature can have this id."""
        parts = tuple(feature_id.split(".", 1)) if self.id == "observations" else (feature_id,)
        is_whole = len(parts) == (2 if self.id == "observations" else 1)
        return parts if is_whole and "\x00" not in feature_id else None


def _asset(row: tuple[Listed, list[SurveyedPlace]], server: str) -> Feature:
    asset, surveys = row
    figures = asset_with(asset.asset_id, asset.project, asset.line, surveys)
    properties = {
        **asset.header,
        "asset": asset.asset_id,
        "project": asset.project,
        "inspections": figures.inspections,
        "last_surveyed_on": figures.last_at,
        "worst_severity": figures.worst_severity,
        "page": f"{server}/assets?asset={quote(asset.asset_id, safe='')}",
    }
    return _feature(asset.asset_id, asset.line, properties)


def _inspection(row: Inspected, server: str) -> Feature:
    properties: dict[str, Any] = row._asdict()
    inspection_id, line = properties.pop("inspection_id"), properties.pop("line")
    properties["page"] = f"{server}/inspections/{inspection_id}"
    return _feature(inspection_id, line, properties)


def _observation(row: Seen, server: str) -> Feature:
    properties: dict[str, Any] = row._asdict()
    lon, lat = properties.pop("lon"), properties.pop("lat")
    path = f"inspections/{row.inspection_id}"
    photo = f"{server}/api/{path}/observations/{row.observation_id}/photo"
    properties["photo"] = photo if properties.pop("has_photo") else None
    properties["page"] = f"{server}/{path}?defect={row.observation_id}"
    place = None if lon is None else [[lon, lat]]
    return _feature(f"{row.inspection_id}.{row.observation_id}", place, properties)


def _feature(
    feature_id: str, line: Sequence[Sequence[float]] | None, properties: Mapping[str, Any]
) -> Feature:
    geometry: dict[str, Any] | None = None
    if line:
        is_point = len(line) == 1
        kind = "Point" if is_point else "LineString"
        geometry = {"type": kind, "coordinates": line[0] if is_point else line}
    return {
        "type": "Feature",
        "id": feature_id,
        "geometry": geometry,
        "properties": properties,
    }


_PAGE = ("limit", "bbox", "datetime", AFTER)
COLLECTIONS = {
    each.id: each
    for each in (
        Collection(
            "assets",
            "Assets",
            "The assets of the register, with the newest survey of each.",
            (*_PAGE, "project", "asset"),
            FeatureIndex.assets,
            _asset,
        ),
        Collection(
            "inspections",
            "Inspections",
            "The inspections, each on the course of its culvert.",
            (*_PAGE, "project", "asset"),
            FeatureIndex.inspections,
            _inspection,
        ),
        Collection(
            "observations",
            "Observations",
            "What was seen, where the present corrections place it.",
            (*_PAGE, "project", "asset", "code"),
            FeatureIndex.observations,
            _observation,
        ),
    )
}
