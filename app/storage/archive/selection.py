"""Which films of the archive are meant, and the state of each: what all its queries share.

The state of a film is derived: once there is an inspection of it, it is that of the inspection.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from sqlalchemy import ColumnElement, Select, and_, case, or_, select

from app.storage.database.tables import ArchiveFilm, Inspection, outdated

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
"""Films that one query or transaction takes row by row."""
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
    outdated: bool = False
    """Only films that an older program tracked."""


@dataclass(frozen=True)
class FilmRow:
    """A film with its inspection, if there is one; detached from the database.

    In a list, rigs and headers are left out.
    """

    film: ArchiveFilm
    state: FilmState
    has_rig: bool
    inspection: Inspection | None


def of_films(*columns: Any) -> Select[*tuple[Any, ...]]:
    """Select from all films, each with its inspection if there is one."""
    # Not `orm.outerjoin`: what limits the inspections of a token would limit the films too.
    is_same = Inspection.id == ArchiveFilm.id
    return select(*columns).select_from(ArchiveFilm).outerjoin(Inspection, is_same)


_IS_NEW = Inspection.id.is_(None)
STATE = case(
    (and_(_IS_NEW, ArchiveFilm.rig.is_(None)), "unassigned"),
    (and_(_IS_NEW, ArchiveFilm.state == "idle"), "ready"),
    (_IS_NEW, ArchiveFilm.state),
    (Inspection.status.in_(_UNDER_WAY), Inspection.status),
    (ArchiveFilm.state != "idle", ArchiveFilm.state),  # to be tracked again
    else_=Inspection.status,
)
"""The `FilmState` of a film of `of_films`."""
ROW = of_films(ArchiveFilm, STATE, ArchiveFilm.rig.is_not(None), Inspection)
"""Columns of a `FilmRow`."""


def matching(selection: Selection) -> list[ColumnElement[bool]]:
    """Return the conditions of a selection, on a film of `of_films`."""
    conditions: list[ColumnElement[bool]] = []
    if selection.ids is not None:
        conditions.append(ArchiveFilm.id.in_(selection.ids))
    if selection.states:
        conditions.append(STATE.in_(selection.states))
    if selection.project is not None:
        conditions.append(ArchiveFilm.project == selection.project)
    if selection.asset is not None:
        conditions.append(ArchiveFilm.asset == selection.asset)
    if selection.outdated:
        conditions.append(outdated())
    if selection.search:
        columns = (ArchiveFilm.name, ArchiveFilm.path, ArchiveFilm.project, ArchiveFilm.asset)
        found = (column.icontains(selection.search, autoescape=True) for column in columns)
        conditions.append(or_(*found))
    return conditions


def ids_of(selection: Selection, *states: FilmState) -> Select[str]:
    """Select the ids of the selected films that are in one of the states; in any if none is
    given.
    """
    query = of_films(ArchiveFilm.id).where(*matching(selection))
    return query.where(STATE.in_(states)) if states else query


def digest_of(path: str) -> str:
    """Return the SHA-256 of the text of a path, hexadecimal."""
    return hashlib.sha256(path.encode()).hexdigest()


def portions(items: Sequence[Item]) -> Iterator[Sequence[Item]]:
    """Yield films, or something of each, as many at a time as one transaction takes."""
    return (items[at : at + _AT_ONCE] for at in range(0, len(items), _AT_ONCE))
