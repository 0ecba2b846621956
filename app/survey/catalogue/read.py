"""Reads a table of codes from CSV, checks it row by row and names every fault with its line.

Below the codes a second table may follow, whose first column is `rating`: how a section is graded.
docs/code_packs.md explains every column.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from importlib import resources
from itertools import pairwise
from typing import Any, TypeVar

from app.errors import InvalidPack
from app.survey.catalogue.columns import (
    BOUNDS,
    LABELS,
    NEEDED,
    OPTIONAL,
    RATING_NEEDED,
    RATING_OPTIONAL,
    THRESHOLDS,
    UNITS,
)
from app.survey.catalogue.ratings import GROUPS, QUICK, RULES, Rating
from app.survey.catalogue.table import LABEL_LANGUAGES, Bounds, Code, CodeTable
from vo_core.csv_rows import Record, decoded, records

MAX_BYTES = 2**20
MAX_ROWS = 5000
SHOWN_FAULTS = 20
STANDARD_CODES = "en13508_2_2003.csv"
RATING = "rating"
"""The first column of the table of ratings."""

_LABELS, _GRADES = tuple(LABELS), tuple(THRESHOLDS)
_BOUNDS = (("min_q1", "max_q1"), ("min_q2", "max_q2"))
MAX_GRADE = 100
_NEEDS, _UNITS = ("needs_clock", "needs_q1", "needs_q2"), ("unit_q1", "unit_q2")

Made = TypeVar("Made")
Row = Mapping[str, str]
Columns = Mapping[str, str]
Place = Callable[[int], str]
"""Says where a line of the text is in the file of a person."""

_CODE = re.compile(r"[A-Z][A-Z0-9]{0,7}")
_LETTER = re.compile(r"[A-Z][A-Z0-9]{0,3}")
_TEXT = re.compile(r"[^\x00-\x1f\x7f]{1,200}")
_HOTKEY = re.compile(r"[!-~]{1,20}")
_ICON = re.compile(r"[a-z][a-z0-9-]{0,39}")
_FINDING = re.compile(r"[A-Za-z][A-Za-z0-9_ -]{0,39}")
_NUMBER = re.compile(r"-?[0-9]{1,6}([.][0-9]{1,4})?", re.ASCII)
_EN = re.compile(r"[A-Z]{3}( [A-Z][A-Z0-9]{0,3}){0,2}")
_RATING = re.compile(r"[A-Z][A-Z0-9_]{1,15}")


def in_line(number: int) -> str:
    """Return where a line is in a text file."""
    return f"line {number}"


def read_table(name: str, content: bytes, place: Place = in_line) -> CodeTable:
    """Read a CSV file in UTF-8, separated by commas or semicolons, and check it row by row.

    Args:
        name: Name of the pack.
        content: The file.
        place: Says where a line of it is.

    Raises:
        InvalidPack: The text lists the first faults with their places, `faults` all of them.
    """
    if len(content) > MAX_BYTES:
        raise InvalidPack(f"The file has {len(content)} bytes; a pack may have {MAX_BYTES}.")
    found = [*records(decoded(content, InvalidPack), InvalidPack, most_rows=MAX_ROWS)]
    of_ratings = next((n for n, (_, cells) in enumerate(found) if _begins_ratings(cells)), None)
    rows, faults = _table(found[:of_ratings], NEEDED, OPTIONAL, place)
    _refuse(faults)  # without its columns nothing else can be said
    codes, faults = _checked(rows, _row_faults, _repeated, _code, place)
    if not rows:
        line = found[0][0] if found else 1
        faults = [f"{place(line)}: there is no row of codes below the names of the columns"]
    ratings: list[Rating] = []
    if of_ratings is not None:
        rows, columns = _table(found[of_ratings:], RATING_NEEDED, RATING_OPTIONAL, place)
        ratings, more = _checked(rows, _rating_faults, _misnamed, _rating, place)
        faults += columns + more
    _refuse(faults)
    return CodeTable(name, tuple(codes), tuple(ratings))


def _begins_ratings(cells: Sequence[str]) -> bool:
    return cells[0].strip().lower() == RATING


def _table(
    found: Sequence[Record], needed: Columns, optional: Columns, place: Place
) -> tuple[list[tuple[int, Row | str]], list[str]]:
    """Return the rows below the names of the columns by line, each by column or its fault, and the
    faults of the columns. Empty cells behind the last column are what a spreadsheet adds.
    """
    line, header = found[0] if found else (1, [])
    columns = _without_empty_end([column.strip().lower() for column in header])
    faults = [f"{place(line)}: {fault}" for fault in _column_faults(columns, needed, optional)]
    rows: list[tuple[int, Row | str]] = []
    for number, cells in found[1:] if not faults else ():
        kept = cells if any(map(str.strip, cells[len(columns) :])) else cells[: len(columns)]
        if len(kept) != len(columns):
            rows.append((number, f"{len(kept)} cells for {len(columns)} columns"))
        else:
            rows.append((number, dict(zip(columns, (one.strip() for one in kept), strict=True))))
    return rows, faults


def _without_empty_end(cells: list[str]) -> list[str]:
    filled = [n for n, cell in enumerate(cells, 1) if cell]
    return cells[: max(filled, default=0)]


def _column_faults(columns: Sequence[str], needed: Columns, optional: Columns) -> list[str]:
    known = (*needed, *optional)
    missing = [name for name in needed if name not in columns]
    counts = Counter(columns)
    unknown = [f"{name!r:.40}" for name in counts if name not in known][:SHOWN_FAULTS]
    twice = sorted(name for name in known if counts[name] > 1)
    return [
        f"{fault} {', '.join(names)}"
        for fault, names in (
            ("missing columns:", missing),
            (f"unknown columns (allowed are {', '.join(known)}):", unknown),
            ("repeated columns:", twice),
        )
        if names
    ]


def _checked(
    rows: Sequence[tuple[int, Row | str]],
    faults_of: Callable[[Row], list[str]],
    repeated: Callable[[Row, str, dict[object, str]], list[str]],
    make: Callable[[Row], Made],
    place: Place,
) -> tuple[list[Made], list[str]]:
    """Return what is made of the rows without a fault, and the faults of the others."""
    made: list[Made] = []
    faults: list[str] = []
    place_of: dict[object, str] = {}
    for line, row in rows:
        if isinstance(row, str):
            faults.append(f"{place(line)}: {row}")
            continue
        found = [*faults_of(row), *repeated(row, place(line), place_of)]
        faults += [f"{place(line)}: {fault}" for fault in found]
        if not found:
            made.append(make(row))
    return made, faults


def _row_faults(row: Row) -> list[str]:
    faults = _malformed(row, _RULES)
    faults += [
        f"{name} must be empty or a number from 0 to {MAX_GRADE} (found {row[name]!r:.40})"
        for name in ("grade_s", "grade_o")
        if row.get(name) and _grade(row[name]) is None
    ]
    faults += [
        f"unit_{q} is missing, as needs_{q} is {row[f'needs_{q}']}"
        for q in ("q1", "q2")
        if row[f"needs_{q}"].lower() in ("yes", "opt") and not row[f"unit_{q}"]
    ]
    return faults or [*_bound_faults(row), *_grade_faults(row), *_mapping_faults(row)]


def _malformed(row: Row, rules: Sequence[_CellRule]) -> list[str]:
    return [
        f"{name} must be {wanted} (found {row[name]!r:.40})"
        for name, pattern, may_be_empty, wanted in rules
        if name in row and not (pattern.fullmatch(row[name]) or (may_be_empty and not row[name]))
    ]


def _bound_faults(row: Row) -> Iterator[str]:
    for q, names in zip(("q1", "q2"), _BOUNDS, strict=True):
        least, most = (_number(row, name) for name in names)
        if (least, most) != (None, None) and row[f"needs_{q}"].lower() == "no":
            yield f"{' and '.join(names)} must be empty, as needs_{q} is no"
        if least is not None and most is not None and least > most:
            yield f"{names[0]} ({least:g}) is greater than {names[1]} ({most:g})"


def _grade_faults(row: Row) -> Iterator[str]:
    by, is_graded = row.get("grade_by", ""), _has_thresholds(row)
    if bool(by) != is_graded:
        yield "grade_by and at least one of grade_1 to grade_5 go together"
    elif by and row[f"needs_{by}"].lower() == "no":
        yield f"grade_by is {by}, but needs_{by} is no"
    elif by and (row.get("grade_s") or row.get("grade_o")):
        yield "grade_s and grade_o must be empty, as grade_by is set"
    yield from _not_rising(row)


def _not_rising(row: Row) -> Iterator[str]:
    known = [
        (name, value)
        for name, value in zip(_GRADES, _thresholds(row), strict=True)
        if value is not None
    ]
    for (name, value), (above, next_value) in pairwise(known):
        if next_value <= value:
            yield f"{above} ({next_value:g}) must be greater than {name} ({value:g})"


def _mapping_faults(row: Row) -> Iterator[str]:
    if not row.get("en13508"):
        return
    units = _standard().get(_mapped(row["en13508"]))
    if units is None:
        yield f"en13508: EN 13508-2 has no code {row['en13508']!r:.40}"
        return
    for q, unit in zip(("q1", "q2"), units, strict=True):
        if unit and row[f"unit_{q}"] and unit != row[f"unit_{q}"]:
            yield f"en13508: unit_{q} is {row[f'unit_{q}']}, but {row['en13508']} has {unit}"


def _mapped(text: str) -> tuple[str, str, str]:
    code, char1, char2 = [*text.split(), "", ""][:3]
    return code, char1, char2


@cache
def _standard() -> Mapping[tuple[str, str, str], tuple[str, str]]:
    """Return the units of each code of the standard."""
    text = resources.files("app.survey.catalogue").joinpath(STANDARD_CODES).read_text("utf-8")
    rows = [*csv.DictReader(text.splitlines())]
    return {
        (row["code"], row["char1"], row["char2"]): (row["unit_q1"], row["unit_q2"]) for row in rows
    }


def _repeated(row: Row, place: str, place_of: dict[object, str]) -> list[str]:
    """Describe what this row repeats from an earlier one, and remember its code and hotkey."""
    code = (row["code"], row["char1"], row["char2"])
    hotkey = row.get("hotkey")
    faults = []
    for thing, shown in ((code, " ".join(code).strip()), (hotkey, f"the hotkey {hotkey}")):
        if thing and place_of.setdefault(thing, place) != place:
            faults.append(f"{shown} is already in {place_of[thing]}")
    return faults


def _code(row: Row) -> Code:
    cells: dict[str, Any] = {name: row[name] for name in NEEDED}
    cells |= {name: cells[name].lower() for name in _NEEDS}
    cells |= {name: cells[name] or None for name in _UNITS}
    cells["continuous_allowed"] = cells["continuous_allowed"].lower() == "yes"
    return Code(
        **cells,
        grade_s=_grade(row.get("grade_s", "")),
        grade_o=_grade(row.get("grade_o", "")),
        hotkey=row.get("hotkey") or None,
        icon=row.get("icon") or None,
        labels=_labels(row),
        bounds=(_bounds(row, 0), _bounds(row, 1)),
        grade_by="q2" if row.get("grade_by") == "q2" else "q1" if row.get("grade_by") else None,
        grades=_thresholds(row) if row.get("grade_by") else (),
        en13508=_mapped(row["en13508"]) if row.get("en13508") else None,
        finding=row.get("finding") or None,
    )


def _labels(row: Row) -> Mapping[str, str]:
    return {
        language: row[column]
        for language, column in zip(LABEL_LANGUAGES, _LABELS, strict=True)
        if row.get(column)
    }


def _bounds(row: Row, quantity: int) -> Bounds:
    least, most = _BOUNDS[quantity]
    return _number(row, least), _number(row, most)


def _thresholds(row: Row) -> tuple[float | None, ...]:
    return tuple(_number(row, name) for name in _GRADES)


def _has_thresholds(row: Row) -> bool:
    return any(row.get(name) for name in _GRADES)


def _number(row: Row, name: str) -> float | None:
    text = row.get(name, "")
    return float(text) if text else None


def _grade(text: str) -> float | None:
    if not re.fullmatch(r"[0-9]{1,3}([.][0-9]{1,3})?", text, re.ASCII):
        return None
    return float(text) if float(text) <= MAX_GRADE else None


def _rating_faults(row: Row) -> list[str]:
    faults = _malformed(row, _RATING_RULES)
    if faults:
        return faults
    faults += _not_rising(row)
    if row["rule"].lower() == QUICK and _has_thresholds(row):
        faults.append("grade_1 to grade_5 must be empty, as the rule quick has its own grade")
    if not row["of"].split():
        faults.append("of is empty: name groups (S O) or ratings of rows above")
    return faults


def _misnamed(row: Row, place: str, place_of: dict[object, str]) -> list[str]:
    """Describe a name that is taken, and references to no row above, so that none is circular."""
    faults = [
        f"of names {name!r:.40}, which is neither a group (S, O) nor a rating of a row above"
        for name in row["of"].split()
        if name not in GROUPS and name not in place_of
    ]
    if place_of.setdefault(row["rating"], place) != place:
        faults.append(f"the rating {row['rating']} is already in {place_of[row['rating']]}")
    return faults


def _rating(row: Row) -> Rating:
    return Rating(
        name=row["rating"],
        label=row["label"],
        of=tuple(row["of"].split()),
        rule=row["rule"].lower(),
        grades=_thresholds(row) if _has_thresholds(row) else (),
        labels=_labels(row),
    )


_CellRule = tuple[str, re.Pattern[str], bool, str]
"""Column, pattern, whether it may be empty, what is expected."""
_LINE, _EMPTY_LINE = "a line of 1 to 200 characters", "empty or a line of at most 200 characters"
_CHARACTER = "empty, a capital letter, or one with up to 3 letters or digits"
_NEED = re.compile("yes|no|opt", re.IGNORECASE)
_UNIT = re.compile("|".join(UNITS))
_OF_NUMBERS = tuple(
    (name, _NUMBER, True, "empty or a number such as 2.5") for name in (*BOUNDS, *_GRADES)
)
_RULES: tuple[_CellRule, ...] = (
    ("code", _CODE, False, "1 to 8 capital letters and digits, a letter first"),
    *((name, _LETTER, True, _CHARACTER) for name in ("char1", "char2")),
    ("label", _TEXT, False, _LINE),
    *((name, _TEXT, True, _EMPTY_LINE) for name in _LABELS),
    ("group", re.compile("[SOCM]"), False, "S, O, C or M"),
    *((name, _NEED, False, "yes, no or opt") for name in _NEEDS),
    *(
        (name, _UNIT, True, f"empty or one of {', '.join(UNITS)}")
        for name in ("unit_q1", "unit_q2")
    ),
    ("continuous_allowed", re.compile("yes|no", re.IGNORECASE), False, "yes or no"),
    *_OF_NUMBERS,
    ("grade_by", re.compile("q1|q2"), True, "empty, q1 or q2"),
    ("en13508", _EN, True, "empty or a code such as BAB B A"),
    ("finding", _FINDING, True, "empty or a kind of finding such as crack"),
    ("hotkey", _HOTKEY, True, "empty or a key such as b or Shift+B"),
    ("icon", _ICON, True, "empty or a name of small letters, digits and dashes"),
)


_RATING_RULES: tuple[_CellRule, ...] = (
    ("rating", _RATING, False, "2 to 16 capital letters, digits or _, a letter first"),
    ("label", _TEXT, False, _LINE),
    *((name, _TEXT, True, _EMPTY_LINE) for name in _LABELS),
    ("of", _TEXT, False, "groups (S O) or ratings of rows above, separated by spaces"),
    ("rule", re.compile("|".join(RULES), re.IGNORECASE), False, f"one of {', '.join(RULES)}"),
    *_OF_NUMBERS[-len(_GRADES) :],
)


def _refuse(faults: Sequence[str]) -> None:
    if not faults:
        return
    more = len(faults) - SHOWN_FAULTS
    shown = [*faults[:SHOWN_FAULTS], *([f"and {more} more"] if more > 0 else [])]
    number = "a fault" if len(faults) == 1 else f"{len(faults)} faults"
    raise InvalidPack(f"The table has {number}: {'; '.join(shown)}.", faults)
