"""The register of assets as a table (CSV): reading what people and GIS programs write, and writing
it.

Columns may have any names and units: what they hold is guessed, unless a person states it. A column
that a table lacks leaves what the register holds, an empty cell removes it.
"""

from __future__ import annotations

import csv
import io
import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from typing import Literal

from app.errors import InvalidTable
from app.survey.assets.cells import (
    DIAMETER,
    ENDS,
    KEY,
    MEANINGS,
    PLACE,
    SHOWN,
    UNITS_MM,
    Column,
    decimal,
    own_unit,
    value_in,
)
from app.survey.assets.column_guess import guessed
from app.survey.assets.register import (
    LONGEST_ID,
    LONGEST_REGISTERED,
    Asset,
    InvalidLine,
    Line,
    line_of,
    one_line,
    registered,
    require_line,
    wkt_of,
)
from app.survey.fields.declaration import Value
from app.survey.fields.header import ASSET_FIELDS
from app.survey.fields.values import InvalidValue
from vo_core.csv_rows import plain, records, separator_of, unquoted

MEDIA_TYPE = "text/csv; charset=utf-8"
MOST_ROWS = 50_000
MOST_COLUMNS = 500

TEMPLATE = (KEY, "project", *ASSET_FIELDS, *PLACE)
"""Columns of the template."""
_WRITTEN = (KEY, "project", *ASSET_FIELDS, "wkt")
EXAMPLE: Mapping[str, Value] = {
    KEY: "EXAMPLE", "project": "Project 7", "start_node": "MH 12", "end_node": "MH 13",
    "client": "Roads Department", "asset_type": "culvert", "shape": "circular", "height_mm": 600,
    "material": "concrete", "unit_length_m": 2.4, "known_length_m": 24.5,
    "known_length_source": "drawing", "year": 1998, "road": "Jalan 4", "road_chainage": "12+300",
    "start_lat": 3.13901, "start_lon": 101.68692, "end_lat": 3.13912, "end_lon": 101.68701,
}  # fmt: skip
"""The row of the template; it is no asset."""
_CONTROL = re.compile("[\x00-\x08\x0e-\x1b\x7f-\x84\x86-\x9f]")
_EXAMPLES = 3
"""Cells of a column that a person is shown."""
_LOOKED_AT = 200
"""Rows by which the columns are guessed."""
_PIECE = 50_000
"""Least length of a piece of a table that is written, in characters."""

