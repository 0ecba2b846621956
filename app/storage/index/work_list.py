"""The day's work: how far each section of the register is, and the inspections around it.

Nothing of it is stored.  The state of a section is that of its newest inspection of the present
round: one under another project than the register's is of another round, so a list that is
imported under a new project begins with everything to do.  A work order begins a round of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from typing import Any

from sqlalchemy import ColumnElement, Subquery, and_, case, func, literal, or_, select
from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading
from app.storage.database.tables import (
    ENDED,
    IndexedInspection,
    Inspection,
    RegisteredAsset,
    WorkOrder,
)
from app.storage.index.queries import NEWEST_LAST, a_page, of_project, unknown_last, with_words
from app.survey.assets.search_terms import WORK_STATES, Page, WorkFilter, WorkSort, WorkState
from app.survey.assets.work_orders import ENDS, State
from app.survey.distances.intended_use import IntendedUse
from app.survey.observations.review import APPROVED, DRAFT, REOPENED

_SHOWN = 5
"""Inspections of each kind beside the list."""


@dataclass(frozen=True)
class Ordered:
    """The open work order of a section that is due first."""

    id: str
    number: str
    reason: str
    due_on: date | None
    is_overdue: bool
    """Whether its day is past, and nothing was inspected yet."""


@dataclass(frozen=True)
class Section:
    """A section of the register, and how far its inspection is."""

    asset: str
    project: str | None
    header: Mapping[str, Any]
    """What the register says of it."""
    state: WorkState
    last_at: date | None
    """Day of its newest survey of any round; None if it was never inspected."""
    worst_severity: int | None
    """Of that survey."""
    inspection_id: str | None
    """The inspection that the state is of; the next two are of its end."""
    distance_u95_m: float | None
    is_useful: bool | None
    """Whether that interval is of use; None if nobody measured it."""
    order: Ordered | None


@dataclass(frozen=True)
class Work:
    """A page of the sections that fit."""

    total: int
    sections: list[Section]
    states: Mapping[WorkState, int]
    """Number of sections in each state, whatever state is wanted."""


@dataclass(frozen=True)
class Brief:
    """An inspection in one line."""

    id: str
    name: str
    status: str
    review_state: str
    created_at: datetime
    worst_severity: int | None
    distance_u95_m: float | None
    is_useful: bool | None


@dataclass(frozen=True)
class Briefs:
    """The newest inspections of a kind."""

    total: int
    inspections: list[Brief]


class WorkList(Store):
    """Answers what there is to do."""

    @reading
    def work(
        self, session: Session, wanted: WorkFilter, page: Page[WorkSort], use: IntendedUse
    ) -> Work:
        """Return the sections that fit, and the number in each state."""
        rows, today = _SECTIONS, datetime.now(UTC).date()
        narrowed = tuple(_narrowed(rows, wanted, today))
        by_state = select(rows.c.state, func.count()).where(*narrowed).group_by(rows.c.state)
        numbers = {rank: number for rank, number in session.execute(by_state)}  # noqa: C416
        query = select(rows).where(*narrowed)
        if wanted.state is not None:
            query = query.where(rows.c.state == WORK_STATES.index(wanted.state))
        column = rows.c["last_at" if page.sort == "last_on" else page.sort]
        total, found = a_page(session, query, (unknown_last(column, page), rows.c.asset), page)
        return Work(
            total,
            [
                Section(
                    asset,
                    project,
                    header,
                    WORK_STATES[rank],
                    at,
                    worst,
                    of,
                    u95,
                    use.is_met(m, u95),
                    _ordered(order, today),
                )
                for asset, project, header, rank, at, worst, of, m, u95, *order in found
            ],
            {state: numbers.get(rank, 0) for rank, state in enumerate(WORK_STATES)},
        )

    @reading
    def around(self, session: Session, use: IntendedUse) -> tuple[Briefs, Briefs, Briefs]:
        """Return the inspections that are live, that wait for a reviewer, and that have ended."""
        in_review = Inspection.review_state.in_(("submitted", "in_review"))
        has_ended = Inspection.status.in_(ENDED)
        return (
            _briefs(session, use, _IS_LIVE),
            _briefs(session, use, in_review),
            _briefs(session, use, and_(has_ended, ~in_review)),
        )


_NOT_INSPECTED: tuple[State, ...] = ("ordered", "in_progress")
_IS_LIVE = and_(Inspection.source_kind == "live", Inspection.status.not_in(ENDED))


def _briefs(session: Session, use: IntendedUse, condition: ColumnElement[bool]) -> Briefs:
    total = session.scalar(select(func.count()).select_from(Inspection).where(condition)) or 0
    query = (
        select(
            Inspection.id,
            Inspection.name,
            Inspection.status,
            Inspection.review_state,
            Inspection.created_at,
            IndexedInspection.worst_severity,
            IndexedInspection.distance_m,
            IndexedInspection.distance_u95_m,
        )
        .outerjoin(IndexedInspection, IndexedInspection.inspection_id == Inspection.id)
        .where(condition)
        .order_by(Inspection.created_at.desc())
        .limit(_SHOWN)
    )
    return Briefs(
        total,
        [
            Brief(id_, name, status, review, at, worst, u95_m, use.is_met(end_m, u95_m))
            for id_, name, status, review, at, worst, end_m, u95_m in session.execute(query)
        ],
    )


def _due() -> Subquery:
    """Return the open work orders, the one of each asset that is due first as place 1."""
    by_day = (WorkOrder.due_on.asc().nulls_last(), WorkOrder.ordered_at, WorkOrder.id)
    return (
        select(
            WorkOrder.id.label("order_id"),
            WorkOrder.asset_id,
            WorkOrder.number,
            WorkOrder.reason,
            WorkOrder.due_on,
            WorkOrder.state.label("order_state"),
            WorkOrder.ordered_at,
            func.row_number().over(partition_by=WorkOrder.asset_id, order_by=by_day).label("place"),
        )
        .where(WorkOrder.state.not_in(ENDS))
        .subquery()
    )


def _ordered(found: Sequence[Any], today: date) -> Ordered | None:
    order_id, number, reason, due_on, state = found
    if order_id is None:
        return None
    is_overdue = due_on is not None and due_on < today and state in _NOT_INSPECTED
    return Ordered(order_id, number, reason, due_on, is_overdue)


def _state_of_review() -> ColumnElement[int]:
    """Return the place of an inspection's state in WORK_STATES."""
    return case(
        (_IS_LIVE, WORK_STATES.index("live")),
        (Inspection.review_state == APPROVED, WORK_STATES.index("issued")),
        (Inspection.review_state.in_((DRAFT, REOPENED)), WORK_STATES.index("recorded")),
        else_=WORK_STATES.index("in_review"),
    )


