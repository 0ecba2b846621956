"""What people change about the films of the archive: they add, start, stop or delete them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any, cast

from sqlalchemy import CursorResult, delete, func, literal, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from app.storage.archive.selection import (
    FilmState,
    Selection,
    StoredState,
    digest_of,
    ids_of,
    portions,
)
from app.storage.database.store import Store, writing
from app.storage.database.tables import ENDED, ArchiveFilm, EventRow, Inspection
from app.storage.records.inspections import require_unlocked
from app.survey.observations.review import APPROVED


class ArchiveChanges(Store):
    """Changes any number of films at once."""

    def add(self, films: Sequence[Mapping[str, Any]]) -> set[str]:
        """Add films, given by their columns; return the ids of those whose path was not known.

        They are idle unless state and wish are given.
        """
        added = set[str]()
        for some in portions(films):
            added |= self.database.write(_adding(some))
        return added

    def assign(self, given: Callable[[str, str], Mapping[str, Any] | None]) -> int:
        """Give unassigned films what `given` returns for their path and relative path: columns, or
        None to leave a film; return the number of those that were given something.
        """
        with self.database.read() as session:
            unassigned = session.scalars(ids_of(Selection(), "unassigned")).all()
        assigned = 0
        for some in portions(unassigned):
            assigned += self.database.write(_assigning(some, given))
        return assigned

    def set_state(
        self,
        selection: Selection,
        before: Sequence[FilmState],
        state: StoredState,
        who: str,
        *,
        priority: int | None = None,
    ) -> int:
        """Set the stored state of the selected films that are in one of the states before; return
        their number. For a film that begins to wait, `who` is the person its inspection names.

        A film that waits again keeps its place; one that becomes idle loses it.
        """
        values: dict[str, Any] = {"state": state}
        if state == "waiting":
            now = literal(datetime.now(UTC), ArchiveFilm.wanted_at.type)
            values |= {
                "wanted_at": func.coalesce(ArchiveFilm.wanted_at, now),
                "wanted_by": who,
                "error_code": None,
                "error_detail": None,
            }
        elif state == "idle":
            values["wanted_at"] = None
        if priority is not None:
            values["priority"] = priority
        return self._changed(
            update(ArchiveFilm)
            .where(ArchiveFilm.id.in_(ids_of(selection, *before)))
            .values(values)
            .execution_options(synchronize_session=False)
        )

    def change(
        self,
        ids: Sequence[str],
        who: str,
        values: Mapping[str, Any],
        header: Mapping[str, Any],
    ) -> int:
        """Change films and the headers of their inspections; return the number of the films.

        Args:
            ids: The films.
            who: Name for the history of the inspections.
            values: Columns of the films.
            header: Fields of their headers; None removes one.
        Raises:
            InspectionLocked: One of the inspections is approved; nothing is changed, unless that
                happens at this very moment.
        """
        stated = {**header, **header_of(values)}
        if stated:
            with self.database.read() as session:
                for some in portions(ids):
                    query = select(Inspection).where(Inspection.id.in_(some))
                    for row in session.scalars(query.where(Inspection.review_state == APPROVED)):
                        if _merged(row.header, stated) != row.header:
                            require_unlocked(row)
        changed = 0
        for some in portions(ids):
            changed += self.database.write(_changing(some, who, values, header))
        return changed

    def delete(self, selection: Selection) -> int:
        """Take films off the list; return their number. Their inspections stay."""
        return self._changed(
            delete(ArchiveFilm)
            .where(ArchiveFilm.id.in_(ids_of(selection)))
            .execution_options(synchronize_session=False)
        )

    @writing
    def _changed(self, session: Session, statement: Any) -> int:
        return cast("CursorResult[Any]", session.execute(statement)).rowcount


def _adding(films: Sequence[Mapping[str, Any]]) -> Callable[[Session], set[str]]:
    def insert(session: Session) -> set[str]:
        kind = postgresql if session.get_bind().dialect.name == "postgresql" else sqlite
        statement = (
            kind.insert(ArchiveFilm)
            .on_conflict_do_nothing(index_elements=[ArchiveFilm.path_sha256])
            .returning(ArchiveFilm.id)
        )
        idle = {"state": "idle", "wanted_at": None, "wanted_by": None}
        rows = [{**idle, **film, "path_sha256": digest_of(film["path"])} for film in films]
        return set(session.scalars(statement, rows))

    return insert


def _assigning(
    ids: Sequence[str], given: Callable[[str, str], Mapping[str, Any] | None]
) -> Callable[[Session], int]:
    def apply(session: Session) -> int:
        assigned = 0
        unassigned = select(ArchiveFilm).where(ArchiveFilm.id.in_(ids), ArchiveFilm.rig.is_(None))
        for film in session.scalars(unassigned):
            values = given(film.path, film.relative)
            if values is not None:
                assigned += 1
                for name, value in values.items():
                    setattr(film, name, value)
        return assigned

    return apply


def _changing(
    ids: Sequence[str], who: str, values: Mapping[str, Any], header: Mapping[str, Any]
) -> Callable[[Session], int]:
    def apply(session: Session) -> int:
        films = session.scalars(select(ArchiveFilm).where(ArchiveFilm.id.in_(ids))).all()
        for film in films:
            for name, value in values.items():
                setattr(film, name, value)
            film.header = _merged(film.header, header)
            if values.get("rig") is not None and film.state != "refused":
                film.error_code = film.error_detail = None
        if header or values.keys() & {"project", "asset"}:
            stated = {**header, **header_of(values)}
            for row in session.scalars(select(Inspection).where(Inspection.id.in_(ids))):
                before = row.editable()
                row.header = _merged(row.header, stated)
                if row.editable() != before:
                    require_unlocked(row)
                    session.add(EventRow.now(row, "changed", who, before, row.editable()))
        if "priority" in values:
            session.execute(
                update(Inspection)
                .where(Inspection.id.in_(ids), Inspection.status.not_in(ENDED))
                .values(priority=values["priority"])
                .execution_options(synchronize_session=False)
            )
        return len(films)

    return apply


def header_of(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return what project and asset of a film are called in the header of an inspection."""
    names = {"project": "project", "asset": "asset_id"}
    return {field: values[name] for name, field in names.items() if name in values}


def _merged(header: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    merged = {**header, **changes}
    return {name: value for name, value in merged.items() if value is not None}
