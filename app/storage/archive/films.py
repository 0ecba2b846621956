"""The films of the archive for those who look: lists, sums, failures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import case, func, select
from sqlalchemy.orm import Session, defer

from app.storage.archive.selection import (
    ROW,
    STATE,
    FilmRow,
    FilmState,
    Selection,
    digest_of,
    ids_of,
    matching,
    of_films,
    portions,
)
from app.storage.database.store import Store, reading
from app.storage.database.tables import ArchiveFilm, Inspection


@dataclass(frozen=True)
class Tally:
    """Films of one state."""

    films: int
    size: int
    frames_done: int
    frames_total: int


@dataclass(frozen=True)
class Ended:
    """A film whose tracking has ended."""

    finished_at: datetime
    size: int
    frames: int


@dataclass(frozen=True)
class Failure:
    """A film that failed or was refused."""

    id: str
    name: str
    path: str
    code: str
    detail: str


_LISTED = (
    defer(ArchiveFilm.rig, raiseload=True),
    defer(ArchiveFilm.header, raiseload=True),
    defer(Inspection.rig, raiseload=True),
    defer(Inspection.header, raiseload=True),
    defer(Inspection.corrections, raiseload=True),
)
_DISTANCE_MM = func.coalesce(Inspection.corrected_mm, Inspection.distance_mm)
_FRAMES_TOTAL = Inspection.video["frames"].as_integer()
SORTABLE: Mapping[str, Any] = {
    "name": func.lower(ArchiveFilm.name),
    "path": ArchiveFilm.path,
    "project": func.lower(ArchiveFilm.project),
    "asset": func.lower(ArchiveFilm.asset),
    "rule": ArchiveFilm.rule,
    "rig_name": ArchiveFilm.rig_name,
    "state": STATE,
    "priority": ArchiveFilm.priority,
    "size": ArchiveFilm.size,
    "frames_done": Inspection.frames_done,
    "fps": Inspection.fps,
    "distance_m": _DISTANCE_MM,
    "added_at": ArchiveFilm.added_at,
    "finished_at": Inspection.finished_at,
}
"""What a list of films may be sorted by."""


class ArchiveFilms(Store):
    """Returns detached rows: changing them does not change the database."""

    @reading
    def listed(
        self,
        session: Session,
        selection: Selection,
        sort: str | None,
        *,
        descending: bool,
        offset: int,
        limit: int,
    ) -> tuple[int, list[FilmRow]]:
        """Return the number of selected films, and one page of them."""
        column = SORTABLE[sort or "path"]
        order = column.desc().nulls_last() if descending else column.asc().nulls_last()
        conditions = matching(selection)
        page = (
            ROW.options(*_LISTED)
            .where(*conditions)
            .order_by(order, ArchiveFilm.path)
            .offset(offset)
            .limit(limit)
        )
        count = of_films(func.count(ArchiveFilm.id)).where(*conditions)
        total = session.scalar(count) or 0
        return total, [FilmRow(*found) for found in session.execute(page)]

    @reading
    def ids(self, session: Session, selection: Selection, *states: FilmState) -> tuple[str, ...]:
        """Return the ids of the selected films that are in one of the states, of all if none is
        given.
        """
        return tuple(session.scalars(ids_of(selection, *states)))

    @reading
    def running(self, session: Session, selection: Selection) -> dict[str, int]:
        """Return the stored number of frames done of each selected film that is running."""
        query = of_films(ArchiveFilm.id, Inspection.frames_done).where(
            *matching(selection), STATE == "running"
        )
        return {film: frames for film, frames in session.execute(query)}  # noqa: C416

    @reading
    def tallies(self, session: Session, selection: Selection) -> dict[FilmState, Tally]:
        """Return sums over the selected films of each state."""
        query = (
            of_films(
                STATE.label("shown"),
                func.count(),
                func.sum(ArchiveFilm.size),
                func.sum(Inspection.frames_done),
                func.sum(_FRAMES_TOTAL),
            )
            .where(*matching(selection))
            .group_by("shown")
        )
        return {
            state: Tally(films, int(size or 0), int(done or 0), int(total or 0))
            for state, films, size, done, total in session.execute(query)
        }

    @reading
    def last_ended(self, session: Session, selection: Selection, limit: int) -> list[Ended]:
        """Return the films whose tracking ended last, the newest first."""
        query = (
            of_films(Inspection.finished_at, ArchiveFilm.size, Inspection.frames_done)
            .where(
                *matching(selection),
                Inspection.status.in_(("done", "failed")),
            )
            .order_by(Inspection.finished_at.desc())
            .limit(limit)
        )
        return [
            Ended(at, size, frames) for at, size, frames in session.execute(query) if at is not None
        ]

    @reading
    def failures(self, session: Session, selection: Selection) -> list[Failure]:
        """Return the selected films that failed or were refused, in the order of their paths."""
        is_refused = STATE == "refused"
        query = (
            of_films(
                ArchiveFilm.id,
                ArchiveFilm.name,
                ArchiveFilm.path,
                case((is_refused, ArchiveFilm.error_code), else_=Inspection.error_code),
                case((is_refused, ArchiveFilm.error_detail), else_=Inspection.error_detail),
            )
            .where(*matching(selection), STATE.in_(("failed", "refused")))
            .order_by(ArchiveFilm.path)
        )
        return [
            Failure(film, name, path, code or "tracking_failed", detail or "")
            for film, name, path, code, detail in session.execute(query)
        ]

    @reading
    def known(self, session: Session, paths: Iterable[str]) -> set[str]:
        """Return those of the paths that a film of the archive has."""
        found = set[str]()
        for some in portions(list(paths)):
            digests = {digest_of(path): path for path in some}
            query = select(ArchiveFilm.path_sha256).where(
                ArchiveFilm.path_sha256.in_(digests.keys())
            )
            found |= {digests[digest] for digest in session.scalars(query)}
        return found
