"""The films of the archive that wait, for the intake: it claims one, and ends its waiting."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Select, func, or_, select, update
from sqlalchemy.orm import Session

from app.errors import ClaimLost, NoLongerWanted
from app.storage.archive.selection import ROW, FilmRow, StoredState
from app.storage.database.database import Database
from app.storage.database.tables import ArchiveFilm, EventRow, Inspection
from app.storage.records.inspections import existing


class IntakeStore:
    """Gives a film to one server at a time."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def ahead(self) -> int:
        """Return the number of films that wait in the queue of inspections."""
        query = (
            select(func.count())
            .select_from(Inspection)
            .join(ArchiveFilm, ArchiveFilm.id == Inspection.id)
            .where(Inspection.status == "queued")
        )
        with self._database.read() as session:
            return session.scalar(query) or 0

    def claim_next(self, server: str, until: datetime) -> FilmRow | None:
        """Claim the waiting film that is next; None if there is none."""
        with self._database.read() as session:
            if session.execute(_next_waiting(server)).first() is None:
                return None  # read first, as a write costs a sync of the disk

        def claim(session: Session) -> FilmRow | None:
            found = session.execute(_next_waiting(server)).first()
            if found is None:
                return None
            row = FilmRow(*found)
            row.film.claimed_by, row.film.claimed_until = server, until
            return row

        return self._database.write(claim)

    def renew(self, film_id: str, server: str, until: datetime) -> None:
        """Keep a claim.

        Raises:
            NoLongerWanted: The film was paused, cancelled or deleted.
            ClaimLost: Another server has claimed it.
        """

        def apply(session: Session) -> None:
            _claimed(session, film_id, server).claimed_until = until

        self._database.write(apply)

    def take(self, film_id: str, server: str, inspection: Inspection, who: str) -> None:
        """Add the inspection of a claimed film, in the transaction that ends its waiting.

        Raises:
            NoLongerWanted: The film was paused, cancelled or deleted.
            ClaimLost: Another server has claimed it.
        """

        def apply(session: Session) -> None:
            film = _claimed(session, film_id, server)
            session.add(inspection)
            session.add(EventRow.now(inspection, "created", who, None, inspection.editable()))
            _end_waiting(film, "idle")

        self._database.write(apply)

    def note_taken(self, film_id: str, server: str) -> None:
        """End the waiting of a claimed film whose inspection is under way; the inspection gets its
        priority.

        Raises:
            NoLongerWanted: The film was paused, cancelled or deleted.
            ClaimLost: Another server has claimed it.
        """

        def apply(session: Session) -> None:
            film = _claimed(session, film_id, server)
            _end_waiting(film, "idle")
            existing(session, film_id).priority = film.priority

        self._database.write(apply)

    def refuse(self, film_id: str, server: str, values: Mapping[str, Any]) -> None:
        """End the waiting of a claimed film that cannot be taken in.

        Args:
            film_id, server: The claim.
            values: Columns: the error, and what is different about the file.
        Raises:
            NoLongerWanted: The film was paused, cancelled or deleted.
            ClaimLost: Another server has claimed it.
        """

        def apply(session: Session) -> None:
            film = _claimed(session, film_id, server)
            _end_waiting(film, "refused")
            for name, value in values.items():
                setattr(film, name, value)

        self._database.write(apply)

    def release(self, film_id: str, server: str) -> None:
        """Give a claim back; the film goes on waiting."""

        def apply(session: Session) -> None:
            session.execute(
                update(ArchiveFilm)
                .where(ArchiveFilm.id == film_id, ArchiveFilm.claimed_by == server)
                .values(claimed_by=None, claimed_until=None)
                .execution_options(synchronize_session=False)
            )

        self._database.write(apply)


def _next_waiting(server: str) -> Select[Any]:
    is_free = or_(
        ArchiveFilm.claimed_until.is_(None),
        ArchiveFilm.claimed_until < datetime.now(UTC),
        # The claim of an earlier process on this data folder, which nobody else can be using.
        ArchiveFilm.claimed_by == server,
    )
    return (
        ROW.where(ArchiveFilm.state == "waiting", ArchiveFilm.rig.is_not(None), is_free)
        .order_by(ArchiveFilm.priority.desc(), ArchiveFilm.wanted_at, ArchiveFilm.path)
        .limit(1)
    )


def _claimed(session: Session, film_id: str, server: str) -> ArchiveFilm:
    film = session.get(ArchiveFilm, film_id)
    if film is None or film.state != "waiting":
        raise NoLongerWanted("The film waits no more.")
    if film.claimed_by != server:
        raise ClaimLost("Another server has claimed the film.")
    return film


def _end_waiting(film: ArchiveFilm, state: StoredState) -> None:
    film.state = state
    film.wanted_at = film.claimed_by = film.claimed_until = None
