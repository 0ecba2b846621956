"""Assets, inspections and observations for a map of another program: a page at a time, by key.

A page begins behind the key that the last one ended with, so it costs the same wherever it is, and
stays right while rows come and go.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any, Generic, NamedTuple, TypeVar

from sqlalchemy import ColumnElement, Select, and_, or_, select, tuple_
from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading
from app.storage.database.tables import (
    Boxed,
    IndexedDefect,
    IndexedInspection,
    Inspection,
    RegisteredAsset,
)
from app.storage.index.asset_places import SURVEYED, SurveyedPlace
from app.storage.index.defect_index import HAS_PHOTO, WITH_PHOTO
from app.storage.index.queries import NEWEST_LAST, counted
from app.survey.assets.box import Box
from app.survey.assets.search_terms import FeatureFilter

Row = TypeVar("Row")
Key = tuple[str, ...]


@dataclass(frozen=True)
class FeaturePage(Generic[Row]):
    """Some rows in the order of their keys."""

    matched: int
    """Number of all that fit."""
    rows: Sequence[Row]
    is_last: bool


class Listed(NamedTuple):
    """What a map shows of a registered asset."""

    asset_id: str
    project: str | None
    header: dict[str, Any]
    line: list[list[float]]


class Inspected(NamedTuple):
    """What a map shows of an indexed inspection."""

    inspection_id: str
    name: str
    project: str | None
    asset: str | None
    surveyed_on: date
    line: list[list[float]] | None
    distance_m: float | None
    distance_u95_m: float | None
    defects: int
    worst_severity: int | None


class Seen(NamedTuple):
    """What a map shows of an indexed observation."""

    inspection_id: str
    observation_id: str
    inspection: str
    project: str | None
    asset: str | None
    surveyed_on: date
    seq: int
    code: str | None
    char1: str | None
    char2: str | None
    label: str | None
    quant1: float | None
    unit1: str | None
    quant2: float | None
    unit2: str | None
    severity: int | None
    continuous: str | None
    distance_m: float | None
    distance_u95_m: float | None
    clock: int | None
    clock_to: int | None
    remark: str | None
    created_at: datetime
    lon: float | None
    lat: float | None
    has_photo: bool


# Columns, as rows of a mapped class take twice as long.
_LISTED = select(*(getattr(RegisteredAsset, name) for name in Listed._fields))
_INSPECTED = select(*(getattr(IndexedInspection, name) for name in Inspected._fields))
_SEEN = WITH_PHOTO.with_only_columns(
    *(getattr(IndexedDefect, name) for name in Seen._fields[:-1]), HAS_PHOTO
)


class FeatureIndex(Store):
    """Reads the register and the index; `after` is the key of the last row of the page before."""

    @reading
    def assets(
        self, session: Session, wanted: FeatureFilter, after: Key | None, limit: int
    ) -> FeaturePage[tuple[Listed, list[SurveyedPlace]]]:
        """Return registered assets, each with its inspections from the oldest to the newest."""
        key = (RegisteredAsset.asset_id,)
        conditions = list(_of_asset(wanted))
        page = _page(session, _LISTED, conditions, key, after, limit)
        rows = [Listed._make(row) for row in page.rows]
        surveys: dict[str, list[SurveyedPlace]] = {row.asset_id: [] for row in rows}
        found = SURVEYED.where(IndexedInspection.asset.in_(surveys))
        for each in session.execute(found.order_by(*NEWEST_LAST, Inspection.created_at)):
            place = SurveyedPlace._make(each)
            surveys[place.asset].append(place)
        return FeaturePage(page.matched, [(r, surveys[r.asset_id]) for r in rows], page.is_last)

    @reading
    def inspections(
        self, session: Session, wanted: FeatureFilter, after: Key | None, limit: int
    ) -> FeaturePage[Inspected]:
        """Return indexed inspections."""
        key = (IndexedInspection.inspection_id,)
        conditions = list(_of_inspection(wanted))
        page = _page(session, _INSPECTED, conditions, key, after, limit)
        return FeaturePage(page.matched, [Inspected._make(row) for row in page.rows], page.is_last)

    @reading
    def observations(
        self, session: Session, wanted: FeatureFilter, after: Key | None, limit: int
    ) -> FeaturePage[Seen]:
        """Return indexed observations."""
        key = (IndexedDefect.inspection_id, IndexedDefect.observation_id)
        page = _page(session, _SEEN, list(_of_observation(wanted)), key, after, limit)
        return FeaturePage(page.matched, [Seen._make(row) for row in page.rows], page.is_last)


def _page(
    session: Session,
    query: Select[*tuple[Any, ...]],
    conditions: Sequence[ColumnElement[bool]],
    key: Sequence[Any],
    after: Key | None,
    limit: int,
) -> FeaturePage[tuple[Any, ...]]:
    # Without what is joined: it adds and removes no row.
    matched = counted(session, select(*key).where(*conditions))
    query = query.where(*conditions)
    if after is not None:
        query = query.where(tuple_(*key) > after)
    rows = session.execute(query.order_by(*key).limit(limit + 1)).all()
    return FeaturePage(matched, [tuple(row) for row in rows[:limit]], len(rows) <= limit)


def _of_asset(wanted: FeatureFilter) -> Iterator[ColumnElement[bool]]:
    # An asset has no time, so it is there at any.
    if wanted.box is not None:
        yield _meets(RegisteredAsset, wanted.box)
    if wanted.project is not None:
        yield RegisteredAsset.project == wanted.project
    if wanted.key is not None:
        yield RegisteredAsset.asset_id == wanted.key[0]
    if wanted.asset is not None:
        yield RegisteredAsset.asset_id == wanted.asset


def _of_inspection(wanted: FeatureFilter) -> Iterator[ColumnElement[bool]]:
    if wanted.box is not None:
        yield _meets(IndexedInspection, wanted.box)
    if wanted.key is not None:
        yield IndexedInspection.inspection_id == wanted.key[0]
    yield from _of_survey(IndexedInspection, wanted)


def _of_observation(wanted: FeatureFilter) -> Iterator[ColumnElement[bool]]:
    if wanted.box is not None:
        west, south, east, north = wanted.box
        lon = IndexedDefect.lon
        yield IndexedDefect.lat.between(south, north)
        yield lon.between(west, east) if west <= east else or_(lon >= west, lon <= east)
    if wanted.key is not None:
        yield IndexedDefect.inspection_id == wanted.key[0]
        yield IndexedDefect.observation_id == wanted.key[1]
    if wanted.code is not None:
        yield IndexedDefect.code == wanted.code
    yield from _of_survey(IndexedDefect, wanted)


def _of_survey(
    table: type[IndexedInspection | IndexedDefect], wanted: FeatureFilter
) -> Iterator[ColumnElement[bool]]:
    if wanted.first is not None:
        yield table.surveyed_on >= wanted.first
    if wanted.last is not None:
        yield table.surveyed_on <= wanted.last
    if wanted.project is not None:
        yield table.project == wanted.project
    if wanted.asset is not None:
        yield table.asset == wanted.asset


def _meets(table: type[Boxed], box: Box) -> ColumnElement[bool]:
    west, south, east, north = box
    begins, ends = table.west <= east, table.east >= west
    return and_(
        table.south <= north,
        table.north >= south,
        and_(begins, ends) if west <= east else or_(begins, ends),
    )
