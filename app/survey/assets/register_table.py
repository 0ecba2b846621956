"""The register of assets as a table (CSV): reading what people and GIS programs write, and writing
it.

A column that a table lacks leaves what the register holds, an empty cell removes it.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from app.errors import InvalidTable
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
from app.survey.fields.header import ASSET_FIELDS, FIELDS
from app.survey.fields.values import InvalidValue, value_of
from vo_core.csv_rows import plain, records, separator_of, unquoted

MEDIA_TYPE = "text/csv; charset=utf-8"
MOST_ROWS = 50_000
MOST_COLUMNS = 500

_KEY = "asset_id"
_ENDS = ("start_lat", "start_lon", "end_lat", "end_lon")
_PLACE = (*_ENDS, "wkt")
TEMPLATE = (_KEY, "project", *ASSET_FIELDS, *_PLACE)
"""Columns that a table may have."""
_WRITTEN = (_KEY, "project", *ASSET_FIELDS, "wkt")
_NUMBERS = {field.name for field in FIELDS if field.kind == "number"}
_CONTROL = re.compile("[\x00-\x08\x0e-\x1b\x7f-\x84\x86-\x9f]")
_SHOWN = 60
"""Characters that a message shows of what it found."""
_PIECE = 50_000
"""Least length of a piece of a table that is written, in characters."""

Action = Literal["add", "change", "same", "fault"]


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong in one place of a table."""

    row: int
    """Number of the line in the file."""
    column: str | None
    """None for the row as a whole."""
    detail: str
    """A sentence without full stop: what was found and what to write."""


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


@dataclass(frozen=True)
class Table:
    """A table as read."""

    ignored: Sequence[str]
    """Columns that mean nothing here."""
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


def read_table(content: bytes) -> Table:
    """Read a table in UTF-8 or Windows-1252, separated by commas, semicolons or tabs.

    Numbers may have a decimal comma where commas separate no cells.

    Raises:
        InvalidTable: It is no such table, has no column asset_id, or is too long.
    """
    text = _decoded(content)
    found = records(text, InvalidTable, has_comments=False, most_rows=MOST_ROWS)
    head_line, head = next(found, (1, []))
    columns = [re.sub(r"[\s-]+", "_", name.strip().lower()) for name in head]
    _require_columns(columns, head_line)
    separator = separator_of(text, has_comments=False)
    reader = _Reader(columns, has_decimal_commas=separator != ",")
    for line, cells in found:
        reader.take(line, cells)
    ignored = [name[:_SHOWN] for name in columns if name not in TEMPLATE and name]
    return Table(ignored, reader.rows, reader.stated, reader.faults)


class _Reader:
    """Collects rows and their faults."""

    def __init__(self, columns: Sequence[str], *, has_decimal_commas: bool) -> None:
        self.rows: list[tuple[int, str]] = []
        self.stated: list[Stated] = []
        self.faults: list[Fault] = []
        self._columns = columns
        self._fields = [name for name in columns if name in ASSET_FIELDS]
        self._has_place = any(name in _PLACE for name in columns)
        self._has_decimal_commas = has_decimal_commas
        self._line_of: dict[str, int] = {}

    def take(self, line: int, row: Sequence[str]) -> None:
        """Read one row."""
        cells = dict(zip(self._columns, map(_cell, row), strict=False))
        asset_id = cells.get(_KEY, "")
        self.rows.append((line, asset_id[:LONGEST_ID]))
        faults = list(self._faults_of_row(line, asset_id, len(row)))
        values: dict[str, Value] = {}
        if "project" in self._columns:
            project = cells.get("project", "")
            values["project"] = project or None
            if len(project) > LONGEST_ID:
                faults.append(
                    Fault(line, "project", f"project is longer than {LONGEST_ID} characters")
                )
        for name in self._fields:
            try:
                values[name] = self._value(name, cells.get(name, ""))
            except InvalidValue as error:
                faults.append(Fault(line, name, str(error)))
        place: Line | None = None
        if self._has_place:
            try:
                place = self._line(cells)
            except (InvalidLine, InvalidValue) as error:
                faults.append(Fault(line, "wkt" if cells.get("wkt") else "start_lat", str(error)))
        if faults:
            self.faults += faults
        else:
            self.stated.append(Stated(line, asset_id, values, place))

    def _faults_of_row(self, line: int, asset_id: str, cells: int) -> Iterator[Fault]:
        if cells > len(self._columns):
            yield Fault(
                line,
                None,
                f"the row has {cells} cells, the header {len(self._columns)}; put text that "
                "contains the separator in quotation marks",
            )
        if fault := fault_of_id(asset_id):
            yield Fault(line, _KEY, fault)
        elif (other := self._line_of.setdefault(asset_id, line)) != line:
            yield Fault(line, _KEY, f"{asset_id!r} is in line {other} already; keep one of the two")

    def _value(self, name: str, text: str) -> Value:
        if not text:
            return None
        if len(text) > LONGEST_REGISTERED:
            raise InvalidValue(f"{name} is longer than {LONGEST_REGISTERED} characters")
        if name in _NUMBERS:
            self._require_point(name, text)
        return value_of(name, text)

    def _line(self, cells: Mapping[str, str]) -> Line:
        ends = [cells.get(name, "") for name in _ENDS]
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
        degrees = [self._degrees(name, text) for name, text in zip(_ENDS, ends, strict=True)]
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
        self._require_point(name, text)
        try:
            return float(text.replace(",", "."))
        except ValueError as error:
            raise InvalidLine(
                f"{name} must be degrees, such as 3.1412 (found {text[:_SHOWN]!r})"
            ) from error

    def _require_point(self, name: str, text: str) -> None:
        if "," in text and not self._has_decimal_commas:
            raise InvalidValue(
                f"{name} has a comma ({text[:_SHOWN]!r}); write a decimal point and no separator "
                "of thousands, or separate the columns by semicolons"
            )


def fault_of_id(asset_id: str) -> str | None:
    """Say what is wrong with an id as `one_line` returns it; None if nothing is."""
    if not asset_id:
        return "asset_id is empty; each row needs the id of its asset"
    if len(asset_id) > LONGEST_ID:
        return f"asset_id is longer than {LONGEST_ID} characters"
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
    """Return a table of all columns without rows."""
    return "".join(_table(TEMPLATE, ()))


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


def _cell(text: str) -> str:
    return one_line(unquoted(text.strip()))


def _decoded(content: bytes) -> str:
    """Decode UTF-8, or else Windows-1252, in which spreadsheets of Windows save."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", "replace")
    if control := _CONTROL.search(text):
        line = text.count("\n", 0, control.start()) + 1
        raise InvalidTable(
            f"Line {line} has a character that no text in UTF-8 or Windows-1252 has; save the "
            "table as CSV."
        )
    return text


def _require_columns(columns: Sequence[str], line: int) -> None:
    if len(columns) > MOST_COLUMNS:
        raise InvalidTable(f"Line {line} has more than {MOST_COLUMNS} columns.")
    if _KEY not in columns:
        raise InvalidTable(
            f"Line {line} has no column {_KEY}; the first row must name the columns, of which "
            f"{_KEY} is needed."
        )
    twice = next((name for name in columns if name and columns.count(name) > 1), None)
    if twice is not None:
        raise InvalidTable(f"Line {line} has the column {twice} twice; remove one of them.")
