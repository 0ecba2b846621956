"""Inspections in the database: name and header, counts, and the history."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Any

from sqlalchemy import ColumnElement, Integer, and_, cast, func, or_, select
from sqlalchemy.orm import InstrumentedAttribute, Session, aliased

from app.errors import InspectionLocked, InspectionNotFound
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import (
    ENDED,
    AcceptanceAnswer,
    EventRow,
    Inspection,
    ObservationRow,
    RemarkRow,
)
from app.storage.records.packs import require_pack_of
from app.survey.fields.header import project_of
from app.survey.observations.defects import NO_DEFECTS
from app.survey.observations.records import Event
from app.survey.observations.review import APPROVED
from app.survey.versions import Require


@dataclass(frozen=True)
class Summary:
    """An inspection with the number of its observations."""

    row: Inspection
    observations: int
    defects: int
    """Those of its observations that are defects; a stretch is one."""
    worst_severity: int | None
    open_questions: int
    """Questions of reviewers and clients that are not settled."""


class InspectionStore(Store):
    """Returns detached rows: changing them does not change the database."""

    @reading
    def get(self, session: Session, inspection_id: str) -> Inspection:
        """Return the inspection with this id.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        return existing(session, inspection_id)

    @reading
    def summary(self, session: Session, inspection_id: str) -> Summary:
        """Return the inspection with this id and its counts.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        found = session.execute(SUMMARY.where(Inspection.id == inspection_id)).one_or_none()
        if found is None:
            raise InspectionNotFound(_NOT_FOUND)
        return Summary(*found)

    @reading
    def summaries(self, session: Session) -> list[Summary]:
        """Return all inspections with their counts, the newest first."""
        query = SUMMARY.order_by(Inspection.created_at.desc(), Inspection.id)
        return [Summary(*found) for found in session.execute(query)]

    @reading
    def ended(self, session: Session) -> list[str]:
        """Return the ids of the ended inspections, the newest first."""
        query = (
            select(Inspection.id)
            .where(Inspection.status.in_(ENDED))
            .order_by(Inspection.created_at.desc())
        )
        return list(session.scalars(query))

    @reading
    def has_project(self, session: Session, project: str) -> bool:
        """Return whether an inspection belongs to this project."""
        headers = session.scalars(select(Inspection.header))
        return any(project_of(header) == project for header in headers)

    @reading
    def state(self, session: Session, inspection_id: str) -> tuple[Hashable, ...]:
        """Return a state that differs after every change to the report of an ended inspection.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        newest = select(func.max(EventRow.id)).where(EventRow.inspection_id == inspection_id)
        photos = select(
            func.count(ObservationRow.photo_error),
            func.sum(cast(ObservationRow.photo_frame == ObservationRow.frame, Integer)),
        ).where(ObservationRow.inspection_id == inspection_id)
        row = existing(session, inspection_id)
        made = tuple(session.execute(photos).one())
        return (row.revision, row.status, row.finished_at, session.scalar(newest), *made)

    @reading
    def counts(self, session: Session) -> dict[str, int]:
        """Return the number of inspections of each status."""
        query = select(Inspection.status, func.count()).group_by(Inspection.status)
        return {status: number for status, number in session.execute(query)}  # noqa: C416

    @reading
    def events(
        self, session: Session, inspection_id: str, observation_id: str | None = None
    ) -> list[Event]:
        """Return every event of the inspection or of one observation, oldest first."""
        query = (
            select(EventRow).where(EventRow.inspection_id == inspection_id).order_by(EventRow.id)
        )
        if observation_id is not None:
            query = query.where(EventRow.observation_id == observation_id)
        return [row.record() for row in session.scalars(query.order_by(EventRow.id))]

    @writing
    def add(self, session: Session, inspection: Inspection, who: str) -> None:
        """Add a new inspection; `inspection` can then be used like a result of get()."""
        session.add(inspection)
        session.add(EventRow.now(inspection, "created", who, None, inspection.editable()))

    @writing
    def change(
        self,
        session: Session,
        inspection_id: str,
        who: str,
        name: str | None,
        header: Mapping[str, Any] | None,
        require: Require | None = None,
    ) -> None:
        """Replace the name or the header; None keeps it.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            PackNotFound: The header names a code pack that does not exist.
            Exception: Whatever `require` raises for the name and header that are stored.
        """
        row = unlocked(session, inspection_id)
        before = row.editable()
        if require is not None:
            require(before)
        if header is not None and header.get("code_pack") != row.header.get("code_pack"):
            require_pack_of(session, header)
        row.name = row.name if name is None else name
        row.header = row.header if header is None else dict(header)
        after = row.editable()
        if after != before:
            session.add(EventRow.now(row, "changed", who, before, after))

    @writing
    def delete(self, session: Session, inspection_id: str, who: str) -> None:
        """Delete an inspection with its observations; its events stay.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
        """
        row = unlocked(session, inspection_id)
        session.delete(row)
        session.add(EventRow.now(row, "deleted", who, row.editable(), None))

    @writing
    def finish(
        self, session: Session, inspection_id: str, who: str, stated: Mapping[str, Any]
    ) -> None:
        """Add the end of the run to the header, as the event "finished".

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
        """
        row = unlocked(session, inspection_id)
        before = row.editable()
        row.header = {**row.header, **stated}
        session.add(EventRow.now(row, "finished", who, before, row.editable()))


