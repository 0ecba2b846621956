"""Work orders as a table (CSV), as offices write them: a row for each asset of each order."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import chain, islice
from typing import Literal

from app.errors import InvalidTable
from app.survey.assets.cells import KEY, SHOWN
from app.survey.assets.register import LONGEST_ID, one_line
from app.survey.assets.register_table import (
    MOST_COLUMNS,
    MOST_ROWS,
    cell_of,
    decoded,
    fault_of_id,
)
from app.survey.assets.work_orders import LONGEST_NUMBER, LONGEST_TEXT, Order
from app.survey.folding import folded
from vo_core.csv_rows import records

FIELDS = ("number", KEY, "reason", "due_on", "project", "note")
"""What a column may hold."""
_LONGEST = {"number": LONGEST_NUMBER, "project": LONGEST_ID}
_EXAMPLES = 3
_LOOKED_AT = 200
_NAMES: tuple[tuple[str, str], ...] = (
    ("due_on", r"\b(due\w*|deadline|until|fa?e?llig\w*|frist|termin|bis|tarikh\w*|date|datum)\b"),
    ("number", r"^(no|nr|number|nummer)$|\b(work ?order|order|auftrag\w*|job|arahan|pesanan)\b"),
    (KEY, r"\b(asset|pipe|sewer|section|culvert|haltung\w*|leitung\w*|kanal|aset|pembetung)\b"),
    ("reason", r"\b(reason|purpose|why|grund|anlass|zweck|sebab|tujuan)\b"),
    ("project", r"\b(project|projekt|projek|contract|scheme)\b"),
    ("note", r"\b(note\w*|remark\w*|comment\w*|bemerkung\w*|hinweis\w*|catatan)\b"),
)  # fmt: skip
"""Names of columns in English, German and Malay, folded: the first that fits."""
_DAYS = (
    re.compile(r"(?P<year>\d{4})-(?P<month>\d{1,2})-(?P<day>\d{1,2})(?:[T ].*)?"),
    re.compile(r"(?P<day>\d{1,2})[./](?P<month>\d{1,2})[./](?P<year>\d{4})"),
)
"""2026-12-31, and 31.12.2026 or 31/12/2026: the day before the month."""

Reason = Literal["number", "id", "cells", "long", "date", "twice", "asset", "project", "ended"]


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong in one place of a table."""

    row: int
    """Number of the line in the file."""
    column: str | None
    detail: str
    """A sentence without full stop: what was found and what to do."""
    reason: Reason


@dataclass(frozen=True, slots=True)
class Named:
    """A column of a table as its owner has it, and what it holds."""

    name: str
    examples: Sequence[str]
    field: str | None


@dataclass(frozen=True)
class Table:
    """A table as read."""

    columns: Sequence[Named]
    stated: Sequence[tuple[int, Order]]
    """Line and order of the rows without faults."""
    faults: Sequence[Fault]


def read_orders(content: bytes, columns: Sequence[str] = ()) -> Table:
    """Read a table in UTF-8, UTF-16 or Windows-1252, separated by commas, semicolons or tabs.

    Args:
        content: The file; its first row names the columns.
        columns: What they hold, of FIELDS or "" for nothing; by default it is guessed.
    Raises:
        InvalidTable: It is no such table, has other columns than stated, or lacks one.
    """
    found = records(decoded(content), InvalidTable, has_comments=False, most_rows=MOST_ROWS)
    _, head = next(found, (1, []))
    if not head or len(head) > MOST_COLUMNS:
        raise InvalidTable(f"The table has {len(head)} columns; it needs 2 to {MOST_COLUMNS}.")
    fields = list(columns) or _guessed(head)
    if len(fields) != len(head):
        raise InvalidTable(f"{len(fields)} columns are stated, the table has {len(head)}.")
    held = [field for field in fields if field]
    if wrong := next((f for f in held if f not in FIELDS or held.count(f) > 1), None):
        raise InvalidTable(f"Columns cannot hold {wrong[:SHOWN]!r}, or two of them hold it.")
    first = list(islice(found, _LOOKED_AT))
    stated: dict[tuple[str, str], tuple[int, Order]] = {}
    faults: list[Fault] = []
    for line, row in chain(first, found):
        cells = dict(zip(fields, map(cell_of, row), strict=False))
        own = list(_faults_of(line, cells, len(row) - len(head)))
        key = cells.get("number", ""), cells.get(KEY, "")
        if not own and key in stated:
            detail = f"order and asset are in line {stated[key][0]} already; keep one of the two"
            own.append(Fault(line, None, detail, "twice"))
        faults += own
        if not own:
            stated[key] = line, _order(cells)
    return Table(_named(head, first, fields), list(stated.values()), faults)


def _guessed(head: Sequence[str]) -> list[str]:
    fields: list[str] = []
    for name in head:
        plain = re.sub(r"[\W_]+", " ", folded(name)).strip()
        fits = (field for field, pattern in _NAMES if re.search(pattern, plain))
        field = next((field for field in fits if field not in fields), "")
        fields.append(plain.replace(" ", "_") if plain.replace(" ", "_") in FIELDS else field)
    return [field if field not in fields[:at] else "" for at, field in enumerate(fields)]


def _named(
    head: Sequence[str], first: Sequence[tuple[int, Sequence[str]]], fields: Sequence[str]
) -> list[Named]:
    columns = []
    for at, (name, field) in enumerate(zip(head, fields, strict=True)):
        cells = (cell_of(row[at])[:SHOWN] for _, row in first if at < len(row))
        examples = islice(dict.fromkeys(filter(None, cells)), _EXAMPLES)
        columns.append(Named(one_line(name)[:SHOWN], list(examples), field or None))
    return columns


def _faults_of(line: int, cells: Mapping[str, str], excess: int) -> Iterator[Fault]:
    if excess > 0:
        detail = "the row has more cells than the header; put text with the separator in quotes"
        yield Fault(line, None, detail, "cells")
    if not cells.get("number"):
        yield Fault(line, "number", "the number of the order is empty", "number")
    if fault := fault_of_id(cells.get(KEY, "")):
        yield Fault(line, KEY, fault, "id")
    for field, text in cells.items():
        if field and len(text) > (longest := _LONGEST.get(field, LONGEST_TEXT)):
            yield Fault(line, field, f"{field} is longer than {longest} characters", "long")
    if (due := cells.get("due_on", "")) and _day(due) is None:
        detail = f"a day must be like 2026-12-31 or 31.12.2026 (found {due[:SHOWN]!r})"
        yield Fault(line, "due_on", detail, "date")


def _day(text: str) -> date | None:
    for pattern in _DAYS:
        if found := pattern.fullmatch(text):
            try:
                return date(*(int(found[part]) for part in ("year", "month", "day")))
            except ValueError:
                return None
    return None


def _order(cells: Mapping[str, str]) -> Order:
    return Order(
        number=cells["number"],
        asset_id=cells[KEY],
        reason=cells.get("reason", ""),
        due_on=_day(cells.get("due_on", "")),
        note=cells.get("note", ""),
        project=cells.get("project") or None,
    )
