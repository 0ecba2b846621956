"""The films of the archive that wait, for the intake, which ends their waiting."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.errors import NoLongerWanted
from app.storage.archive.selection import ROW, FilmRow, StoredState
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import ArchiveFilm, EventRow, Inspection
from app.storage.records.inspections import existing


class IntakeStore(Store):
    """Finds the next film, and stores what became of it."""

    @reading
    def ahead(self, session: Session) -> int:
        """Return the number of films that wait in the queue of inspections."""
        query = (
            select(func.count())
            .select_from(Inspection)
            .join(ArchiveFilm, ArchiveFilm.id == Inspection.id)
            .where(Inspection.status == "queued")
        )
        return session.scalar(query) or 0

    @reading
    def next_waiting(self, session: Session) -> FilmRow | None:
        """Return the waiting film that is next; None if there is none."""
        query = (
            ROW.where(ArchiveFilm.state == "waiting", ArchiveFilm.rig.is_not(None))
            .order_by(ArchiveFilm.priority.desc(), ArchiveFilm.wanted_at, ArchiveFilm.path)
            .limit(1)
        )
        found = session.execute(query).first()
        return None if found is None else FilmRow(*found)

    @reading
    def require_wanted(self, session: Session, film_id: str) -> None:
        """Raise NoLongerWanted if a film was paused, cancelled or deleted."""
        _waiting(session, film_id)

    @writing
    def take(self, session: Session, film_id: str, inspection: Inspection, who: str) -> None:
        """Add the inspection of a film, in the transaction that ends its waiting.

        Raises:
            NoLongerWanted: The film was paused, cancelled or deleted.
        """
        _end_waiting(session, film_id, "idle")
        session.add(inspection)
        session.add(EventRow.now(inspection, "created", who, None, inspection.editable()))

    @writing
    def note_taken(self, session: Session, film_id: str) -> None:
        """End the waiting of a film whose inspection is under way, which gets its priority.

        Raises:
            NoLongerWanted: The film was paused, cancelled or deleted.
        """
        film = _end_waiting(session, film_id, "idle")
        existing(session, film_id).priority = film.priority

    @writing
    def refuse(self, session: Session, film_id: str, values: Mapping[str, Any]) -> None:
        """End the waiting of a film that cannot be taken in.

        Args:
            film_id: The film.
            values: Columns: the error, and what is different about the file.
        Raises:
            NoLongerWanted: The film was paused, cancelled or deleted.
        """
        film = _end_waiting(session, film_id, "refused")
        for name, value in values.items():
            setattr(film, name, value)


def _waiting(session: Session, film_id: str) -> ArchiveFilm:
    film = session.get(ArchiveFilm, film_id)
    if film is None or film.state != "waiting":
        raise NoLongerWanted("The film waits no more.")
    return film


def _end_waiting(session: Session, film_id: str, state: StoredState) -> ArchiveFilm:
    film = _waiting(session, film_id)
    film.state, film.wanted_at = state, None
    return film
