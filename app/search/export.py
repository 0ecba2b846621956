"""The export of everything for analysis: one ZIP archive, made while it is sent.

It holds each table as one file, and `schema.json`, which says what the columns are and how many
rows there are. Memory is bounded by some thousand rows, or by the frames of one film.
"""

from __future__ import annotations

import importlib
import io
import json
import zipfile
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any, Literal

from app.errors import ExportNotAvailable
from app.search.tables import SCHEMA, TABLES, TRACKS, Rows, Table
from app.storage.index.defect_index import DefectIndex

Format = Literal["parquet", "json"]

MEDIA_TYPE = "application/zip"
_MODULES: dict[Format, str] = {
    "parquet": "app.search.parquet",
    "json": "app.search.json_lines",
}
"""Modules with the `Writer` of a table; that of Parquet needs an extra."""
_NO_PARQUET = (
    "Parquet needs pyarrow, which is not installed: pip install 'chainage[archive]'. "
    "The format json needs nothing more."
)


class ArchiveExport:
    """Writes all that the index holds."""

    def __init__(self, index: DefectIndex, rows: Rows) -> None:
        self._index = index
        self._rows = rows

    def blocks(self, format: Format, *, with_tracks: bool) -> Iterator[bytes]:  # noqa: A002
        """Return the archive in pieces.

        Raises:
            ExportNotAvailable: The software for the format is not installed.
        """
        try:
            module = importlib.import_module(_MODULES[format])
        except ModuleNotFoundError as missing:
            raise ExportNotAvailable(_NO_PARQUET) from missing
        tables = [table for table in TABLES if with_tracks or table is not TRACKS]
        return self._written(module, tables)

    def _written(self, module: Any, tables: list[Table]) -> Iterator[bytes]:
        made_at, pending = datetime.now(UTC), self._index.pending()
        numbers: list[int] = []
        out = _Outlet()
        # Parquet compresses its columns itself.
        method = zipfile.ZIP_STORED if module.IS_COMPRESSED else zipfile.ZIP_DEFLATED
        with zipfile.ZipFile(out, "w", method) as archive:
            for table in tables:
                rows = 0
                name = f"{table.name}.{module.SUFFIX}"
                with (
                    archive.open(name, "w", force_zip64=True) as file,
                    closing(module.Writer(file, table)) as writer,
                ):
                    for columns in self._rows.of(table):
                        writer.write(columns)
                        rows += len(columns[table.columns[0].name])
                        yield from out.taken()
                numbers.append(rows)
            described = {
                "schema": SCHEMA,
                "program": f"Chainage {version('chainage')}",
                "made_at": made_at.isoformat(timespec="seconds"),
                "pending": pending,
                "tables": [
                    _described(table, f"{table.name}.{module.SUFFIX}", rows)
                    for table, rows in zip(tables, numbers, strict=True)
                ],
            }
            archive.writestr("schema.json", json.dumps(described, indent=2, ensure_ascii=False))
        yield from out.taken()


def _described(table: Table, file: str, rows: int) -> dict[str, Any]:
    return {
        "name": table.name,
        "file": file,
        "row": table.row,
        "rows": rows,
        "columns": [
            {
                "name": column.name,
                "kind": column.kind,
                "unit": column.unit,
                "meaning": column.meaning,
            }
            for column in table.columns
        ],
    }


class _Outlet(io.RawIOBase):
    """Holds what was written until it is taken."""

    def __init__(self) -> None:
        self._content = bytearray()

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, content: Any) -> int:
        """Take all of `content`."""
        before = len(self._content)
        self._content += content
        return len(self._content) - before

    def taken(self) -> Iterator[bytes]:
        """Yield what was written since the last call, if there is something."""
        if self._content:
            content, self._content = bytes(self._content), bytearray()
            yield content
