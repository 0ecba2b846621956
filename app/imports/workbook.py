"""The sheets of a code pack in an XLSX workbook, as one text in CSV.

A workbook is a program's file with many doors: only values are taken, and what could bring in
anything else is refused.
"""

from __future__ import annotations

import csv
import io
import mimetypes
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Any

import msgspec

from app.errors import InvalidPack
from app.survey.catalogue.read import MAX_ROWS, RATING

CODES, RATINGS = "codes", "ratings"
_MOST_COLUMNS = 64
_MOST_UNPACKED = 32 * 2**20
_MOST_PARTS = 500
_REFUSED_PARTS = {
    "vbaproject": "macros. Save it as a workbook without macros (.xlsx)",
    "externallinks": "links to other files. Break the links, and paste the values",
    "embeddings": "embedded files. Delete them",
}
_UNREADABLE = (
    zipfile.BadZipFile, KeyError, ValueError, TypeError, AttributeError,
    IndexError, OSError, NotImplementedError, EOFError, SyntaxError, AssertionError, zlib.error,
)  # fmt: skip
"""How a damaged workbook fails; a `SyntaxError` is how the parser of XML does."""


class Sheets(msgspec.Struct, frozen=True):
    """The sheets of a pack, below each other."""

    text: str
    rows: list[tuple[str, int]]
    """Name of each sheet, and how many lines of the text it has: a row is a line."""

    def place(self, line: int) -> str:
        """Return the sheet and the row where a line of the text is."""
        *before, (last, _) = self.rows
        for name, rows in before:
            if line <= rows:
                return f"sheet {name}, row {line}"
            line -= rows
        return f"sheet {last}, row {line}"


def read(content: bytes) -> Sheets:
    """Read the sheet `codes`, or the first one, and `ratings` if it is there.

    Raises:
        InvalidPack: It is no workbook of plain values; the text says why.
    """
    try:
        _require_plain(content)
        mimetypes.knownfiles.clear()  # openpyxl would read them; they are closed to the child
        import openpyxl  # here, as the server itself needs `Sheets` alone

        book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, keep_links=False)
        sheets = {sheet.title.strip().lower(): sheet for sheet in book.worksheets}
        if not sheets:
            raise InvalidPack("The workbook has no sheet.")
        codes = sheets.get(CODES, book.worksheets[0])
        tables = {codes.title: [*_rows(codes)]}
        if (ratings := sheets.get(RATINGS)) is not None and ratings is not codes:
            tables[ratings.title] = [*_rows(ratings)]
            _require_head(tables[ratings.title])
    except _UNREADABLE as error:
        raise InvalidPack(
            "The file cannot be read as an XLSX workbook. Save it again, or save its sheet as CSV."
        ) from error
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(chain.from_iterable(tables.values()))
    return Sheets(text.getvalue(), [(name, len(rows)) for name, rows in tables.items()])


def _require_plain(content: bytes) -> None:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        parts = archive.infolist()
        if len(parts) > _MOST_PARTS or sum(part.file_size for part in parts) > _MOST_UNPACKED:
            raise InvalidPack(
                f"The workbook unpacks to more than {_MOST_UNPACKED // 2**20} MiB, which no table "
                "of codes needs. Copy the table into a new workbook."
            )
        for part in parts:
            for name, what in _REFUSED_PARTS.items():
                if name in part.filename.lower():
                    raise InvalidPack(f"The workbook has {what}, then import it again.")
            # Only UTF-16 could hide it, and the parser of XML limits what entities grow to.
            if b"<!DOCTYPE" in archive.read(part):
                raise InvalidPack("The workbook declares XML entities, which none needs.")


def _rows(sheet: Any) -> Iterator[list[str]]:
    """Yield the cells of each row as texts, all rows equally long."""
    rows = sheet.iter_rows(max_row=MAX_ROWS + 2, max_col=_MOST_COLUMNS)
    for number, cells in enumerate(rows, 1):
        if number > MAX_ROWS + 1:
            raise InvalidPack(
                f"The sheet {sheet.title} has more than {MAX_ROWS} rows, empty ones included; "
                "delete those, or copy the table into a new workbook."
            )
        yield [_text(cell, f"Sheet {sheet.title}, row {number}") for cell in cells]


def _text(cell: Any, place: str) -> str:
    if cell.data_type in ("f", "e"):
        kind = "a formula" if cell.data_type == "f" else "an error of a formula"
        raise InvalidPack(f"{place}: {cell.coordinate} holds {kind}. Paste its value instead.")
    value = cell.value
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return "" if value is None else " ".join(str(value).split())


def _require_head(rows: Sequence[Sequence[str]]) -> None:
    first = next((row for row in rows if any(row)), [""])
    if first[0].lower() != RATING:
        raise InvalidPack(
            f"The first column of the sheet {RATINGS} must be {RATING} (found {first[0]!r:.40})."
        )
