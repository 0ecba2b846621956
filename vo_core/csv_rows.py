"""CSV files with a header, as people and programs write them.

Cells are separated by commas, or by semicolons or tabs if the header has more of them.  Lines that
start with # are comments, unless the file is said to have none.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, islice, repeat
from unicodedata import category, normalize

import numpy as np
from numpy.typing import NDArray

from vo_core.errors import InvalidTrack

Record = tuple[int, list[str]]
"""A row: the number of its last line, and its cells."""
_FORMULA_STARTS = frozenset("=+-@|")
"""Letters with which a spreadsheet begins a formula, or a program of its own."""
_CELL_ENDS = frozenset("\t\r\n")
_LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")


def decoded(content: bytes, refusal: type[Exception] = InvalidTrack) -> str:
    """Decode a file in UTF-8, with or without a byte order mark.

    Raises:
        refusal: The file is in another encoding; the message names the line.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise refusal(
            f"Line {line} is not in UTF-8. Save the table as CSV in UTF-8, then try again."
        ) from error


def separator_of(text: str, *, has_comments: bool = True, most_lines: int | None = None) -> str:
    """Return what separates the cells: a comma, semicolon or tab, by the first line of the first
    `most_lines` that is neither blank nor a comment.
    """
    lines = islice(_lines(text, has_comments=has_comments), most_lines)
    header = next((line for line in lines if line.strip()), "")
    return max(",;\t", key=header.count)


def records(
    text: str,
    refusal: type[Exception] = InvalidTrack,
    *,
    has_comments: bool = True,
    most_rows: int | None = None,
) -> Iterator[Record]:
    """Yield the rows that are neither blank nor a comment; the first one is the header.

    Args:
        text: Text of the file.
        refusal: What is raised for a file that cannot be used.
        has_comments: Whether lines that start with # are comments.
        most_rows: Rows that may follow the first one, blank ones and comments included.
    Raises:
        refusal: Quotation marks do not fit, a cell is too long, or there are too many rows; the
            message names the line.
    """
    reader = csv.reader(
        _lines(text, has_comments=has_comments),
        delimiter=separator_of(text, has_comments=has_comments, most_lines=most_rows),
        strict=True,
    )
    try:
        for number, cells in enumerate(reader):
            if most_rows is not None and number > most_rows:
                raise refusal(
                    f"The table has more than {most_rows} rows, empty ones included; delete those, "
                    "or split it into several files."
                )
            if any(cell.strip() for cell in cells):
                yield reader.line_num, cells
    except csv.Error as error:
        raise refusal(
            f"Line {reader.line_num} cannot be read as CSV: {error}; check its quotation marks."
        ) from error


def _lines(text: str, *, has_comments: bool) -> Iterator[str]:
    """Yield the lines one by one: all of them together take twenty times the memory of the text.

    A blank line stands in for a comment, so that the lines keep their numbers.
    """
    for found in _LINE.finditer(text):
        line = found[0]
        yield "\n" if has_comments and line[0] == "#" else line


def is_like_formula(text: str) -> bool:
    """Return whether a spreadsheet might run a cell with this text as a formula.

    Some ignore what cannot be seen before it, and take a letter in another width for the letter.
    """
    first = next((letter for letter in text if category(letter)[0] not in "ZC"), "")
    return text[:1] in _CELL_ENDS or normalize("NFKC", first) in _FORMULA_STARTS


def plain(text: str) -> str:
    """Return text that no spreadsheet takes for a formula: with an apostrophe where it might."""
    return f"'{text}" if is_like_formula(text) else text


def unquoted(text: str) -> str:
    """Return the text of a cell without the apostrophe of `plain`."""
    return text[1:] if text[:1] == "'" and is_like_formula(text[1:]) else text


def named_rows(
    text: str, needed: Sequence[str], of: str
) -> tuple[list[str], Iterator[tuple[int, Mapping[str, str]]]]:
    """Return the columns and, for each row, the number of its line and its cells by column.

    Args:
        text: Text of the file.
        needed: Columns that must be there.
        of: What the file holds, such as "track".
    Raises:
        InvalidTrack: A needed column is missing, or the text is not CSV.
    """
    found = records(text)
    _, header = next(found, (0, []))
    columns = [name.strip() for name in header]
    if missing := set(needed) - set(columns):
        raise InvalidTrack(f"The {of} has no column {', '.join(sorted(missing))}.")
    # A row that ends early has empty cells.
    rows = ((line, dict(zip(columns, chain(cells, repeat(""))))) for line, cells in found)  # noqa: B905
    return columns, rows


def number_columns(
    text: str, needed: Sequence[str], of: str, *, further: Sequence[str] = ()
) -> dict[str, NDArray[np.float64]]:
    """Return columns of numbers by name, with those of `further` that the file has.

    Raises:
        InvalidTrack: As in `named_rows`, or a value is not a finite number.
    """
    columns, rows = named_rows(text, needed, of)
    names = [*needed, *(name for name in further if name in columns)]
    values = []
    for line, cells in rows:
        try:
            values.append([finite(cells[name]) for name in names])
        except ValueError as error:
            raise InvalidTrack(f"Line {line} of the {of} is not numbers: {error}.") from error
    table = np.array(values, np.float64).reshape(-1, len(names))
    return dict(zip(names, table.T, strict=True))


def finite(text: str) -> float:
    """Parse a finite number.

    Raises:
        ValueError: The text is not a finite number.
    """
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text} is not finite")
    return value
