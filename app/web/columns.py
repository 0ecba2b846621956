"""Columns of numbers as bytes: a page reads 200,000 frames without parsing text."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

MEDIA_TYPE = "application/octet-stream"

_ALIGNED = 8
"""Alignment in bytes: a page reads the columns in place."""


def packed(columns: Mapping[str, NDArray[Any]], *, run: str, total: int) -> bytes:
    """Write columns one after another after a line of JSON that describes them.

    The line is `{"run": "...", "total": T, "rows": N, "columns": [[name, type], ...]}`, filled with
    blanks so that it ends, with its newline, at a multiple of 8 bytes. The types are numpy's
    (`float64`, `uint8`), in little-endian order; the widest come first.

    Args:
        columns: Each (N,).
        run: Id of the run that made the rows; those of two runs do not belong together.
        total: Number of rows that exist, of which N are written.
    """
    ordered = sorted(columns.items(), key=lambda item: -item[1].dtype.itemsize)
    rows = {len(column) for column in columns.values()}
    if len(rows) != 1:
        raise ValueError(f"Columns must be of one length; found {sorted(rows)}.")
    described = [[name, column.dtype.name] for name, column in ordered]
    head = {"run": run, "total": total, "rows": rows.pop(), "columns": described}
    line = json.dumps(head, separators=(",", ":"))
    blanks = " " * (-(len(line) + 1) % _ALIGNED)
    little = (column.astype(column.dtype.newbyteorder("<"), copy=False) for _, column in ordered)
    return b"".join([f"{line}{blanks}\n".encode(), *(column.tobytes() for column in little)])
