"""Stores imported inspections with their observations, each in one transaction."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.storage.database import Database
from app.storage.labels import labelled
from app.storage.tables import Base, EventRow, Inspection, ObservationRow
from app.survey.records import Event, Observation


class ImportStore:
    """Adds imported inspections; after that they are treated like others."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def has_known(self, inspection_id: str) -> bool:
        """Return whether an inspection of this id exists or ever existed: its events stay."""
        with self._database.read() as session:
            event = select(EventRow.id).where(EventRow.inspection_id == inspection_id).limit(1)
            is_deleted = session.scalar(event) is not None
            return is_deleted or session.get(Inspection, inspection_id) is not None

    def add(
        self,
        inspection: Inspection,
        observations: Sequence[Observation],
        events: Sequence[Event],
        labels: Sequence[str] = (),
        more: Sequence[Base] = (),
    ) -> None:
        """Commit a new inspection with all that belongs to it; return when it is synced.

        Args:
            inspection: The row, with its own id.
            observations: Its observations, numbered.
            events: Its events, oldest first.
            labels: Its labels, each once.
            more: Rows of its attachments and remarks, and of the code pack that it brings along.
        """

        def insert(session: Session) -> None:
            session.add(inspection)
            session.flush()
            session.add_all(map(ObservationRow.of, observations))
            session.add_all(map(EventRow.of, events))
            session.add_all(labelled(inspection.id, labels))
            session.add_all(more)

        self._database.write(insert)
