"""What a token that is limited to projects sees and changes of the database.

A request of such a token runs within `limited`. Whatever it reads is narrowed here, in SQL: the
rows of other projects are in no list, no number and no join. What it writes must belong to its
projects before and after. The server's own threads have no limit.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from sqlalchemy import ColumnElement, event, func, inspect, or_, select
from sqlalchemy.orm import ORMExecuteState, Session, with_loader_criteria

from app.errors import Forbidden
from app.storage.database.tables import Base, Inspection, RegisteredAsset

_LIMIT = "limit"
"""Key of a session's limit in its `info`."""
_ASSETS = Base.metadata.tables[RegisteredAsset.__tablename__]
_INSPECTIONS = Base.metadata.tables[Inspection.__tablename__]


@dataclass(frozen=True)
class Limit:
    """The projects of a token."""

    holder: str
    """Name of the token."""
    projects: frozenset[str]

    def require(self, project: str | None) -> None:
        """Raise Forbidden unless the token may see and change what belongs to this project."""
        if project not in self.projects:
            where = "no project" if project is None else f"the project {project!r}"
            raise Forbidden(
                f"The token {self.holder!r} is limited to {_listed(self.projects)}; this belongs "
                f"to {where}."
            )


_current: ContextVar[Limit | None] = ContextVar("limit", default=None)


def current() -> Limit | None:
    """Return the limit of the running request; None if it sees everything."""
    return _current.get()


@contextmanager
def limited(limit: Limit | None) -> Iterator[None]:
    """Limit what the block reads and writes; None: it sees everything."""
    before = _current.set(limit)
    try:
        yield
    finally:
        _current.reset(before)


def require_project(project: str | None) -> None:
    """Raise Forbidden if the running request may not see and change what belongs to a project."""
    if (limit := current()) is not None:
        limit.require(project)


def is_foreign(owner: str) -> bool:
    """Return whether the running request is limited and of another token than `owner`.

    What is not in the database, such as an upload, belongs to a token instead of a project.
    """
    limit = current()
    return limit is not None and limit.holder != owner


def info() -> dict[str, Any]:
    """Return the `info` of a session of the running request."""
    return {_LIMIT: current()}


@event.listens_for(Session, "do_orm_execute")
def _narrow(state: ORMExecuteState) -> None:
    limit: Limit | None = state.session.info.get(_LIMIT)
    if limit is None:
        return
    of_rows = state.is_insert or state.is_executemany
    if not state.is_orm_statement or (of_rows and _table_of(state).PROJECT is not None):
        raise Forbidden(f"A token that is limited to {_listed(limit.projects)} may not do this.")
    state.statement = state.statement.options(*_criteria(limit.projects))


def _table_of(state: ORMExecuteState) -> type[Base]:
    assert state.bind_mapper is not None  # noqa: S101  (it is a statement on a table)
    table: type[Base] = state.bind_mapper.class_
    return table


@lru_cache(maxsize=64)
def _criteria(projects: frozenset[str]) -> tuple[Any, ...]:
    """Return the options by which a statement sees the rows of some projects only."""
    # Not the index's copy of the project: an inspection that has left it is gone at once.
    own = select(_INSPECTIONS.c.id).where(_INSPECTIONS.c.project.in_(projects))
    found = []
    for mapper in Base.registry.mappers:
        table = mapper.class_
        condition: ColumnElement[bool]
        if table.ASSET is not None:
            condition = getattr(table, table.ASSET).in_(
                select(_ASSETS.c.asset_id).where(_ASSETS.c.project.in_(projects))
            )
        elif "inspection_id" in table.__table__.columns:
            condition = table.inspection_id.in_(own)
        elif table.PROJECT is not None:
            column = getattr(table, table.PROJECT)
            condition = column.in_(projects)
            if table.IS_SHARED_WITHOUT_PROJECT:
                condition = or_(condition, func.coalesce(column, "") == "")
        else:
            continue
        found.append(with_loader_criteria(table, condition, include_aliases=True))
    return tuple(found)


@event.listens_for(Session, "before_flush")
def _require_own(session: Session, *_: object) -> None:
    limit: Limit | None = session.info.get(_LIMIT)
    if limit is None:
        return
    for row in (*session.new, *session.dirty, *session.deleted):
        name = type(row).PROJECT
        if name is None:
            continue
        if row in session.new and _exists(session, row):  # unseen: it is of another project
            raise Forbidden(
                f"The token {limit.holder!r} is limited to {_listed(limit.projects)}; what has "
                "this name or id belongs to another project."
            )
        before = inspect(row).attrs[name].history.deleted or ()
        for project in (*before, getattr(row, name)):
            limit.require(project)


def _exists(session: Session, row: Base) -> bool:
    table = type(row).__table__
    same = (column == getattr(row, column.key) for column in table.primary_key)
    found = session.connection().execute(select(1).select_from(table).where(*same))
    return found.first() is not None


def _listed(projects: frozenset[str]) -> str:
    names = ", ".join(repr(name) for name in sorted(projects))
    return f"the project {names}" if len(projects) == 1 else f"the projects {names}"
