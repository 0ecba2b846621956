"""Tables (CSV) that state name, project, asset, rig and header of films."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import PurePosixPath

from app.archive.paths import line_of
from app.archive.rules import MOST_PRIORITY, Stated
from app.errors import InvalidTable
from app.survey.fields.header import FIELDS, LONGEST_TEXT
from app.survey.fields.values import InvalidValue, value_of
from vo_core.csv_rows import records

_HEADER = frozenset(known.name for known in FIELDS)
_FILE_KEYS = ("path", "file")
_ASSET_KEYS = ("asset", "asset_id")
_OWN = ("name", "project", "asset", "rig", "priority")
_SHOWN_FAULTS = 20
MOST_ROWS = 100_000
"""As many as films may be added at once."""


@dataclass
class Table:
    """Statements by film or asset."""

    title: str
    """What messages call it."""
    by_path: dict[str, Stated] = field(default_factory=dict)
    by_file: dict[str, Stated] = field(default_factory=dict)
    """By file name, or by path within the added folder, in lower case."""
    by_asset: dict[str, Stated] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    """Line of each key that no film has asked for yet."""

    def stated_of(self, path: str, relative: str, asset: str | None) -> Stated:
        """Return what the table says of a film.

        Args:
            path, relative: Text of its whole path, and of its path within the added folder.
            asset: What the film has as asset without the table.
        """
        keys = (
            (self.by_path, path),
            (self.by_file, relative.lower()),
            (self.by_file, PurePosixPath(path).name.lower()),
            (self.by_asset, (asset or "").lower()),
        )
        for statements, key in keys:
            if key in statements:
                self.lines.pop(key, None)
                return statements[key]
        return Stated()

    def unused(self) -> Iterator[str]:
        """Yield a sentence for each row that no film has asked for."""
        for key, line in self.lines.items():
            yield f"Line {line} of {self.title} names {key!r}, which is not among the films."


def read_table(text: str, title: str) -> Table:
    """Read a table whose rows name a film in the column path or file, or an asset in asset_id.

    Raises:
        InvalidTable: The text lists the first faults with the numbers of their lines.
    """
    rows = records(text.removeprefix("\N{BYTE ORDER MARK}"), InvalidTable, most_rows=MOST_ROWS)
    header_line, cells = next(rows, (1, []))
    names = [cell.strip().lower() for cell in cells]
    key = _key_column(names, header_line, title)
    table, found = Table(title), list[str]()
    for line, row in rows:
        values = dict(zip(names, (cell.strip() for cell in row), strict=False))
        if len(row) > len(names):
            found.append(f"line {line} has {len(row)} cells, the header {len(names)}")
        found += [f"line {line}: {fault}" for fault in _take(table, key, line, values)]
        if len(found) >= _SHOWN_FAULTS:
            break
    if found:
        raise InvalidTable(f"{title} cannot be used: {'; '.join(found)}.".capitalize())
    return table


def _key_column(names: list[str], line: int, title: str) -> str:
    known = {*_HEADER, *_OWN, *_FILE_KEYS}
    start = f"Line {line} of {title}"
    if unknown := [name for name in names if name not in known]:
        shown = ", ".join(repr(line_of(name)) for name in unknown[:_SHOWN_FAULTS])
        raise InvalidTable(
            f"{start} has the unknown columns {shown}; known are path, file, {', '.join(_OWN)} and "
            "the fields of the header."
        )
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InvalidTable(f"{start} has the column {twice} twice.")
    for key in (*_FILE_KEYS, *_ASSET_KEYS):
        if key in names:
            return key
    raise InvalidTable(
        f"{start} has none of the columns path, file and asset_id, which name films."
    )


def _take(table: Table, key: str, line: int, values: Mapping[str, str]) -> Iterator[str]:
    """Add a row; yield its faults."""
    name = values.get(key, "")
    if not name:
        yield f"{key} is empty"
        return
    if key == "path" and name.startswith("/"):
        statements = table.by_path
    else:
        statements = table.by_asset if key in _ASSET_KEYS else table.by_file
        name = name.lower()
    if name in statements:
        yield f"{name!r} has a line already"
        return
    header, priority = {}, None
    for column, text in values.items():
        if not text or column in (*_FILE_KEYS, *_OWN, key):
            continue
        if len(text) > LONGEST_TEXT:
            yield f"{column} is longer than {LONGEST_TEXT} characters"
            continue
        try:
            header[column] = value_of(column, text)
        except InvalidValue as error:
            yield str(error)
    if values.get("priority"):
        priority = _priority(values["priority"])
        if priority is None:
            yield f"priority must be a whole number from {-MOST_PRIORITY} to {MOST_PRIORITY}"
    asset = header.pop("asset_id", None)
    table.lines[name] = line
    statements[name] = Stated(
        name=line_of(values.get("name", "")) or None,
        project=line_of(values.get("project", "")) or None,
        asset=line_of(values.get("asset", "")) or (line_of(str(asset)) if asset else None),
        rig=line_of(values.get("rig", "")) or None,
        priority=priority,
        header=header,
    )


def _priority(text: str) -> int | None:
    try:
        number = int(text)
    except ValueError:
        return None
    return number if -MOST_PRIORITY <= number <= MOST_PRIORITY else None
