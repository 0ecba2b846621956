"""Inspections that arrive whole, with their observations, in one transaction."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy.orm import Session

from app.storage.database import Database
from app.storage.tables import Event, Inspection, Observation


class ImportStore:
    """Adds; everything else is done as with other inspections."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(
        self,
        inspection: Inspection,
        observations: Sequence[Observation],
        events: Sequence[Event],
    ) -> None:
        """Commit a new inspection with all that belongs to it; it is synced when this returns.

        Args:
            inspection: With an id of its own.
            observations: Of that inspection, with their numbers.
            events: Of that inspection, oldest first.
        """

        def insert(session: Session) -> None:
            session.add(inspection)
            session.flush()
            session.add_all(observations)
            session.add_all(events)

        self._database.write(insert)
