"""The archive in the database: its films, what has become of them, and its rules."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal, TypeVar, cast

from sqlalchemy import (
    ColumnElement,
    CursorResult,
    Select,
    and_,
    case,
    delete,
    func,
    literal,
    or_,
    select,
    update,
)
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session, defer, outerjoin

from app.errors import ClaimLost, NoLongerWanted
from app.storage.database import Database
from app.storage.inspections import existing
from app.storage.tables import ENDED, ArchiveFilm, ArchiveRules, EventRow, Inspection
from app.survey.versions import Require

FilmState = Literal[
    "unassigned", "ready", "waiting", "paused", "refused",
    "queued", "running", "done", "failed", "cancelled",
]  # fmt: skip
"""State of a film as people see it."""
StoredState = Literal["idle", "waiting", "paused", "refused"]
"""What the archive stores: an idle film is not wanted, or its inspection has the state. A film may
wait for a rig as well as for its turn."""
ACTIVE: tuple[FilmState, ...] = ("queued", "running")
_UNDER_WAY = (*ACTIVE, "done")
_AT_ONCE = 1000
"""Films that one transaction changes row by row."""
Item = TypeVar("Item")


@dataclass(frozen=True)
class Selection:
    """Which films are meant; all of them unless something is given."""

    ids: tuple[str, ...] | None = None
    search: str | None = None
    """Part of name, path, project or asset, in any case."""
    states: tuple[FilmState, ...] = ()
    project: str | None = None
    asset: str | None = None


@dataclass(frozen=True)
class FilmRow:
    """A film with its inspection, if there is one; detached from the database.

    In a list, rigs and headers are left out.
    """

    film: ArchiveFilm
    state: FilmState
    has_rig: bool
    inspection: Inspection | None


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


_IS_NEW = Inspection.id.is_(None)
_STATE = case(
    (and_(_IS_NEW, ArchiveFilm.rig.is_(None)), "unassigned"),
    (and_(_IS_NEW, ArchiveFilm.state == "idle"), "ready"),
    (_IS_NEW, ArchiveFilm.state),
    (Inspection.status.in_(_UNDER_WAY), Inspection.status),
    (ArchiveFilm.state.in_(("waiting", "paused")), ArchiveFilm.state),  # to be tracked again
    else_=Inspection.status,
)
_JOINED = outerjoin(ArchiveFilm, Inspection, Inspection.id == ArchiveFilm.id)
_ROW = select(ArchiveFilm, _STATE, ArchiveFilm.rig.is_not(None), Inspection).select_from(_JOINED)
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
    "state": _STATE,
    "priority": ArchiveFilm.priority,
    "size": ArchiveFilm.size,
    "frames_done": Inspection.frames_done,
    "fps": Inspection.fps,
    "distance_m": _DISTANCE_MM,
    "added_at": ArchiveFilm.added_at,
    "finished_at": Inspection.finished_at,
}
"""What a list of films may be sorted by."""


class ArchiveStore:
    """Returns detached rows: changing them does not change the database."""

    def __init__(self, database: Database) -> None:
        self._database = database

    # What is there

    def listed(
        self, selection: Selection, sort: str | None, *, descending: bool, offset: int, limit: int
    ) -> tuple[int, list[FilmRow]]:
        """Return the number of selected films, and one page of them."""
        column = SORTABLE[sort or "path"]
        order = column.desc().nulls_last() if descending else column.asc().nulls_last()
        matching = _matching(selection)
        page = (
            _ROW.options(*_LISTED)
            .where(*matching)
            .order_by(order, ArchiveFilm.path)
            .offset(offset)
            .limit(limit)
        )
        count = select(func.count()).select_from(_JOINED).where(*matching)
        with self._database.read() as session:
            total = session.scalar(count) or 0
            return total, [FilmRow(*found) for found in session.execute(page)]

    def ids(self, selection: Selection, *states: FilmState) -> tuple[str, ...]:
        """Return the ids of the selected films that are in one of the states, of all if none is
        given.
        """
        with self._database.read() as session:
            return tuple(session.scalars(_ids(selection, *states)))

    def running(self, selection: Selection) -> dict[str, int]:
        """Return the stored number of frames done of each selected film that is running."""
        query = (
            select(ArchiveFilm.id, Inspection.frames_done)
            .select_from(_JOINED)
            .where(*_matching(selection), _STATE == "running")
        )
        with self._database.read() as session:
            return {film: frames for film, frames in session.execute(query)}  # noqa: C416

    def tallies(self, selection: Selection) -> dict[FilmState, Tally]:
        """Return sums over the selected films of each state."""
        query = (
            select(
                _STATE.label("shown"),
                func.count(),
                func.sum(ArchiveFilm.size),
                func.sum(Inspection.frames_done),
                func.sum(_FRAMES_TOTAL),
            )
            .select_from(_JOINED)
            .where(*_matching(selection))
            .group_by("shown")
        )
        with self._database.read() as session:
            return {
                state: Tally(films, int(size or 0), int(done or 0), int(total or 0))
                for state, films, size, done, total in session.execute(query)
            }

    def last_ended(self, selection: Selection, limit: int) -> list[Ended]:
        """Return the films whose tracking ended last, the newest first."""
        query = (
            select(Inspection.finished_at, ArchiveFilm.size, Inspection.frames_done)
            .select_from(_JOINED)
            .where(
                *_matching(selection),
                Inspection.status.in_(("done", "failed")),
            )
            .order_by(Inspection.finished_at.desc())
            .limit(limit)
        )
        with self._database.read() as session:
            return [
                Ended(at, size, frames)
                for at, size, frames in session.execute(query)
                if at is not None
            ]

    def failures(self, selection: Selection) -> list[Failure]:
        """Return the selected films that failed or were refused, in the order of their paths."""
        is_refused = _STATE == "refused"
        query = (
            select(
                ArchiveFilm.id,
                ArchiveFilm.name,
                ArchiveFilm.path,
                case((is_refused, ArchiveFilm.error_code), else_=Inspection.error_code),
                case((is_refused, ArchiveFilm.error_detail), else_=Inspection.error_detail),
            )
            .select_from(_JOINED)
            .where(*_matching(selection), _STATE.in_(("failed", "refused")))
            .order_by(ArchiveFilm.path)
        )
        with self._database.read() as session:
            return [
                Failure(film, name, path, code or "tracking_failed", detail or "")
                for film, name, path, code, detail in session.execute(query)
            ]

    def known(self, paths: Iterable[str]) -> set[str]:
        """Return those of the paths that a film of the archive has."""
        found = set[str]()
        with self._database.read() as session:
            for some in _portions(list(paths)):
                digests = {digest_of(path): path for path in some}
                query = select(ArchiveFilm.path_sha256).where(
                    ArchiveFilm.path_sha256.in_(digests.keys())
                )
                found |= {digests[digest] for digest in session.scalars(query)}
        return found

    # Changes by people

    def add(self, films: Sequence[Mapping[str, Any]]) -> set[str]:
        """Add films, given by their columns; return the ids of those whose path was not known.

        They are idle unless state and wish are given.
        """
        added = set[str]()
        for some in _portions(films):
            added |= self._database.write(_adding(some))
        return added

    def assign(self, given: Callable[[str, str], Mapping[str, Any] | None]) -> int:
        """Give unassigned films what `given` returns for their path and relative path: columns, or
        None to leave a film; return the number of those that were given something.
        """
        assigned = 0
        for some in _portions(self.ids(Selection(), "unassigned")):
            assigned += self._database.write(_assigning(some, given))
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
            .where(ArchiveFilm.id.in_(_ids(selection, *before)))
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
        """
        changed = 0
        for some in _portions(ids):
            changed += self._database.write(_changing(some, who, values, header))
        return changed

    def delete(self, selection: Selection) -> int:
        """Take films off the list; return their number. Their inspections stay."""
        return self._changed(
            delete(ArchiveFilm)
            .where(ArchiveFilm.id.in_(_ids(selection)))
            .execution_options(synchronize_session=False)
        )

    def _changed(self, statement: Any) -> int:
        def apply(session: Session) -> int:
            return cast("CursorResult[Any]", session.execute(statement)).rowcount

        return self._database.write(apply)

    # The intake

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
        self._changed(
            update(ArchiveFilm)
            .where(ArchiveFilm.id == film_id, ArchiveFilm.claimed_by == server)
            .values(claimed_by=None, claimed_until=None)
            .execution_options(synchronize_session=False)
        )

    # The rules

    def rules(self) -> dict[str, Any] | None:
        """Return the stored rules; None if there never were any."""
        with self._database.read() as session:
            row = session.get(ArchiveRules, 1)
            return None if row is None else row.content

    def put_rules(self, content: dict[str, Any], who: str, require: Require) -> None:
        """Replace the rules.

        Raises:
            Exception: Whatever `require` raises for the stored content, None if there is none.
        """

        def apply(session: Session) -> None:
            row = session.get(ArchiveRules, 1)
            require(None if row is None else row.content)
            session.merge(
                ArchiveRules(id=1, content=content, changed_at=datetime.now(UTC), changed_by=who)
            )

        self._database.write(apply)


