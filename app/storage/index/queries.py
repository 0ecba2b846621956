"""What the queries of the index have in common: counts, order, words, rows with an inspection."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Column, ColumnElement, Select, func, select
from sqlalchemy.orm import Session

from app.storage.database.tables import IndexedInspection, Inspection
from app.survey.assets.search_terms import Page, ProjectFilter
from app.survey.folding import words_of

WITH_INSPECTION = select(IndexedInspection, Inspection).join(
    Inspection, Inspection.id == IndexedInspection.inspection_id
)

HAS_RUN = Inspection.status.in_(("running", "done"))
"""Whether it was tracked, or is: what waits for that must not hide what is known."""
NEWEST_LAST = (HAS_RUN, IndexedInspection.surveyed_on)
"""Order of the inspections of an asset. All that are last are its newest survey, with one day; of
their grades the worst counts, and of their projects the last by name."""


@dataclass(frozen=True)
class FoundInspection:
    """An indexed inspection with its present row."""

    row: IndexedInspection
    inspection: Inspection


def counted(session: Session, query: Select[*tuple[Any, ...]]) -> int:
    """Return the number of rows of a query."""
    return session.scalar(select(func.count()).select_from(query.subquery())) or 0


def a_page(
    session: Session,
    query: Select[*tuple[Any, ...]],
    order: Sequence[ColumnElement[Any]],
    page: Page[Any],
) -> tuple[int, list[tuple[Any, ...]]]:
    """Return the number of rows of a query and a page of them, for which it is run only once."""
    numbered = query.add_columns(func.count().over()).order_by(*order)
    found = session.execute(numbered.offset(page.offset).limit(page.limit)).all()
    if not found:  # a page behind the last one does not have the number
        return (counted(session, query) if page.offset else 0), []
    return found[0][-1], [tuple(row[:-1]) for row in found]


def ordered(column: Column[Any], page: Page[Any]) -> ColumnElement[Any]:
    """Return a column in the order of the page, what is unknown last."""
    if column.nullable:
        return unknown_last(column, page)
    # Where nothing is unknown, the index of PostgreSQL serves for the order.
    return column.desc() if page.descending else column.asc()


def unknown_last(column: ColumnElement[Any], page: Page[Any]) -> ColumnElement[Any]:
    """Return a column in the order of the page, with NULL last in every database."""
    return (column.desc() if page.descending else column.asc()).nulls_last()


def with_words(column: Any, text: str) -> Iterator[ColumnElement[bool]]:
    """Yield the conditions of a folded column that all words of a text occur in it."""
    for word in words_of(text):
        yield column.contains(word, autoescape=True)


def of_project(column: Any, wanted: ProjectFilter) -> Iterator[ColumnElement[bool]]:
    """Yield the conditions of a column with the name of a project."""
    if wanted.is_none:
        yield column.is_(None)
    elif wanted.name is not None:
        yield column == wanted.name
