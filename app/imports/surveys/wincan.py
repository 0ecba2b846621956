"""Reads WinCan .db3: SQLite, of which only plain rows of real tables are read.

The file is untrusted: it is opened as a copy in memory; views, virtual tables, functions and
generated columns are refused; and every query is limited. Only known columns are read, looked up by
name, since versions differ.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from app.errors import InvalidImport
from app.imports.surveys.cells import clean, number, time_of_day
from app.imports.surveys.header import header_of
from app.imports.surveys.observations import observation_of, texts_of
from app.imports.surveys.survey import (
    MOST_SURVEYS,
    ImportedFile,
    ImportedObservation,
    ImportedSurvey,
    Notes,
    file_of,
    survey_of,
)
from app.survey.fields.header import FIELDS, LONGEST_TEXT
from app.survey.fields.observation import codes_of

_MAGIC = b"SQLite format 3\0"
_MOST_ROWS = 50_000
"""Most rows of a table; 200 surveys of 100 observations with two pictures each have 40 000."""
_MOST_VALUE_BYTES = 32 * 2**20
"""Most bytes of all values: one large default would be the value of every row."""
_MOST_STEPS = 2_000
"""Limit of a query, in units of _STEP instructions: some seconds."""
_STEP = 100_000
_MOST_TABLES = 5000
_LONGEST_VALUE = 2**20
_LONGEST_TEXT_BYTES = 8 * LONGEST_TEXT
"""Longest remark, which may be twice as long as other texts, in letters of four bytes."""

_SECTION, _INSPECTION, _OBSERVATION, _NODE, _MEDIA = (
    "SECTION", "SECINSP", "SECOBS", "NODE", "SECOBSMM",
)  # fmt: skip

_GRADES: Mapping[str, str] = {
    "structural grade": "OBS_GradeS", "operational grade": "OBS_GradeO",
    "hydraulic grade": "OBS_GradeH", "rating": "OBS_RateValue",
}  # fmt: skip
_OTHERS = (
    *_GRADES.values(), "INS_InspectedLength", "INS_HighestGrade", "OBS_Char3", "OMM_Type",
    "OMM_FileType", "OBJ_ID", "OBJ_Number", "OBJ_FromNode_REF", "OBJ_ToNode_REF", "INS_PK",
    "INS_Section_FK", "OBS_PK", "OBS_Inspection_FK", "OBS_SortOrder", "OBS_Q3_Value",
    "OBS_ContDefectLength", "OMM_Observation_FK", "OMM_FileName",
)  # fmt: skip
_READ = frozenset(
    name.upper()
    for names in (
        *(field.columns["wincan"].codes for field in FIELDS if "wincan" in field.columns),
        *codes_of("wincan").values(),
        _OTHERS,
    )
    for name in names
)
"""Columns to read, in capitals; those that end in _DELETED are read too."""
_TECHNICAL = re.compile(
    r"(?:_PK|_FK|_REF|_ID|_GUID|_?TIMESTAMP|_?SORTORDER|_DELETED|MODIFIED\w*|CREAT(?:ED|ION)\w*)$"
)
"""Columns, in capitals, that state nothing about a survey."""
_MOST_NAMED = 300
"""Columns of a table that are looked at, and letters of their names in a warning."""
_FILMS = frozenset(
    {
        "3gp", "asf", "avi", "divx", "flv", "m2v", "m4v", "mkv", "mov", "mp2", "mp4", "mpeg", "mpg",
        "mts", "ts", "vob", "webm", "wmv",
    }
)  # fmt: skip
_PICTURES = frozenset({"bmp", "gif", "heic", "jpeg", "jpg", "png", "tif", "tiff", "webp"})
_STRETCHES = {"S": "A", "F": "B"}
"""Start and finish in MSCC and PACP, as the letters of EN 13508-2."""
_STRETCH = re.compile(r"([SF])([0-9]{1,3})")
_MAY_BE_ZERO = "INS_Temperature"
_NOT_STATED = ("", "0", "False")
_CODE_LETTERS = 3
"""Letters of a code in EN 13508-2; further letters are its characters."""


@dataclass(frozen=True)
class _Row:
    """The values of a row by column name in capitals; NULL and binary values are left out."""

    values: Mapping[str, Any]

    def text(self, *names: str) -> str:
        """Return the first of these columns that is not empty."""
        for name in names:
            value = self.values.get(name.upper(), "")
            if isinstance(value, float) and value == int(value):
                value = int(value)
            text = str(value)
            if found := clean(text, len(text)):
                return found
        return ""

    def stated(self, *names: str) -> str:
        """Return the first of these columns that is neither empty nor zero nor False."""
        found = map(self.text, names)
        return next((text for text in found if text not in _NOT_STATED), "")

    def number(self, *names: str) -> float | None:
        """Return the first of these columns that holds a number."""
        return next(
            (found for name in names if (found := number(self.text(name))) is not None), None
        )

    @property
    def is_deleted(self) -> bool:
        """Return whether the program that wrote the row marked it as deleted."""
        marks = [value for name, value in self.values.items() if name.endswith("_DELETED")]
        return any(str(mark) not in _NOT_STATED for mark in marks)


@dataclass
class _Media:
    pictures: list[str] = field(default_factory=list)
    films: list[str] = field(default_factory=list)
    others: list[str] = field(default_factory=list)

    def add(self, row: _Row) -> None:
        """Add one by its kind; without a known one it is a picture if WinCan says so."""
        name = row.text("OMM_FileName")
        kinds = {name.rpartition(".")[2].lower(), row.text("OMM_FileType").lower().lstrip(".")}
        is_picture = row.text("OMM_Type").upper().startswith("PI") or "." not in name
        if kinds & _FILMS:
            found = self.films
        else:
            found = self.pictures if is_picture or kinds & _PICTURES else self.others
        if name and name not in found:
            found.append(name)


def looks_like(content: bytes) -> bool:
    """Return whether the content is an SQLite file."""
    return content.startswith(_MAGIC)


def read(content: bytes) -> ImportedFile:
    """Read all inspections of pipes.

    Raises:
        InvalidImport: The file is not SQLite, is damaged, or has no table of inspections.
    """
    try:
        with closing(_opened(content)) as database:
            return _file(database)
    except (sqlite3.Error, UnicodeDecodeError, OverflowError, MemoryError) as error:
        raise InvalidImport(
            f"The database cannot be read ({error}). Open it in WinCan, export it again, then try."
        ) from error


def _opened(content: bytes) -> sqlite3.Connection:
    """Open a copy in memory that answers plain SELECTs only."""
    database = sqlite3.connect(":memory:", isolation_level=None)
    database.execute("PRAGMA trusted_schema=OFF")
    database.execute("PRAGMA cell_size_check=ON")
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(len(content), _LONGEST_VALUE))
    # With a write-ahead log, a copy without the log cannot be opened: clear that flag.
    database.deserialize(content[:18] + b"\x01\x01" + content[20:])
    steps = 0

    def has_enough() -> bool:
        nonlocal steps
        steps += 1
        return steps > _MOST_STEPS

    database.set_progress_handler(has_enough, _STEP)
    database.set_authorizer(_authorize)
    read_bytes = 0

    def text(value: bytes) -> str:
        nonlocal read_bytes
        read_bytes += len(value)
        if read_bytes > _MOST_VALUE_BYTES:
            raise InvalidImport(
                f"The database holds more than surveys do: over {_MOST_VALUE_BYTES // 2**20} MiB "
                "of text. Export it again in WinCan, in several files."
            )
        return value[:_LONGEST_TEXT_BYTES].decode("utf-8", "replace")

    database.text_factory = text
    return database


def _authorize(action: int, first: str | None, *_: str | None) -> int:
    if action == sqlite3.SQLITE_PRAGMA:
        return sqlite3.SQLITE_OK if first == "table_xinfo" else sqlite3.SQLITE_DENY
    allowed = (sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ)
    return sqlite3.SQLITE_OK if action in allowed else sqlite3.SQLITE_DENY


def _tables(database: sqlite3.Connection) -> dict[str, str]:
    rows = database.execute("SELECT name, type, sql FROM sqlite_master").fetchmany(_MOST_TABLES)
    return {
        name.upper(): name
        for name, kind, sql in rows
        if kind == "table" and isinstance(name, str) and isinstance(sql, str)
        if sql.upper().split()[1:2] != ["VIRTUAL"]
    }


def _rows(database: sqlite3.Connection, table: str, notes: Notes) -> Iterator[_Row]:
    names = _columns(database, table, notes)
    if not names:
        return
    wanted = ", ".join(map(_quoted, names))
    selected = f"SELECT {wanted} FROM {_quoted(table)} LIMIT {_MOST_ROWS + 1}"  # noqa: S608
    for count, values in enumerate(database.execute(selected)):
        if count == _MOST_ROWS:
            notes.add("too_many_rows", most=_MOST_ROWS, table=table[:40])
            return
        yield _Row(
            {
                name.upper(): value
                for name, value in zip(names, values, strict=True)
                if value is not None and not isinstance(value, bytes)
            }
        )


def _columns(database: sqlite3.Connection, table: str, notes: Notes) -> list[str]:
    """Return the columns to read; a generated column may have any size, and WinCan has none."""
    columns = database.execute(f"PRAGMA table_xinfo({_quoted(table)})").fetchall()
    read: list[str] = []
    computed: list[str] = []
    left: list[str] = []
    for _, column, *_, hidden in columns:
        name = str(column)
        if name.upper() in _READ or name.upper().endswith("_DELETED"):
            (computed if hidden else read).append(name)
        elif not hidden and not _TECHNICAL.search(name.upper()):
            left.append(name)
    filled = [name for name in left[:_MOST_NAMED] if _is_filled(database, table, name)]
    for key, named in (("computed_columns", computed), ("columns_not_read", filled)):
        if named:
            notes.add(key, table=table[:40], names=", ".join(named)[:_MOST_NAMED])
    return read


def _is_filled(database: sqlite3.Connection, table: str, column: str) -> bool:
    name = _quoted(column)
    rows = f"SELECT {name} FROM {_quoted(table)} LIMIT {_MOST_ROWS}"  # noqa: S608
    stated = f"SELECT 1 FROM ({rows}) WHERE {name} NOT IN ('', 0, '0') LIMIT 1"  # noqa: S608
    return database.execute(stated).fetchone() is not None


def _quoted(name: str) -> str:
    doubled = name.replace('"', '""')
    return f'"{doubled}"'


def _file(database: sqlite3.Connection) -> ImportedFile:
    tables = _tables(database)
    for needed in (_SECTION, _INSPECTION, _OBSERVATION):
        if needed not in tables:
            found = ", ".join(sorted(tables)[:10]) or "none"
            raise InvalidImport(
                f"The database has no table {needed}, so it is not a WinCan project; its tables "
                f"are {found:.300}."
            )
    notes = Notes()
    for name, key in ((_NODE, "no_table_of_nodes"), (_MEDIA, "no_table_of_photos")):
        if name not in tables:
            notes.add(key, table=name)

    def rows(name: str) -> list[_Row]:
        there = _rows(database, tables[name], notes) if name in tables else iter(())
        return [row for row in there if not row.is_deleted]

    nodes = {row.text("OBJ_PK"): row.text("OBJ_Key", "OBJ_Number") for row in rows(_NODE)}
    media: dict[str, _Media] = {}
    for row in rows(_MEDIA):
        media.setdefault(row.text("OMM_Observation_FK"), _Media()).add(row)
    sections = {row.text("OBJ_PK", "OBJ_ID"): row for row in rows(_SECTION)}
    observed: dict[str, list[_Row]] = {}
    for row in rows(_OBSERVATION):
        observed.setdefault(row.text("OBS_Inspection_FK"), []).append(row)
    inspections = rows(_INSPECTION)
    surveys = (
        (None, partial(_survey, row, sections, nodes, observed.pop(row.text("INS_PK"), []), media))
        for row in inspections
    )
    file = file_of(surveys, notes.said)
    left = 0 if len(inspections) > MOST_SURVEYS else sum(map(len, observed.values()))
    if left:
        notes.add("of_no_inspection", count=left)
    return replace(file, warnings=tuple(notes.said))


def _survey(
    inspection: _Row,
    sections: Mapping[str, _Row],
    nodes: Mapping[str, str],
    observed: Sequence[_Row],
    media: Mapping[str, _Media],
    room: int,
) -> ImportedSurvey:
    notes = Notes()
    section = sections.get(inspection.text("INS_Section_FK"))
    if section is None:
        notes.add("no_section")
        section = _Row({})
    header = _header(inspection, section, nodes, notes)
    ordered = sorted(observed, key=_order)
    if len(ordered) > room:
        notes.add_too_many()
    files = [media.get(row.text("OBS_PK"), _Media()) for row in ordered]
    stated = [header.get("video_files", ""), *(name for each in files for name in each.films)]
    header["video_files"] = ", ".join(dict.fromkeys(filter(None, stated)))
    found = map(partial(_observation, notes=notes), ordered[:room], files)
    observations = [observation for observation in found if observation is not None]
    surveyed_m = inspection.number("INS_InspectedLength") or None
    return survey_of(header, observations, notes, "WinCan inspection", surveyed_m=surveyed_m)


def _order(row: _Row) -> tuple[float, float]:
    return row.number("OBS_SortOrder") or 0.0, row.number("OBS_Distance") or 0.0


def _header(
    inspection: _Row, section: _Row, nodes: Mapping[str, str], notes: Notes
) -> dict[str, Any]:
    both = _Row({**section.values, **inspection.values})

    def value_of(name: str) -> str:
        return both.text(name) if name == _MAY_BE_ZERO else both.stated(name)

    header = {
        "direction": "unknown",
        "time": time_of_day(inspection.text("INS_StartDate")),
        "wincan_highest_grade": inspection.number("INS_HighestGrade"),
        **header_of("wincan", value_of, notes),
    }
    ends = [_node(section.text(f"OBJ_{end}Node_REF"), nodes, notes) for end in ("From", "To")]
    if header["direction"] == "against_flow":
        ends.reverse()
    header["start_node"], header["end_node"] = ends
    if header.get("shape") == "circular":
        header.setdefault("width_mm", header.get("height_mm"))
    return header


def _node(reference: str, nodes: Mapping[str, str], notes: Notes) -> str:
    if reference and reference not in nodes:
        notes.add("unnamed_node", name=reference[:60])
    return nodes.get(reference) or reference


def _observation(row: _Row, media: _Media, notes: Notes) -> ImportedObservation | None:
    texts = texts_of("wincan", row.text)
    if row.number("OBS_Distance") is None:
        code = texts["code"].upper()
        notes.add("code_without_distance" if code else "neither_code_nor_distance", code=code)
        return None
    _split(texts)
    mark = row.stated("OBS_CD_Code1", "OBS_CDCode", "OBS_Continuous").upper()
    found = _STRETCH.fullmatch(mark)
    texts["continuous"] = f"{_STRETCHES[found[1]]}{found[2]}" if found else mark
    said = (row.text("OBS_Observation"), row.text("OBS_Memo"))
    texts["remark"] = ", ".join(filter(None, said))
    texts["photo_name"] = media.pictures[0] if media.pictures else ""
    labelled = {"char3": "OBS_Char3", "third quantity": "OBS_Q3_Value", **_GRADES}
    more = [
        *(f"{label} {text}" for label, name in labelled.items() if (text := row.stated(name))),
        *(f"photo {name}" for name in media.pictures[1:]),
        *(f"file {name}" for name in media.others),
    ]
    if length_m := row.number("OBS_ContDefectLength"):
        more.append(f"{length_m:g} m long")
    return observation_of(texts, notes, more=more)


def _split(texts: dict[str, str]) -> None:
    """Tell a code of EN 13508-2 and its characters apart, where they stand behind it."""
    code = texts["code"].upper()
    behind = code[_CODE_LETTERS:]
    if texts["char1"] or texts["char2"] or not code.isalpha() or not behind:
        return
    if code.startswith("AE") and len(behind) <= 4:
        texts["code"], texts["char1"] = code[:_CODE_LETTERS], behind
    elif code.startswith("B") and len(behind) <= 2:
        texts["code"], texts["char1"], texts["char2"] = code[:_CODE_LETTERS], behind[0], behind[1:]
