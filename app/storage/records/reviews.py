"""The review of inspections in the database: its state, and remarks on observations."""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import and_, func, select
from sqlalchemy.orm import Session

from app.errors import (
    Forbidden,
    ObservationNotFound,
    OpenQuestions,
    RemarkNotFound,
    StillRunning,
    WrongReviewState,
)
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import ENDED, EventRow, Inspection, ObservationRow, RemarkRow
from app.storage.records.inspections import existing, open_questions, unlocked
from app.survey.observations.records import BROUGHT_IN, REVIEWED, Event
from app.survey.observations.review import (
    APPROVED,
    RemarkKind,
    ReviewState,
    is_for_admins,
    may_follow,
)
from app.survey.observations.tag import StatedTag, entered
from app.survey.versions import require_version, version_of


class ReviewStore(Store):
    """Moves inspections through their review; returned rows are detached."""

    @reading
    def remarks(self, session: Session, inspection_id: str) -> list[RemarkRow]:
        """Return the remarks on all observations that are not deleted, oldest first.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        existing(session, inspection_id)
        query = (
            select(RemarkRow)
            .join(
                ObservationRow,
                and_(
                    ObservationRow.inspection_id == RemarkRow.inspection_id,
                    ObservationRow.id == RemarkRow.observation_id,
                    ObservationRow.deleted_at.is_(None),
                ),
            )
            .where(RemarkRow.inspection_id == inspection_id)
            .order_by(RemarkRow.made_at, RemarkRow.id)
        )
        return list(session.scalars(query))

    @reading
    def steps(self, session: Session, inspection_id: str) -> list[Event]:
        """Return every change of the state, oldest first; those before an import that began the
        review anew are not of this review.
        """
        imported = select(func.coalesce(func.max(EventRow.id), 0)).where(
            EventRow.inspection_id == inspection_id,
            EventRow.action == BROUGHT_IN,
            EventRow.after.is_(None),
        )
        query = (
            select(EventRow)
            .where(
                EventRow.inspection_id == inspection_id,
                EventRow.action == REVIEWED,
                EventRow.id > imported.scalar_subquery(),
            )
            .order_by(EventRow.id)
        )
        return [row.record() for row in session.scalars(query)]

    @writing
    def move(
        self,
        session: Session,
        inspection_id: str,
        state: ReviewState,
        who: str,
        reason: str | None,
        *,
        is_admin: bool,
    ) -> bool:
        """Set the state of the review; return whether it was another one.

        Raises:
            InspectionNotFound: No inspection has this id.
            Forbidden: Only admins approve, and reopen what is approved.
            StillRunning: It is queued or running.
            WrongReviewState: The state cannot directly follow the present one.
            OpenQuestions: It is to be approved, and a question is not settled.
        """
        row = existing(session, inspection_id)
        if row.review_state == state:
            return False
        if is_for_admins(row.review_state, state) and not is_admin:
            raise Forbidden(f"Only an admin may set {row.review_state!r} to {state!r}.")
        _require_step(session, row, state)
        before, after = {"review": row.review_state}, {"review": state}
        row.review_state = state
        row.reviewed_at, row.reviewed_by = datetime.now(UTC), who
        session.add(EventRow.now(row, REVIEWED, who, before, after, reason))
        return True

    @writing
    def remark(
        self,
        session: Session,
        inspection_id: str,
        remark_id: str,
        observation_id: str,
        kind: RemarkKind,
        text: str,
        who: str,
        *,
        seen: str | None,
    ) -> None:
        """Add a remark; one that exists stays as it is.

        Args:
            inspection_id, remark_id, observation_id: The remark, and what it is about.
            kind, text: What is said.
            who: Name of its author.
            seen: Version of the observation that the author saw; None for the stored one.
        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            ObservationNotFound: The inspection has no such observation.
            ChangedMeanwhile: Another version of it is stored by now.
        """
        unlocked(session, inspection_id)
        if session.get(RemarkRow, (inspection_id, remark_id)) is not None:
            return
        observation = session.get(ObservationRow, (inspection_id, observation_id))
        if observation is None or observation.deleted_at is not None:
            raise ObservationNotFound("There is no such observation.")
        fields = entered(StatedTag.kept(observation.fields).to_json())
        require_version(fields, None, seen)
        row = RemarkRow(
            inspection_id=inspection_id,
            id=remark_id,
            observation_id=observation_id,
            kind=kind,
            text=text,
            version=version_of(fields),
            made_at=datetime.now(UTC),
            made_by=who,
        )
        session.add(row)
        session.add(EventRow.now(row, kind, who, remark=row.text or None))

    @writing
    def settle(
        self, session: Session, inspection_id: str, remark_id: str, who: str, *, is_settled: bool
    ) -> None:
        """Settle a question, or open it again.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            RemarkNotFound: It has no such remark.
        """
        row = _remark(session, inspection_id, remark_id)
        if (row.settled_at is not None) == is_settled:
            return
        row.settled_at = datetime.now(UTC) if is_settled else None
        row.settled_by = who if is_settled else None
        session.add(
            EventRow.now(
                row, "settled" if is_settled else "unsettled", who, remark=row.text or None
            )
        )

    @writing
    def withdraw(
        self, session: Session, inspection_id: str, remark_id: str, who: str, *, is_admin: bool
    ) -> None:
        """Remove a remark, if it is there.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            Forbidden: Somebody else has made it, and `who` is no admin.
        """
        unlocked(session, inspection_id)
        row = session.get(RemarkRow, (inspection_id, remark_id))
        if row is None:
            return
        if row.made_by != who and not is_admin:
            raise Forbidden(
                f"{row.made_by} has made this remark, so only they or an admin may remove it."
            )
        session.delete(row)
        session.add(EventRow.now(row, "withdrawn", who, remark=row.text or None))


def _require_step(session: Session, row: Inspection, state: ReviewState) -> None:
    if not may_follow(row.review_state, state):
        raise WrongReviewState(
            f"The review is {row.review_state!r}, which {state!r} cannot follow; read it again."
        )
    if row.status not in ENDED:
        raise StillRunning(f"The inspection is {row.status}; it can be reviewed when it has ended.")
    if state == APPROVED and (number := session.scalar(select(open_questions(row.id)))):
        raise OpenQuestions(f"Questions that are not settled: {number}.")


def _remark(session: Session, inspection_id: str, remark_id: str) -> RemarkRow:
    unlocked(session, inspection_id)
    row = session.get(RemarkRow, (inspection_id, remark_id))
    if row is None:
        raise RemarkNotFound("There is no such remark.")
    return row