def open_questions(inspection_id: str | InstrumentedAttribute[str]) -> ColumnElement[int]:
    """Count the unsettled questions about observations of an inspection that are not deleted, and
    those of clients that nobody has answered.
    """
    asked_about = aliased(ObservationRow)
    of_reviewers = (
        select(func.count())
        .select_from(RemarkRow)
        .join(
            asked_about,
            and_(
                asked_about.inspection_id == RemarkRow.inspection_id,
                asked_about.id == RemarkRow.observation_id,
                asked_about.deleted_at.is_(None),
            ),
        )
        .where(
            RemarkRow.inspection_id == inspection_id,
            RemarkRow.kind == "question",
            RemarkRow.settled_at.is_(None),
        )
    )
    of_clients = select(func.count(AcceptanceAnswer.id)).where(
        AcceptanceAnswer.inspection_id == inspection_id,
        AcceptanceAnswer.kind == "question",
        AcceptanceAnswer.reply.is_(None),
    )
    both = (query.correlate(Inspection).scalar_subquery() for query in (of_reviewers, of_clients))
    return reduce(add, both)


_NOT_FOUND = "There is no such inspection."
SEVERITY = cast(ObservationRow.fields["severity"].as_string(), Integer)
"""Of an observation."""
_QUESTIONS = open_questions(Inspection.id)
_CODE, _CONTINUOUS = (
    func.coalesce(ObservationRow.fields[name].as_string(), "") for name in ("code", "continuous")
)
# As in app.survey.observations.defects.
_PART = func.coalesce(func.nullif(func.substr(_CONTINUOUS, 2), ""), ObservationRow.id)
_DEFECTS = func.count(_PART.distinct()).filter(or_(_CODE.not_in(NO_DEFECTS), SEVERITY > 0))
SUMMARY = (
    select(Inspection, func.count(ObservationRow.id), _DEFECTS, func.max(SEVERITY), _QUESTIONS)
    .outerjoin(
        ObservationRow,
        and_(ObservationRow.inspection_id == Inspection.id, ObservationRow.deleted_at.is_(None)),
    )
    .group_by(Inspection.id)
)
"""The columns of `Summary`."""


def existing(session: Session, inspection_id: str) -> Inspection:
    """Return the row of this id, within a session.

    Raises:
        InspectionNotFound: No inspection has this id.
    """
    row = session.get(Inspection, inspection_id)
    if row is None:
        raise InspectionNotFound(_NOT_FOUND)
    return row


def unlocked(session: Session, inspection_id: str) -> Inspection:
    """Return the row of this id for a change of its content, within the transaction of the change.

    Raises:
        InspectionNotFound: No inspection has this id.
        InspectionLocked: It is approved.
    """
    row = existing(session, inspection_id)
    require_unlocked(row)
    return row


def require_unlocked(row: Inspection) -> None:
    """Raise InspectionLocked if the inspection is approved."""
    if row.review_state == APPROVED:
        raise InspectionLocked(
            f"The inspection {row.name!r} was approved by {row.reviewed_by}, so it is locked; "
            "reopen it first."
        )