def _portions(items: Sequence[Item]) -> Iterator[Sequence[Item]]:
    return (items[at : at + _AT_ONCE] for at in range(0, len(items), _AT_ONCE))


def digest_of(path: str) -> str:
    """Return the SHA-256 of the text of a path, hexadecimal."""
    return hashlib.sha256(path.encode()).hexdigest()


def _matching(selection: Selection) -> list[ColumnElement[bool]]:
    conditions: list[ColumnElement[bool]] = []
    if selection.ids is not None:
        conditions.append(ArchiveFilm.id.in_(selection.ids))
    if selection.states:
        conditions.append(_STATE.in_(selection.states))
    if selection.project is not None:
        conditions.append(ArchiveFilm.project == selection.project)
    if selection.asset is not None:
        conditions.append(ArchiveFilm.asset == selection.asset)
    if selection.search:
        columns = (ArchiveFilm.name, ArchiveFilm.path, ArchiveFilm.project, ArchiveFilm.asset)
        found = (column.icontains(selection.search, autoescape=True) for column in columns)
        conditions.append(or_(*found))
    return conditions


def _ids(selection: Selection, *states: FilmState) -> Select[str]:
    query = select(ArchiveFilm.id).select_from(_JOINED).where(*_matching(selection))
    return query.where(_STATE.in_(states)) if states else query


def _next_waiting(server: str) -> Select[Any]:
    is_free = or_(
        ArchiveFilm.claimed_until.is_(None),
        ArchiveFilm.claimed_until < datetime.now(UTC),
        # The claim of an earlier process on this data folder, which nobody else can be using.
        ArchiveFilm.claimed_by == server,
    )
    return (
        _ROW.where(ArchiveFilm.state == "waiting", ArchiveFilm.rig.is_not(None), is_free)
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