Action = Literal["add", "change", "same", "fault"]
Reason = Literal["id", "example", "twice", "cells", "value", "place"]


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong in one place of a table."""

    row: int
    """Number of the line in the file."""
    column: str | None
    """None for the row as a whole."""
    detail: str
    """A sentence without full stop: what was found and what to write."""
    reason: Reason
    """Its kind, for pages in other languages."""
    found: str = ""
    """What varies in it: the cell, the line that has the same asset, the number of cells."""


@dataclass(frozen=True, slots=True)
class Stated:
    """What a row without faults states."""

    row: int
    asset_id: str
    values: Mapping[str, Value]
    """By column, of project and header; None where the cell is empty."""
    line: Line | None
    """None where the table has no column of the place."""

    def applied_to(self, known: Asset | None) -> Asset:
        """Return the asset after the import; None if the register does not have it yet."""
        before = known or Asset(self.asset_id)
        after = {"project": before.project, **before.header, **self.values}
        project = after.pop("project")
        line = before.line if self.line is None else self.line
        return registered(self.asset_id, None if project is None else str(project), after, line)


@dataclass(frozen=True, slots=True)
class Named:
    """A column of a table as its owner has it, and what it holds."""

    name: str
    examples: Sequence[str]
    """Some of its cells that are not empty."""
    column: Column | None
    """None if it means nothing here."""


@dataclass(frozen=True)
class Table:
    """A table as read."""

    columns: Sequence[Named]
    rows: Sequence[tuple[int, str]]
    """Line and id of each row, with or without faults."""
    stated: Sequence[Stated]
    faults: Sequence[Fault]


@dataclass(frozen=True, slots=True)
class Step:
    """What the import of a row does."""

    row: int
    action: Action
    asset: Asset


def columns_of(texts: Sequence[str]) -> list[Column | None]:
    """Return the columns that a person states: a field, or field and unit as `height_mm:in`.

    Raises:
        InvalidTable: There is no such field or unit, or two columns hold the same.
    """
    found = []
    for text in texts:
        field, _, unit = text.partition(":")
        has_unit = own_unit(field) is not None
        if text and (field not in MEANINGS or (unit and not (has_unit and unit in UNITS_MM))):
            raise InvalidTable(f"A column cannot hold {text[:SHOWN]!r}.")
        found.append(Column.of(field, unit) if text else None)
    fields = [column.field for column in found if column is not None]
    twice = next((field for field in fields if fields.count(field) > 1), None)
    if twice is not None:
        raise InvalidTable(f"Two columns hold {twice}; choose one of them.")
    return found


def read_table(content: bytes, stated: Sequence[Column | None] | None = None) -> Table:
    """Read a table in UTF-8, UTF-16 or Windows-1252, separated by commas, semicolons or tabs.

    Numbers may have a decimal comma where commas separate no cells.

    Args:
        content: The file; its first row names the columns, below a title if it has one.
        stated: What its columns hold, in their order; by default it is guessed.
    Raises:
        InvalidTable: It is no such table, has other columns than stated, or is too long.
    """
    text = decoded(content)
    found = records(text, InvalidTable, has_comments=False, most_rows=MOST_ROWS)
    head_line, head = next(found, (1, []))
    if not head:
        raise InvalidTable("The file has no rows.")
    if len(head) > MOST_COLUMNS:
        raise InvalidTable(f"Line {head_line} has more than {MOST_COLUMNS} columns.")
    has_decimal_commas = separator_of(text, has_comments=False) != ","
    first = list(islice(found, _LOOKED_AT))
    widest = max((_filled(row) for _, row in first), default=0)
    while first and _filled(head) < 2 <= widest:  # a title above the table
        (_, head), *first = first
    cells = [[cell_of(cell) for cell in row] for _, row in first]
    columns = stated or guessed(head, cells, has_decimal_commas=has_decimal_commas)
    if len(columns) != len(head):
        raise InvalidTable(f"{len(columns)} columns are stated, the table has {len(head)}.")
    reader = _Reader(columns, has_decimal_commas=has_decimal_commas)
    for line, row in chain(first, found):
        reader.take(line, row)
    return Table(_named(head, cells, columns), reader.rows, reader.stated, reader.faults)


def _filled(row: Sequence[str]) -> int:
    return sum(bool(cell.strip()) for cell in row)


def _named(
    head: Sequence[str], cells: Sequence[Sequence[str]], columns: Sequence[Column | None]
) -> list[Named]:
    named = []
    for at, (name, column) in enumerate(zip(head, columns, strict=True)):
        filled = dict.fromkeys(row[at][:SHOWN] for row in cells if at < len(row) and row[at])
        named.append(Named(one_line(name)[:SHOWN], list(islice(filled, _EXAMPLES)), column))
    return named


class _Reader:
    """Collects rows and their faults."""

    def __init__(self, columns: Sequence[Column | None], *, has_decimal_commas: bool) -> None:
        self.rows: list[tuple[int, str]] = []
        self.stated: list[Stated] = []
        self.faults: list[Fault] = []
        self._names = ["" if column is None else column.field for column in columns]
        self._columns = [column for column in columns if column is not None]
        self._has_decimal_commas = has_decimal_commas
        self._line_of: dict[str, int] = {}

    def take(self, line: int, row: Sequence[str]) -> None:
        """Read one row."""
        cells = dict(zip(self._names, map(cell_of, row), strict=False))
        asset_id = cells.get(KEY, "") if KEY in self._names else _between_nodes(cells)
        self.rows.append((line, asset_id[:LONGEST_ID]))
        faults = list(self._faults_of_row(line, asset_id, len(row)))
        values: dict[str, Value] = {}
        for column in self._columns:
            if column.field == KEY or column.field in PLACE:
                continue
            try:
                values[column.field] = self._value(column, cells.get(column.field, ""))
            except InvalidValue as error:
                found = cells.get(column.field, "")[:SHOWN]
                faults.append(Fault(line, column.field, str(error), "value", found))
        place: Line | None = None
        if any(name in PLACE for name in self._names):
            try:
                place = self._line(cells)
            except (InvalidLine, InvalidValue) as error:
                column_name = "wkt" if cells.get("wkt") else "start_lat"
                faults.append(Fault(line, column_name, str(error), "place"))
        if faults:
            self.faults += faults
        else:
            self.stated.append(Stated(line, asset_id, _with_diameter(values), place))

    def _faults_of_row(self, line: int, asset_id: str, cells: int) -> Iterator[Fault]:
        if cells > len(self._names):
            yield Fault(
                line,
                None,
                f"the row has {cells} cells, the header {len(self._names)}; put text that "
                "contains the separator in quotation marks",
                "cells",
                str(cells),
            )
        if fault := fault_of_id(asset_id):
            yield Fault(line, KEY, fault, "example" if asset_id == EXAMPLE[KEY] else "id")
        elif (other := self._line_of.setdefault(asset_id, line)) != line:
            detail = f"{asset_id!r} is in line {other} already; keep one of the two"
            yield Fault(line, KEY, detail, "twice", str(other))

    def _value(self, column: Column, text: str) -> Value:
        longest = LONGEST_ID if column.field == "project" else LONGEST_REGISTERED
        if len(text) > longest:
            raise InvalidValue(f"{column.field} is longer than {longest} characters")
        if column.field == "project":
            return text or None
        return value_in(column, text, has_decimal_commas=self._has_decimal_commas)

    def _line(self, cells: Mapping[str, str]) -> Line:
        ends = [cells.get(name, "") for name in ENDS]
        wkt = cells.get("wkt", "")
        if wkt:
            if any(ends):
                raise InvalidLine("the place is stated twice; fill wkt or start_lat to end_lon")
            return line_of(wkt)
        if not any(ends):
            return ()
        for lat, lon in (ends[:2], ends[2:]):
            if bool(lat) != bool(lon):
                raise InvalidLine("latitude and longitude belong together; fill both or neither")
        if not ends[0]:
            raise InvalidLine("start_lat and start_lon are needed where the end is stated")
        degrees = [self._degrees(name, text) for name, text in zip(ENDS, ends, strict=True)]
        line = tuple(
            (lon, lat)
            for lat, lon in (degrees[:2], degrees[2:])
            if lat is not None and lon is not None
        )
        require_line(line)
        return line

    def _degrees(self, name: str, text: str) -> float | None:
        if not text:
            return None
        number = decimal(name, text, has_decimal_commas=self._has_decimal_commas)
        try:
            return float(number)
        except ValueError as error:
            raise InvalidLine(
                f"{name} must be degrees, such as 3.1412 (found {text[:SHOWN]!r})"
            ) from error


def _between_nodes(cells: Mapping[str, str]) -> str:
    """Return the id of a section that its table names only by its two nodes."""
    return "-".join(filter(None, (cells.get("start_node"), cells.get("end_node"))))


def _with_diameter(values: dict[str, Value]) -> dict[str, Value]:
    """Return the values with a diameter as the height of a circular pipe, unless they say more."""
    if DIAMETER not in values:
        return values
    diameter = values.pop(DIAMETER)
    if diameter is None:
        return {"height_mm": None} | values
    if values.get("height_mm") is None:
        values["height_mm"] = diameter
    if values.get("shape") is None:
        values["shape"] = "circular"
    return values


def fault_of_id(asset_id: str) -> str | None:
    """Say what is wrong with an id as `one_line` returns it; None if nothing is."""
    if not asset_id:
        return "asset_id is empty; each row needs the id of its asset"
    if len(asset_id) > LONGEST_ID:
        return f"asset_id is longer than {LONGEST_ID} characters"
    if asset_id == EXAMPLE[KEY]:
        return "this row is the example of the template; delete it"
    if not any(letter.isalnum() for letter in asset_id):
        return f"asset_id needs a letter or a digit (found {asset_id!r})"
    return None


def steps(stated: Iterable[Stated], known: Mapping[str, Asset]) -> list[Step]:
    """Return what the import of each row does to the known assets, by id."""
    found = []
    for row in stated:
        before = known.get(row.asset_id)
        after = row.applied_to(before)
        action: Action = "add" if before is None else "same" if after == before else "change"
        found.append(Step(row.row, action, after))
    return found


def written(assets: Iterable[Asset]) -> Iterator[str]:
    """Yield a table in pieces, to be read by `read_table` and spreadsheets: UTF-8 with BOM."""
    return _table(_WRITTEN, map(_cells, assets))


def template() -> str:
    """Return a table of all columns with a row as an example."""
    return "".join(_table(TEMPLATE, [[EXAMPLE.get(name) for name in TEMPLATE]]))


def _cells(asset: Asset) -> list[Value]:
    fields = (asset.header.get(name) for name in ASSET_FIELDS)
    return [asset.asset_id, asset.project, *fields, wkt_of(asset.line)]


def _table(columns: Sequence[str], rows: Iterable[Sequence[Value]]) -> Iterator[str]:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    out.write("\N{BYTE ORDER MARK}")
    writer.writerow(columns)
    for row in rows:
        writer.writerow([plain(cell) if isinstance(cell, str) else cell for cell in row])
        if out.tell() > _PIECE:
            yield out.getvalue()
            out.seek(0)
            out.truncate()
    yield out.getvalue()


def cell_of(text: str) -> str:
    """Return the text of a cell, in one line and without what guards against formulas."""
    return one_line(unquoted(text.strip()))


def decoded(content: bytes) -> str:
    """Decode UTF-8 and UTF-16, or else Windows-1252, in which spreadsheets of Windows save."""
    try:
        is_wide = content.startswith((BOM_UTF16_LE, BOM_UTF16_BE))
        text = content.decode("utf-16" if is_wide else "utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", "replace")
    if control := _CONTROL.search(text):
        line = text.count("\n", 0, control.start()) + 1
        raise InvalidTable(
            f"Line {line} has a character that no text in UTF-8 or Windows-1252 has; save the "
            "table as CSV."
        )
    return text
