"""A table of codes, and the CSV file that it is read from: the built-in pack, and imported ones.

Columns: code, char1, char2 (empty: not used or left open), label, group, needs_clock, needs_q1,
unit_q1, needs_q2, unit_q2, continuous_allowed; and, if wanted, grade_s, grade_o, hotkey, icon and
the label in other languages: label_ms and whatever else `labels_*.csv` of this folder names.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import resources
from typing import Any, Literal

from app.errors import InvalidPack
from vo_core.csv_rows import Record, decoded, records

MAX_BYTES = 2**20
MAX_ROWS = 5000
SHOWN_FAULTS = 20

Need = Literal["yes", "no", "opt"]

NEEDED = (
    "code", "char1", "char2", "label", "group", "needs_clock", "needs_q1", "unit_q1", "needs_q2",
    "unit_q2", "continuous_allowed",
)  # fmt: skip
LABEL_LANGUAGES = tuple(
    sorted(
        found[1]
        for file in resources.files("app.survey.catalogue").iterdir()
        if (found := re.fullmatch(r"labels_([a-z]{2})\.csv", file.name))
    )
)
"""Languages of labels beside English, by the files that translate the built-in ones."""
_LABELS = tuple(f"label_{language}" for language in LABEL_LANGUAGES)
OPTIONAL = (*_LABELS, "grade_s", "grade_o", "hotkey", "icon")
UNITS = ("mm", "%", "deg", "ppm", "count")
MAX_GRADE = 100
_NEEDS, _UNITS = ("needs_clock", "needs_q1", "needs_q2"), ("unit_q1", "unit_q2")

_CODE = re.compile(r"[A-Z][A-Z0-9]{0,7}")
_LETTER = re.compile(r"[A-Z][A-Z0-9]{0,3}")
_TEXT = re.compile(r"[^\x00-\x1f\x7f]{1,200}")
_HOTKEY = re.compile(r"[!-~]{1,20}")
_ICON = re.compile(r"[a-z][a-z0-9-]{0,39}")


@dataclass(frozen=True)
class Code:
    """One row: a main code with its characterisation."""

    code: str
    char1: str
    """Empty where the code has none or leaves it open; the same holds for `char2`."""
    char2: str
    label: str
    group: str
    """S structure, O operation, C inventory, M other."""
    needs_clock: Need
    needs_q1: Need
    needs_q2: Need
    unit_q1: str | None
    """mm, %, deg, ppm or count."""
    unit_q2: str | None
    continuous_allowed: bool
    grade_s: float | None = None
    """Structural grade set by the owner of the pack; `grade_o` is the one for operation."""
    grade_o: float | None = None
    hotkey: str | None = None
    icon: str | None = None
    labels: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Labels in other languages, as far as the pack has them."""

    def label_in(self, language: str) -> str:
        """Return the label in a language, else in that of the pack."""
        return self.labels.get(language, self.label)

    @property
    def label_ms(self) -> str:
        """The label in Malay, as programs know it."""
        return self.label_in("ms")

    @property
    def key(self) -> tuple[str, str, str]:
        """The key that identifies a row in its table."""
        return self.code, self.char1, self.char2


@dataclass(frozen=True)
class CodeTable:
    """The codes of an inspection."""

    name: str
    rows: tuple[Code, ...]
    """Rows in the order of the file."""

    def find(self, code: str | None, char1: str | None, char2: str | None) -> Code | None:
        """Return the best row: with both characters, else with the first, else the main code."""
        keys = ((char1 or "", char2 or ""), (char1 or "", ""), ("", ""))
        found = (self._by_key.get((code or "", *chars)) for chars in keys)
        return next((row for row in found if row is not None), None)

    def named(self, code: str | None, char1: str | None, char2: str | None) -> Code | None:
        """Return the row that names a code, by the rule of the page (core/defects/codes.js).

        A tag without characters yet, or with characters that the table lacks, takes the name of the
        main code: "Broken wall".

        Returns:
            The row of the full code, else the first of its main code with the common part of the
            labels; None for a code that is not in the table.
        """
        exact = self._by_key.get((code or "", char1 or "", char2 or ""))
        if exact is not None:
            return exact
        first = next((row for row in self.rows if row.code == code), None)
        if first is None:
            return None
        labels = {language: title_of(label) for language, label in first.labels.items()}
        return replace(first, char1="", char2="", label=title_of(first.label), labels=labels)

    @cached_property
    def _by_key(self) -> Mapping[tuple[str, str, str], Code]:
        return {row.key: row for row in self.rows}


