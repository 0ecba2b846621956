"""A table as Parquet, by pyarrow: the extra `archive`."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import IO, Any

import pyarrow as pa
import pyarrow.parquet as pq

from app.search.tables import SCHEMA, Columns, Kind, Table

SUFFIX = "parquet"
IS_COMPRESSED = True

_TYPES: Mapping[Kind, pa.DataType] = {
    "text": pa.string(),
    "integer": pa.int64(),
    "number": pa.float64(),
    "boolean": pa.bool_(),
    "day": pa.date32(),
    "time": pa.timestamp("us", tz="UTC"),
}


class Writer:
    """Writes the rows of one table; each call of `write` is a row group."""

    def __init__(self, file: IO[bytes], table: Table) -> None:
        self._schema = pa.schema(
            [
                pa.field(
                    column.name,
                    _TYPES[column.kind],
                    metadata={"meaning": column.meaning, "unit": column.unit or ""},
                )
                for column in table.columns
            ],
            metadata={"schema": SCHEMA, "row": table.row},
        )
        self._writer = pq.ParquetWriter(_Counted(file), self._schema, compression="zstd")

    def write(self, columns: Columns) -> None:
        """Write some rows; None stands for unknown values."""
        self._writer.write_table(pa.Table.from_pydict(dict(columns), schema=self._schema))

    def close(self) -> None:
        """End the table."""
        self._writer.close()


class _Counted(io.RawIOBase):
    """A file that only grows and knows how far: a member of a ZIP archive does not."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._written = 0

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, content: Any) -> int:
        """Write all of `content`."""
        size = len(content)
        self._file.write(content)
        self._written += size
        return size

    def tell(self) -> int:
        """Return the number of bytes written."""
        return self._written
