"""Reads EN 13508-2 text (Annex B): any separator, comma decimals, any order of fields.

An unreadable block or row is reported with its line; the others are read.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from app.imports.en13508_fields import COLUMNS, header_of, nodes_of, observation_of
from app.imports.survey import (
    MOST_OBSERVATIONS,
    MOST_OF_FILE,
    MOST_SURVEYS,
    Caveat,
    ImportedFile,
    ImportedObservation,
    ImportedSurvey,
    Notes,
    clean,
    survey_of,
    too_many_surveys,
)

_MARK = re.compile(r"^[ \t]{0,20}#(?:A1|B01|B1)[ \t]*=", re.MULTILINE)
_LIST = re.compile(r"#B0*([0-9]{1,2})=")
_LONGEST_LINE = 100_000
"""Longer lines are cut; the CSV reader accepts cells of 131 072 characters."""


@dataclass
class _Block:
    """The lines of one inspection, with their numbers."""

    line: int
    lists: list[tuple[int, str, str | None]] = field(default_factory=list)
    """Lists such as `#B01`: the line number, the codes, the values in the next line."""
    columns: str | None = None
    columns_line: int = 0
    rows: list[tuple[int, str]] = field(default_factory=list)


@dataclass(frozen=True)
class _Form:
    """The cell separators of the file."""

    separator: str = ";"
    quote: str | None = '"'

    def cells(self, line: str) -> list[str]:
        """Split a line; an unclosed quote ends with it."""
        line = line[:_LONGEST_LINE]
        if self.quote is None or self.quote not in line:
            return line.split(self.separator)
        reader = csv.reader([line], delimiter=self.separator, quotechar=self.quote)
        return next(reader, [])


def looks_like(content: bytes) -> bool:
    """Return whether some line is one that begins such a file."""
    return bool(_MARK.search(_decoded(content[: 2**16])))


def read(content: bytes) -> ImportedFile:
    """Read all readable inspections of the file; the warnings say why others are left out."""
    lines = _decoded(content).splitlines()
    form = _form(lines)
    surveys: list[ImportedSurvey] = []
    warnings: list[Caveat] = []
    room = MOST_OF_FILE
    for block in _blocks(lines):
        if len(surveys) == MOST_SURVEYS:
            warnings.append(too_many_surveys(block.line))
            break
        try:
            surveys.append(_survey(block, form, min(room, MOST_OBSERVATIONS)))
            room -= len(surveys[-1].observations)
        except _BadBlock as bad:
            warnings.append(bad.caveat)
    return ImportedFile(tuple(surveys), tuple(warnings))


class _BadBlock(Exception):
    """A block that cannot be read; the caveat says why."""

    def __init__(self, key: str, line: int, **values: str) -> None:
        super().__init__(key)
        self.caveat = Caveat(key, line, values)


def _decoded(content: bytes) -> str:
    """Decode as UTF-8 if it is valid, whatever #A1 says; else as Latin letters of one byte each."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", "replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace")


def _form(lines: Sequence[str]) -> _Form:
    stated = {line[:4]: line[4:] for line in lines if line[:2] == "#A" and line[3:4] == "="}
    # The separator may be a blank or a tab, so it is not stripped.
    separator = stated.get("#A3=", ";")[:1] or ";"
    quote = stated.get("#A5=", '"')[:1] or None
    return _Form(separator, None if quote == separator else quote)


def _blocks(lines: Sequence[str]) -> Iterator[_Block]:
    """Yield the blocks; each ends with #Z, with the next #B01, or with the file."""
    block: _Block | None = None
    wants_values = False
    for count, line in enumerate(lines, 1):
        if not line.strip():
            continue
        found = _LIST.match(line)
        if found:
            if int(found[1]) == 1 or block is None:
                if block is not None:
                    yield block
                block = _Block(count)
            block.lists.append((count, line[found.end() :], None))
            wants_values = True
        elif line.startswith("#Z"):
            if block is not None:
                yield block
            block, wants_values = None, False
        elif block is None or line.startswith("#A"):
            continue
        elif line.startswith("#C="):
            block.columns, block.columns_line = line[3:], count
            wants_values = False
        elif wants_values:
            at, codes, _ = block.lists[-1]
            block.lists[-1] = (at, codes, line)
            wants_values = False
        elif block.columns is not None:
            block.rows.append((count, line))
    if block is not None:
        yield block


def _survey(block: _Block, form: _Form, room: int) -> ImportedSurvey:
    notes = Notes()
    header = header_of(_stated(block, form, notes), notes)
    observations = tuple(_observations(block, form, header, notes, room))
    return survey_of(header, observations, notes, f"Inspection of line {block.line}")


def _stated(block: _Block, form: _Form, notes: Notes) -> dict[str, str]:
    """Return the values of the header by their codes."""
    stated: dict[str, str] = {}
    for line, codes, values in block.lists:
        if values is None:
            raise _BadBlock("block_without_values", line)
        names = [name.strip().upper() for name in form.cells(codes)]
        cells = form.cells(values)
        if len(cells) != len(names):
            notes.add("values_for_fields", line + 1, values=len(cells), fields=len(names))
        stated |= {
            name: clean(cell, len(cell))
            for name, cell in zip(names, cells, strict=False)
            if clean(cell, len(cell))
        }
    if not stated:
        raise _BadBlock("block_without_header", block.line)
    return stated


def _observations(
    block: _Block, form: _Form, header: Mapping[str, object], notes: Notes, room: int
) -> Iterator[ImportedObservation]:
    if block.columns is None:
        notes.add("no_columns", block.line)
        return
    columns = [name.strip().upper() for name in form.cells(block.columns)]
    for needed in ("I", "A"):
        if needed not in columns:
            raise _BadBlock("block_without_column", block.columns_line, name=needed)
    for name in columns:
        if name and name not in COLUMNS:
            notes.add("unknown_column", block.columns_line, name=name[:20])
    nodes = nodes_of(header)
    for count, (line, text) in enumerate(block.rows):
        if count == room:
            notes.add_too_many(line)
            return
        cells = form.cells(text)
        if len(cells) != len(columns):
            notes.add("values_for_columns", line, values=len(cells), columns=len(columns))
        if len(text) > _LONGEST_LINE:
            notes.add("long_line", line, most=_LONGEST_LINE)
        row = {name: clean(cell, len(cell)) for name, cell in zip(columns, cells, strict=False)}
        observation = observation_of(row, nodes, line, notes)
        if observation is not None:
            yield observation
