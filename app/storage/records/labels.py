"""Labels: the words by which people sort their inspections.

They are not part of what is approved: an inspection gets labels such as "invoiced" after that.
"""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from app.storage.database.database import batches
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import EventRow, InspectionLabel
from app.storage.records.inspections import existing
from app.survey.observations.records import LABELLED


class LabelStore(Store):
    """Reads and replaces the labels of inspections."""

    @reading
    def of(self, session: Session, inspection_ids: Sequence[str]) -> dict[str, tuple[str, ...]]:
        """Return the sorted labels of these inspections that have any."""
        return labels_of(session, inspection_ids)

    @reading
    def in_use(self, session: Session) -> list[tuple[str, int]]:
        """Return all labels with the number of their inspections, the most used first."""
        number = func.count().label("number")
        query = (
            select(InspectionLabel.label, number)
            .group_by(InspectionLabel.label)
            .order_by(number.desc(), InspectionLabel.label)
        )
        return [(label, n) for label, n in session.execute(query)]

    @writing
    def put(self, session: Session, inspection_id: str, labels: Sequence[str], who: str) -> None:
        """Replace the labels of an inspection, approved or not; return when it is synced.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        row = existing(session, inspection_id)
        before = labels_of(session, [inspection_id]).get(inspection_id, ())
        after = tuple(sorted(labels))
        if after == before:
            return
        mine = InspectionLabel.inspection_id == inspection_id
        session.execute(delete(InspectionLabel).where(mine))
        session.add_all(labelled(inspection_id, after))
        changed = ({"labels": list(before)}, {"labels": list(after)})
        session.add(EventRow.now(row, LABELLED, who, *changed))


def labels_of(session: Session, inspection_ids: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the sorted labels of these inspections that have any, within a session."""
    query = select(InspectionLabel.inspection_id, InspectionLabel.label)
    found: dict[str, list[str]] = {}
    for some in batches(inspection_ids):
        of_some = query.where(InspectionLabel.inspection_id.in_(some))
        for inspection_id, label in session.execute(of_some):
            found.setdefault(inspection_id, []).append(label)
    return {inspection_id: tuple(sorted(labels)) for inspection_id, labels in found.items()}


def labelled(inspection_id: str, labels: Sequence[str]) -> list[InspectionLabel]:
    """Make the rows to add to a session."""
    return [InspectionLabel(inspection_id=inspection_id, label=label) for label in labels]
