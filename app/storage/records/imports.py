"""Stores imported inspections with their observations, those of a file in one transaction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.storage.database.limits import limited
from app.storage.database.store import Store, writing
from app.storage.database.tables import Base, EventRow, Inspection, ObservationRow
from app.storage.records.labels import labelled
from app.survey.observations.records import Event, Observation


@dataclass(frozen=True)
class Rows:
    """A new inspection with all that belongs to it."""

    inspection: Inspection
    """Its row, with its own id."""
    observations: Sequence[Observation]
    """Each with its number in the inspection."""
    events: Sequence[Event]
    """The oldest first."""
    labels: Sequence[str] = ()
    """None of them twice."""
    more: Sequence[Base] = ()
    """Rows of its attachments and remarks, and of the code pack that it brings along."""


class ImportStore(Store):
    """Adds imported inspections; after that they are treated like others."""

    def has_known(self, inspection_id: str) -> bool:
        """Return whether an inspection of this id exists or ever existed, also in projects that
        the running request does not see: its events stay.
        """
        event = select(EventRow.id).where(EventRow.inspection_id == inspection_id).limit(1)
        with limited(None), self.database.read() as session:
            is_deleted = session.scalar(event) is not None
            return is_deleted or session.get(Inspection, inspection_id) is not None

    @writing
    def add(self, session: Session, made: Sequence[Rows]) -> None:
        """Commit new inspections, all or none; return when they are synced."""
        # Made here and added in bulk, as others wait for the writer: a file may have 20 000.
        observations = [ObservationRow.of(one) for rows in made for one in rows.observations]
        events = [EventRow.of(event) for rows in made for event in rows.events]
        session.add_all([rows.inspection for rows in made])
        session.flush()
        session.bulk_save_objects(observations)
        session.bulk_save_objects(events)
        for rows in made:
            session.add_all(labelled(rows.inspection.id, rows.labels))
            session.add_all(rows.more)
