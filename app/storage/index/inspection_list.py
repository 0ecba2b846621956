"""The list of inspections in the database: those that fit, in some order, a page at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from functools import reduce
from typing import Any

from sqlalchemy import ColumnElement, Select, exists, func, select
from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading
from app.storage.database.tables import (
    Base,
    IndexedInspection,
    Inspection,
    InspectionLabel,
    ObservationRow,
    outdated,
)
from app.storage.index.queries import a_page, of_project, ordered, unknown_last
from app.storage.records.alerts import EMERGENCY
from app.storage.records.inspections import SEVERITY, SUMMARY, Summary
from app.survey.assets.search_terms import InspectionFilter, InspectionSort, Page


@dataclass(frozen=True)
class Grave:
    """An inspection with a defect of the highest severity."""

    id: str
    name: str
    at: datetime
    """When such a defect was last stored or edited."""


@dataclass(frozen=True)
class Found:
    """A page of the list of inspections."""

    summaries: list[Summary]
    total: int
    """Inspections that fit."""
    stored: int
    """All inspections, whether they fit or not."""
    grave: list[Grave]
    """The inspections with the newest grave defects, newest first, whether they fit or not."""


class InspectionList(Store):
    """Finds inspections by what they are, and by what the index knows of them."""

    @reading
    def found(
        self, session: Session, wanted: InspectionFilter, page: Page[InspectionSort]
    ) -> Found:
        """Return one page of the inspections that fit."""
        query = _with_index(select(Inspection.id)).where(*_conditions(wanted))
        number = select(func.count()).select_from(Inspection)
        # Two steps: counting the observations of all inspections takes seconds.
        total, shown = a_page(session, query, _order(page), page)
        ids = [inspection_id for (inspection_id,) in shown]
        rows = session.execute(SUMMARY.where(Inspection.id.in_(ids)))
        by_id = {row[0].id: Summary(*row) for row in rows}
        return Found(
            summaries=[by_id[one] for one in ids],
            total=total,
            stored=session.scalar(number) or 0,
            grave=[Grave(*row) for row in session.execute(_GRAVE)],
        )

    @reading
    def ids(
        self, session: Session, wanted: InspectionFilter, page: Page[InspectionSort]
    ) -> list[str]:
        """Return the ids of the inspections of a page."""
        query = _with_index(select(Inspection.id)).where(*_conditions(wanted))
        query = query.order_by(*_order(page))
        return list(session.scalars(query.offset(page.offset).limit(page.limit)))


def _with_index(query: Select[*tuple[Any, ...]]) -> Select[*tuple[Any, ...]]:
    return query.outerjoin(IndexedInspection, IndexedInspection.inspection_id == Inspection.id)


def _order(page: Page[InspectionSort]) -> tuple[ColumnElement[Any], ...]:
    """Return the order that is asked for; equal ones are in the order of their ids."""
    if page.sort in _OF_INSPECTION.c:
        return ordered(_OF_INSPECTION.c[page.sort], page), _OF_INSPECTION.c.id
    # What is not indexed yet comes last too.
    return unknown_last(_OF_INDEX.c[page.sort], page), _OF_INSPECTION.c.id


def _conditions(wanted: InspectionFilter) -> Iterator[ColumnElement[bool]]:
    for word in wanted.search.split():
        yield _SEARCHED.icontains(word, autoescape=True)
    if wanted.status is not None:
        yield Inspection.status == wanted.status
    if wanted.review is not None:
        yield Inspection.review_state == wanted.review
    yield from of_project(IndexedInspection.project, wanted.of)
    if wanted.asset is not None:
        yield IndexedInspection.asset == wanted.asset
    if wanted.severity_from is not None:
        yield IndexedInspection.worst_severity >= wanted.severity_from
    if wanted.outdated:
        yield outdated()
    if wanted.label is not None:
        yield exists().where(
            InspectionLabel.inspection_id == Inspection.id, InspectionLabel.label == wanted.label
        )


_OF_INSPECTION = Base.metadata.tables[Inspection.__tablename__]
_OF_INDEX = Base.metadata.tables[IndexedInspection.__tablename__]
_SEARCHED_FIELDS = (
    "asset_id", "start_node", "end_node", "operator", "client", "location_text", "road",
)  # fmt: skip
_SEARCHED = reduce(
    lambda text, part: text + " " + part,
    (
        Inspection.name,
        Inspection.source_filename,
        *(func.coalesce(Inspection.header[name].as_string(), "") for name in _SEARCHED_FIELDS),
    ),
)
_GRAVE_SHOWN = 10
_LAST_TOUCHED = func.max(func.coalesce(ObservationRow.edited_at, ObservationRow.created_at))
_GRAVE = (
    select(Inspection.id, Inspection.name, _LAST_TOUCHED)
    .join(ObservationRow, ObservationRow.inspection_id == Inspection.id)
    .where(ObservationRow.deleted_at.is_(None), SEVERITY == EMERGENCY)
    .group_by(Inspection.id)
    .order_by(_LAST_TOUCHED.desc())
    .limit(_GRAVE_SHOWN)
)
