"""Reads EN 13508-2 text (Annex B): any separator, comma decimals, any order of fields, texts over
several lines in quotes.

An unreadable block or row is reported with its line; the others are read.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

from app.imports.surveys.cells import clean
from app.imports.surveys.en13508_fields import Coded, survey_from
from app.imports.surveys.letters import decoded
from app.imports.surveys.survey import Caveat, ImportedFile, ImportedSurvey, Notes, file_of

_MARK = re.compile(r"^[ \t]{0,20}#(?:A1|B01|B1)[ \t]*=", re.MULTILINE)
_ENCODING = re.compile(rb"^#A1=([ -~]{0,40})", re.MULTILINE)
_OF_FILE = re.compile(r"#A[0-9]{1,2}[ \t]*=")
_LIST = re.compile(r"#B0*([0-9]{1,2})=")
_OTHER_LIST = re.compile(r"#[A-Z][0-9]{0,2}=")
_LINE_END = re.compile(r"\r\n?|\n")
_LONGEST_LINE = 100_000
"""Longer lines are cut; the CSV reader accepts cells of 131 072 characters."""
_MOST_JOINED = 20
"""Lines of one row."""

Lines = Sequence[tuple[int, str]]
"""Lines of the file, with their numbers."""


@dataclass
class _Part:
    """A list of codes, `#B01` or `#C`, and the lines below it."""

    line: int
    codes: str
    lines: list[tuple[int, str]] = field(default_factory=list)


@dataclass
class _Block:
    line: int
    header: list[_Part] = field(default_factory=list)
    rows: list[_Part] = field(default_factory=list)


@dataclass(frozen=True)
class _Form:
    """The cell separators of the file."""

    separator: str = ";"
    quote: str | None = '"'

    def records(self, lines: Lines, wanted: int) -> Iterator[tuple[int, list[str]]]:
        """Yield the cells of each row, with the number of its first line.

        Args:
            lines: Of the rows.
            wanted: Number of cells of a row.
        """
        at = 0
        while at < len(lines):
            cells, count = self._record(lines, at, wanted)
            yield lines[at][0], cells
            at += count

    def cells(self, line: str) -> list[str]:
        """Split a line."""
        return self._record([(0, line)], 0, 0)[0]

    def _record(self, lines: Lines, at: int, wanted: int) -> tuple[list[str], int]:
        """Return the cells of the row that begins with a line, and the number of its lines.

        A quote that is never closed is a letter as any other.
        """
        first = lines[at][1][:_LONGEST_LINE]
        if self.quote is None or self.quote not in first:
            return first.split(self.separator), 1
        row = first
        for count, (_, following) in enumerate([*lines[at + 1 : at + _MOST_JOINED], (0, "")], 1):
            found = self._split(row, self.quote, is_strict=True)
            if found is not None and (count == 1 or len(found) <= wanted):
                return found, count
            row = f"{row}\n{following}"
            is_row = self.quote not in following and following.count(self.separator) + 1 >= wanted
            if len(row) > _LONGEST_LINE or is_row:
                break  # a row of its own follows
        plain = first.split(self.separator)
        lenient = self._split(first, self.quote, is_strict=False) or []
        return (plain if len(plain) == wanted else lenient), 1

    def _split(self, row: str, quote: str, *, is_strict: bool) -> list[str] | None:
        """Return the cells of a row; None if it does not keep the rules of CSV."""
        reader = csv.reader([row], delimiter=self.separator, quotechar=quote, strict=is_strict)
        try:
            return next(reader, [])
        except csv.Error:
            return None


def looks_like(content: bytes) -> bool:
    """Return whether some line is one that begins such a file."""
    return bool(_MARK.search(decoded(content[: 2**16], "")[0]))


def read(content: bytes) -> ImportedFile:
    """Read all readable inspections of the file; the warnings say why others are left out."""
    named = _ENCODING.search(content)
    text, said = decoded(content, named[1].decode("ascii") if named else "")
    lines = [(at, line) for at, line in enumerate(_LINE_END.split(text), 1) if clean(line, 1)]
    form = _form(lines)
    warnings = list(said)
    blocks = ((block.line, partial(_survey, block, form)) for block in _blocks(lines, warnings))
    return file_of(blocks, warnings)


class _BadBlock(Exception):
    """A block that cannot be read; the caveat says why."""

    def __init__(self, key: str, line: int, **values: str) -> None:
        super().__init__(key)
        self.caveat = Caveat(key, line, values)


def _form(lines: Lines) -> _Form:
    stated = {line[:4]: line[4:] for _, line in lines if line[:2] == "#A" and line[3:4] == "="}
    # The separator may be a blank or a tab, so it is not stripped.
    separator = stated.get("#A3=", ";")[:1] or ";"
    quote = stated.get("#A5=", '"')[:1] or None
    return _Form(separator, None if quote == separator else quote)


def _blocks(lines: Lines, warnings: list[Caveat]) -> Iterator[_Block]:
    """Yield the blocks; each ends with #Z, with the next #B01, or with the file. Lines that belong
    to none are added to the warnings.
    """
    block: _Block | None = None
    part: _Part | None = None
    stray = Notes()
    for at, line in lines:
        found = _LIST.match(line)
        if found:
            if block is not None and int(found[1]) == 1:
                yield block
                block = None
            block = block or _Block(at)
            part = _Part(at, line[found.end() :])
            block.header.append(part)
        elif line.startswith("#C=") and block is not None:
            part = _Part(at, line[3:])
            block.rows.append(part)
        elif line.startswith("#Z"):
            if block is not None:
                yield block
            block = part = None
        elif _OF_FILE.match(line):
            continue
        elif part is None or _OTHER_LIST.match(line):
            part = None
            stray.add("stray_line", at, text=f"{line!r:.40}")
        else:
            part.lines.append((at, line))
    if block is not None:
        yield block
    warnings += stray.said


def _survey(block: _Block, form: _Form, room: int) -> ImportedSurvey | Caveat:
    notes = Notes()
    for part in (*block.header, *block.rows):
        for line, text in part.lines:
            if len(text) > _LONGEST_LINE:
                notes.add("long_line", line, most=_LONGEST_LINE)
    try:
        rows = list(_rows(block, form, notes, room))
        return survey_from(_stated(block, form, notes), rows, notes, block.line)
    except _BadBlock as bad:
        return bad.caveat


def _stated(block: _Block, form: _Form, notes: Notes) -> Coded:
    stated: list[tuple[str, str]] = []
    for part in block.header:
        names = form.cells(part.codes)
        records = form.records(part.lines, len(names))
        line, cells = next(records, (part.line, []))
        if not cells:
            raise _BadBlock("block_without_values", part.line)
        if len(cells) != len(names):
            notes.add("values_for_fields", line, values=len(cells), fields=len(names))
        stated += _cells(names, cells)
        for line, cells in records:
            notes.add("stray_line", line, text=f"{form.separator.join(cells)!r:.40}")
    if not any(value for _, value in stated):
        raise _BadBlock("block_without_header", block.line)
    return stated


def _cells(names: Sequence[str], values: Sequence[str]) -> Coded:
    return [
        (name.strip().upper(), clean(value, len(value)))
        for name, value in zip(names, values, strict=False)
    ]


def _rows(block: _Block, form: _Form, notes: Notes, room: int) -> Iterator[tuple[int, Coded]]:
    if not block.rows:
        notes.add("no_columns", block.line)
    count = 0
    for part in block.rows:
        columns = form.cells(part.codes)
        for needed in ("I", "A"):
            if needed not in (name.strip().upper() for name in columns):
                raise _BadBlock("block_without_column", part.line, name=needed)
        for line, cells in form.records(part.lines, len(columns)):
            if count == room:
                notes.add_too_many(line)
                return
            count += 1
            if len(cells) != len(columns):
                notes.add("values_for_columns", line, values=len(cells), columns=len(columns))
            yield line, _cells(columns, cells)
