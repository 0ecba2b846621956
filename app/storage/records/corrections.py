"""What was stated about distances, and the scale that a run found, in the database."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import ENDED, EventRow, Inspection
from app.storage.records.inspections import existing, unlocked
from app.survey.observations.records import RESCALED
from app.survey.observations.review import APPROVED
from app.survey.versions import Require


@dataclass(frozen=True)
class Rescaling:
    """A change of the distance scale that the run itself caused."""

    who: str
    before: dict[str, Any] | None
    """The scale by joints before; None if they did not count."""
    after: dict[str, Any] | None
    """The scale by joints after; without a `scale` it holds why they do not count."""
    remark: str


class CorrectionStore(Store):
    """Replaces what was stated; every change raises the revision of its inspection."""

    @writing
    def correct(
        self,
        session: Session,
        inspection_id: str,
        who: str,
        corrections: Mapping[str, Any],
        remark: str | None,
        *,
        unstated: Mapping[str, Any],
        require: Require | None = None,
    ) -> int:
        """Replace what was stated about the distances; return the next revision.

        Equal content changes nothing; `unstated` is the content before anything was stated.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            Exception: Whatever `require` raises for what is stored.
        """
        row = unlocked(session, inspection_id)
        before, after = row.corrections or dict(unstated), dict(corrections)
        if require is not None:
            require(before)
        if after != before:
            row.corrections = after
            row.revision += 1
            row.corrected_mm = row.sigma_corrected_mm = None
            session.add(EventRow.now(row, "corrected", who, before, after, remark))
        return row.revision

    @writing
    def rescale(
        self, session: Session, inspection_id: str, change: Rescaling, revision: int
    ) -> int | None:
        """Record that the run changed the distance scale; return the new revision.

        Return None and record nothing if the revision is no longer `revision`, or if the inspection
        was approved meanwhile.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        row = existing(session, inspection_id)
        if row.revision != revision or row.review_state == APPROVED:
            return None
        row.revision += 1
        row.corrected_mm = row.sigma_corrected_mm = None
        session.add(
            EventRow.now(row, RESCALED, change.who, change.before, change.after, change.remark)
        )
        return row.revision

    @reading
    def last_rescaled(self, session: Session, inspection_id: str) -> Mapping[str, Any] | None:
        """Return the scale of the last such record; None without one, or if it no longer
        applies.
        """
        newest = session.scalars(
            select(EventRow)
            .where(
                EventRow.inspection_id == inspection_id,
                EventRow.action.in_(("corrected", RESCALED)),
            )
            .order_by(EventRow.id.desc())
            .limit(1)
        ).first()
        if newest is None or newest.action != RESCALED:
            return None
        return None if newest.after is None or "refusal" in newest.after else newest.after

    @writing
    def record_corrected_end(
        self,
        session: Session,
        inspection_id: str,
        revision: int,
        distance_mm: float,
        sigma_mm: float,
    ) -> None:
        """Store the corrected distance of the end, unless the track was corrected or queued
        since.
        """
        row = session.get(Inspection, inspection_id)
        if row is not None and row.revision == revision and row.status in ENDED:
            row.corrected_mm, row.sigma_corrected_mm = distance_mm, sigma_mm