def title_of(label: str) -> str:
    """Return the part of a label that the main code has in common."""
    return label.partition(":")[0]


def read_table(name: str, content: bytes) -> CodeTable:
    """Read a CSV file in UTF-8, separated by commas or semicolons, and check it row by row.

    Raises:
        InvalidPack: The text lists the first faults with the number of their line.
    """
    if len(content) > MAX_BYTES:
        raise InvalidPack(f"The file has {len(content)} bytes; a pack may have {MAX_BYTES}.")
    found = records(decoded(content, InvalidPack), InvalidPack, most_rows=MAX_ROWS)
    header_line, header = next(found, (1, []))
    columns = [column.strip().lower() for column in header]
    _refuse([f"line {header_line}: {fault}" for fault in _column_faults(columns)])
    rows, faults = _rows(columns, found)
    if not rows and not faults:
        faults = [f"line {header_line}: there is no row of codes below the names of the columns"]
    _refuse(faults)
    return CodeTable(name, tuple(rows))


def _column_faults(columns: Sequence[str]) -> list[str]:
    known = (*NEEDED, *OPTIONAL)
    missing = [name for name in NEEDED if name not in columns]
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


def _rows(columns: Sequence[str], below: Iterator[Record]) -> tuple[list[Code], list[str]]:
    rows: list[Code] = []
    faults: list[str] = []
    line_of: dict[object, int] = {}
    for line, cells in below:
        if len(cells) != len(columns):
            faults.append(f"line {line}: {len(cells)} cells for {len(columns)} columns")
            continue
        row = dict(zip(columns, (cell.strip() for cell in cells), strict=True))
        found = _row_faults(row) or _repeated(row, line, line_of)
        faults += [f"line {line}: {fault}" for fault in found]
        if not found:
            rows.append(_code(row))
    return rows, faults


def _row_faults(row: Mapping[str, str]) -> list[str]:
    faults = [
        f"{name} must be {wanted} (found {row[name]!r:.40})"
        for name, pattern, may_be_empty, wanted in _RULES
        if name in row and not (pattern.fullmatch(row[name]) or (may_be_empty and not row[name]))
    ]
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
    return faults


def _repeated(row: Mapping[str, str], line: int, line_of: dict[object, int]) -> list[str]:
    """Describe what this row repeats from an earlier one, and remember its code and hotkey."""
    code = (row["code"], row["char1"], row["char2"])
    hotkey = row.get("hotkey")
    faults = []
    for thing, shown in ((code, " ".join(code).strip()), (hotkey, f"the hotkey {hotkey}")):
        if thing and line_of.setdefault(thing, line) != line:
            faults.append(f"{shown} is already in line {line_of[thing]}")
    return faults


def _code(row: Mapping[str, str]) -> Code:
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
        labels={
            language: row[column]
            for language, column in zip(LABEL_LANGUAGES, _LABELS, strict=True)
            if row.get(column)
        },
    )


def _grade(text: str) -> float | None:
    if not re.fullmatch(r"[0-9]{1,3}([.][0-9]{1,3})?", text, re.ASCII):
        return None
    return float(text) if float(text) <= MAX_GRADE else None


_LINE, _EMPTY_LINE = "a line of 1 to 200 characters", "empty or a line of at most 200 characters"
_CHARACTER = "empty, a capital letter, or one with up to 3 letters or digits"
_NEED = re.compile("yes|no|opt", re.IGNORECASE)
_UNIT = re.compile("|".join(UNITS))
_RULES: tuple[tuple[str, re.Pattern[str], bool, str], ...] = (
    # column, pattern, may it be empty, what is expected
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
    ("hotkey", _HOTKEY, True, "empty or a key such as b or Shift+B"),
    ("icon", _ICON, True, "empty or a name of small letters, digits and dashes"),
)


def _refuse(faults: Sequence[str]) -> None:
    if not faults:
        return
    more = len(faults) - SHOWN_FAULTS
    shown = [*faults[:SHOWN_FAULTS], *([f"and {more} more"] if more > 0 else [])]
    number = "a fault" if len(faults) == 1 else f"{len(faults)} faults"
    raise InvalidPack(f"The table has {number}: {'; '.join(shown)}.")
