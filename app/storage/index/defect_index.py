"""The index of the search: what is derived of each inspection, and the queries over all of them.

Distances are never stored with a defect, so that they follow every correction. A search over all
inspections cannot derive them all, so it reads these tables: copies that say from which state of
the inspection they were made. They can be deleted at any time; `app.search.indexer` makes them
again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime

from sqlalchemy import ColumnElement, Select, and_, delete, func, or_, select, tuple_
from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import (
    Base,
    EventRow,
    IndexedDefect,
    IndexedInspection,
    Inspection,
    ObservationRow,
)
from app.storage.index.queries import (
    WITH_INSPECTION,
    FoundInspection,
    counted,
    ordered,
    with_words,
)
from app.survey.assets.search_terms import DefectFilter, DefectSort, Page, Problem, QualitySort
from app.survey.distances.film_quality import PROBLEMS
from app.survey.folding import folded, normalised_id
from app.survey.observations.defects import NO_DEFECTS, is_defect, part_of
from app.survey.observations.tag import Tag

INDEX_VERSION = 5
"""Version of how rows are derived: rows of another version are made again."""

_PAGE = 2_000
"""Rows that are read at a time where all are wanted."""


STATED = tuple(name for name in Tag.model_fields if name in IndexedDefect.__table__.columns)
"""Fields of a tag that the index holds as they are."""


@dataclass(frozen=True)
class Token:
    """A state of an inspection: another one after every change of what the index holds of it."""

    revision: int
    finished_at: datetime | None
    newest_event: int | None


@dataclass(frozen=True)
class FoundDefect:
    """An indexed defect with what is read afresh."""

    row: IndexedDefect
    has_photo: bool


class DefectIndex(Store):
    """Writes the index of one inspection at a time, and answers from all of it."""

    @reading
    def token(self, session: Session, inspection_id: str) -> Token | None:
        """Return the present state of an inspection; None if there is none."""
        found = session.execute(_TOKEN.where(Inspection.id == inspection_id)).one_or_none()
        return None if found is None else Token(*found[1:])

    @reading
    def stale(self, session: Session, limit: int) -> dict[str, Token]:
        """Return inspections that are not indexed in their present state, the oldest."""
        query = _STALE.order_by(Inspection.created_at, Inspection.id).limit(limit)
        return {found[0]: Token(*found[1:]) for found in session.execute(query)}

    @reading
    def pending(self, session: Session) -> int:
        """Return how many inspections are not indexed in their present state."""
        return counted(session, _STALE)

    @writing
    def put(
        self,
        session: Session,
        token: Token,
        inspection: IndexedInspection,
        defects: Sequence[IndexedDefect],
    ) -> None:
        """Replace all that is indexed of an inspection, unless it was deleted meanwhile.

        Args:
            session: Of the transaction.
            token: The state of the inspection from before the rows were derived: whatever changed
                since makes them stale.
            inspection: Its row, without token, sums and folded text, which are set here.
            defects: Its observations that are not deleted, without what is copied from
                `inspection`; `folded` is their own text.
        """
        inspection_id = inspection.inspection_id
        if session.get(Inspection, inspection_id) is None:
            return
        for table in (IndexedDefect, IndexedInspection):
            session.execute(delete(table).where(table.inspection_id == inspection_id))
        for name, value in asdict(token).items():
            setattr(inspection, name, value)
        inspection.index_version = INDEX_VERSION
        inspection.asset_normalised_id = inspection.asset and normalised_id(inspection.asset)
        inspection.folded = folded(inspection.name, inspection.project, inspection.asset)
        severities = [d.severity for d in defects if d.severity is not None]
        inspection.worst_severity = max(severities, default=None)
        inspection.defects = len(
            {
                part_of(d.observation_id, d.continuous)
                for d in defects
                if is_defect(d.code, d.severity)
            }
        )
        session.add(inspection)
        session.flush()
        for defect in defects:
            for name in ("inspection_id", "revision", "project", "asset", "surveyed_on"):
                setattr(defect, name, getattr(inspection, name))
            defect.inspection = inspection.name
            defect.folded = f"{defect.folded} {inspection.folded}"
        session.add_all(defects)

    @reading
    def defects(
        self, session: Session, wanted: DefectFilter, page: Page[DefectSort]
    ) -> tuple[int, list[FoundDefect]]:
        """Return the number of defects that fit, and a page of them."""
        conditions = list(_conditions(wanted))
        order = tuple(
            ordered(column, page) for column in (_DEFECTS.c[page.sort], *_DEFECTS.primary_key)
        )
        # Only the keys are sorted: whole rows would be copied for every row that fits.
        keys = (
            select(*_KEY)
            .where(*conditions)
            .order_by(*order)
            .offset(page.offset)
            .limit(page.limit)
            .subquery()
        )
        is_wanted = and_(*(column == keys.c[column.key] for column in _KEY))
        total = counted(session, select(IndexedDefect.inspection_id).where(*conditions))
        if total <= page.offset:
            return total, []  # without a second search through all of them
        return total, _found(session, WITH_PHOTO.join(keys, is_wanted).order_by(*order))

    @reading
    def defects_of(self, session: Session, inspection_ids: Sequence[str]) -> list[FoundDefect]:
        """Return the defects of some inspections, each in the order of its numbers."""
        query = WITH_PHOTO.where(IndexedDefect.inspection_id.in_(inspection_ids)).order_by(
            IndexedDefect.inspection_id, IndexedDefect.seq
        )
        return _found(session, query)

    @reading
    def films(
        self, session: Session, problem: Problem | None, page: Page[QualitySort]
    ) -> tuple[int, list[IndexedInspection]]:
        """Return the number of measured films, or of those with a problem, and a page of them."""
        conditions: list[ColumnElement[bool]] = [IndexedInspection.frames.is_not(None)]
        if problem is not None:
            name, most = PROBLEMS[problem]
            conditions.append(getattr(IndexedInspection, name) > most)
        query = (
            select(IndexedInspection)
            .where(*conditions)
            .order_by(ordered(_INSPECTIONS.c[page.sort], page), IndexedInspection.inspection_id)
        )
        total = counted(session, select(IndexedInspection.inspection_id).where(*conditions))
        return total, list(session.scalars(query.offset(page.offset).limit(page.limit)))

    def every_inspection(self) -> Iterator[list[FoundInspection]]:
        """Yield all indexed inspections, by id, some at a time."""
        last = ""
        while True:
            query = (
                WITH_INSPECTION.where(IndexedInspection.inspection_id > last)
                .order_by(IndexedInspection.inspection_id)
                .limit(_PAGE)
            )
            with self.database.read() as session:
                found = [FoundInspection(*row) for row in session.execute(query)]
            if not found:
                return
            yield found
            last = found[-1].row.inspection_id

    def every_defect(self) -> Iterator[list[FoundDefect]]:
        """Yield all indexed defects, by inspection and id, some at a time."""
        last = ("", "")
        while True:
            query = WITH_PHOTO.where(tuple_(*_KEY) > last).order_by(*_KEY).limit(_PAGE)
            with self.database.read() as session:
                found = _found(session, query)
            if not found:
                return
            yield found
            last = (found[-1].row.inspection_id, found[-1].row.observation_id)


_INSPECTIONS = Base.metadata.tables[IndexedInspection.__tablename__]
_DEFECTS = Base.metadata.tables[IndexedDefect.__tablename__]
_KEY = (IndexedDefect.inspection_id, IndexedDefect.observation_id)
_NEWEST = (
    select(func.max(EventRow.id)).where(EventRow.inspection_id == Inspection.id).scalar_subquery()
)
_TOKEN = select(Inspection.id, Inspection.revision, Inspection.finished_at, _NEWEST)
_STALE = _TOKEN.outerjoin(
    IndexedInspection, IndexedInspection.inspection_id == Inspection.id
).where(
    or_(
        IndexedInspection.inspection_id.is_(None),
        IndexedInspection.index_version != INDEX_VERSION,
        IndexedInspection.revision != Inspection.revision,
        IndexedInspection.finished_at.is_distinct_from(Inspection.finished_at),
        IndexedInspection.newest_event.is_distinct_from(_NEWEST),
    )
)
HAS_PHOTO = and_(
    ObservationRow.photo_frame == ObservationRow.frame, ObservationRow.photo_error.is_(None)
)
WITH_PHOTO = select(IndexedDefect, HAS_PHOTO).join(
    ObservationRow,
    and_(
        ObservationRow.inspection_id == IndexedDefect.inspection_id,
        ObservationRow.id == IndexedDefect.observation_id,
    ),
)


def _found(session: Session, query: Select[IndexedDefect, bool]) -> list[FoundDefect]:
    return [FoundDefect(row, bool(has_photo)) for row, has_photo in session.execute(query)]


def _conditions(wanted: DefectFilter) -> Iterator[ColumnElement[bool]]:
    if wanted.code:
        yield IndexedDefect.code.startswith(wanted.code, autoescape=True)
    else:
        is_other = func.coalesce(IndexedDefect.code, "").not_in(NO_DEFECTS)
        yield or_(is_other, IndexedDefect.severity > 0)
    if wanted.severity_from is not None:
        yield IndexedDefect.severity >= wanted.severity_from
    if wanted.project is not None:
        yield IndexedDefect.project == wanted.project
    if wanted.asset is not None:
        yield IndexedDefect.asset == wanted.asset
    if wanted.from_m is not None:
        yield IndexedDefect.distance_m >= wanted.from_m
    if wanted.to_m is not None:
        yield IndexedDefect.distance_m <= wanted.to_m
    if wanted.clock_hours is not None:
        yield IndexedDefect.clock_hours.bitwise_and(wanted.clock_hours) != 0
    if wanted.after is not None:
        yield IndexedDefect.surveyed_on >= wanted.after
    if wanted.before is not None:
        yield IndexedDefect.surveyed_on <= wanted.before
    yield from with_words(IndexedDefect.folded, wanted.text)
