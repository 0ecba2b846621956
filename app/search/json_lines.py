"""A table as JSON Lines: one object for each row, in UTF-8."""

from __future__ import annotations

import json
from datetime import date, datetime
from typing import IO

from app.search.tables import Columns, Table

SUFFIX = "jsonl"
IS_COMPRESSED = False


class Writer:
    """Writes the rows of one table."""

    def __init__(self, file: IO[bytes], table: Table) -> None:
        self._file = file
        self._names = [column.name for column in table.columns]

    def write(self, columns: Columns) -> None:
        """Write some rows; None stands for unknown values, days and times are ISO 8601."""
        rows = zip(*(columns[name] for name in self._names), strict=True)
        for row in rows:
            line = dict(zip(self._names, row, strict=True))
            text = json.dumps(line, ensure_ascii=False, allow_nan=False, default=_iso)
            self._file.write(text.encode() + b"\n")

    def close(self) -> None:
        """End the table."""


def _iso(value: object) -> str:
    if isinstance(value, date | datetime):
        return value.isoformat()
    raise TypeError(f"{value!r} has no form in JSON")