def _sections() -> Subquery:
    """Return every section of the register once; the columns are the fields of `Section`, with the
    place of the state in WORK_STATES, the end in place of whether it is of use, and the order.
    """
    due = _due()
    is_first = and_(due.c.asset_id == RegisteredAsset.asset_id, due.c.place == 1)
    is_of_round = or_(
        and_(due.c.ordered_at.is_not(None), Inspection.created_at >= due.c.ordered_at),
        and_(
            due.c.ordered_at.is_(None),
            or_(
                RegisteredAsset.project.is_(None),
                IndexedInspection.project.is_(None),
                IndexedInspection.project == RegisteredAsset.project,
            ),
        ),
    )
    state = _state_of_review()
    by_day = (IndexedInspection.surveyed_on.desc(), Inspection.created_at.desc(), Inspection.id)
    surveys = (
        select(
            RegisteredAsset.asset_id.label("asset"),
            IndexedInspection.inspection_id,
            IndexedInspection.surveyed_on,
            IndexedInspection.worst_severity,
            IndexedInspection.distance_m,
            IndexedInspection.distance_u95_m,
            is_of_round.label("is_of_round"),
            state.label("state"),
            func.rank()
            .over(
                partition_by=RegisteredAsset.asset_id,
                order_by=[column.desc() for column in NEWEST_LAST],
            )
            .label("rank"),
            func.row_number()
            .over(
                partition_by=(RegisteredAsset.asset_id, is_of_round),
                order_by=(case((_IS_LIVE, 0), else_=1), *by_day),
            )
            .label("place"),
        )
        .join(IndexedInspection, IndexedInspection.asset == RegisteredAsset.asset_id)
        .join(Inspection, Inspection.id == IndexedInspection.inspection_id)
        .outerjoin(due, is_first)
        .subquery()
    )
    is_newest, is_present = surveys.c.rank == 1, and_(surveys.c.is_of_round, surveys.c.place == 1)
    inspected = (
        select(
            surveys.c.asset,
            func.max(case((is_newest, surveys.c.surveyed_on))).label("last_at"),
            func.max(case((is_newest, surveys.c.worst_severity))).label("worst_severity"),
            func.max(case((is_present, surveys.c.state))).label("state"),
            func.max(case((is_present, surveys.c.inspection_id))).label("inspection_id"),
            func.max(case((is_present, surveys.c.distance_m))).label("distance_m"),
            func.max(case((is_present, surveys.c.distance_u95_m))).label("distance_u95_m"),
        )
        .group_by(surveys.c.asset)
        .subquery()
    )
    to_do = literal(WORK_STATES.index("to_do"))
    return (
        select(
            RegisteredAsset.asset_id.label("asset"),
            RegisteredAsset.project,
            RegisteredAsset.header,
            func.coalesce(inspected.c.state, to_do).label("state"),
            inspected.c.last_at,
            inspected.c.worst_severity,
            inspected.c.inspection_id,
            inspected.c.distance_m,
            inspected.c.distance_u95_m,
            due.c.order_id,
            due.c.number,
            due.c.reason,
            due.c.due_on,
            due.c.order_state,
        )
        .outerjoin(inspected, inspected.c.asset == RegisteredAsset.asset_id)
        .outerjoin(due, is_first)
        .subquery()
    )


_SECTIONS = _sections()


def _narrowed(rows: Subquery, wanted: WorkFilter, today: date) -> Iterator[ColumnElement[bool]]:
    if wanted.text:
        in_register = with_words(RegisteredAsset.folded, wanted.text)
        yield rows.c.asset.in_(select(RegisteredAsset.asset_id).where(*in_register))
    yield from of_project(rows.c.project, wanted.of)
    if wanted.orders is not None:
        yield rows.c.order_id.is_not(None)
    if wanted.orders == "overdue":
        yield and_(rows.c.due_on < today, rows.c.order_state.in_(_NOT_INSPECTED))
