"""The grade of an asset by the rule that its template chooses, with everything it follows from.

None of the rules is a PACP, MSCC or DWA grade, and every report that shows a grade says so.

The classes for the stability of a pipe, from 1, slight, to 5, act at once, are facts of BFR
Abwasser, annex A-3 (classes of single defects, aim "stability"), which the German federal
government publishes at bfr-abwasser.de. A row is here only if two of three public sources state it
alike: the officially rated ISYBAU sample data, and the annex as two public programs apply it. They
disagree about cracks that gape, broken walls whose pieces only moved and damaged surfaces, so those
have no row. DWA-M 149-3 itself is licensed; nothing here is taken from it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from app.reports.content.condition import CLEANED_AWAY, condition_of, is_defect, overall_of
from app.reports.report import Entry, Report
from app.survey.fields.lists import MATERIALS

Rule = Literal["own", "structural"]


_FLEXIBLE = ("AL", "AM", "AN", "AO", "AP", "AV", "AW", "AX")
"""Materials of EN 13508-2, list ACD, that deform before they break: metals and plastics."""


@dataclass(frozen=True)
class Threshold:
    """The classes of one kind of defect."""

    code: str
    char1: str
    """Letters that it is for; empty: any, also none. The same holds for `char2`."""
    char2: str
    classes: tuple[int, ...]
    """The class of each range of the quantity, one more than there are limits."""
    limits: tuple[float, ...] = ()
    """Where the next range begins, in `unit`."""
    unit: str | None = None
    least: float = 0.0
    """Smaller quantities have no class."""
    is_flexible_only: bool = False
    """Whether it is for pipes of metal or plastic only."""

    def concerns(self, entry: Entry) -> bool:
        """Return whether the row is for the code of an entry."""
        tag = entry.tag
        return tag.code == self.code and all(
            not letters or letter in tuple(letters)
            for letters, letter in ((self.char1, tag.char1), (self.char2, tag.char2))
        )


THRESHOLDS = (
    Threshold("BAA", "AB", "", (1, 2, 3, 4, 5), (2, 6, 10, 15), "%", is_flexible_only=True),
    Threshold("BAB", "B", "ACDE", (2, 3, 4, 5), (2, 5, 10), "mm", least=0.5),
    Threshold("BAC", "B", "", (3,)),
    Threshold("BAC", "C", "", (5,)),
    Threshold("BAD", "A", "", (3,)),
    Threshold("BAD", "CD", "", (5,)),
    Threshold("BAE", "", "", (1, 2, 3, 4), (20, 50, 100), "mm"),
    Threshold("BAJ", "ABC", "", (1,)),
    Threshold("BAK", "D", "C", (3,)),
    Threshold("BAK", "EFLZ", "", (2,)),
    Threshold("BAM", "AC", "", (2,)),
    Threshold("BAM", "B", "", (1,)),
    Threshold("BAN", "", "", (3,)),
    Threshold("BAO", "", "", (4,)),
    Threshold("BAP", "", "", (5,)),
    Threshold("BBD", "ABCDZ", "", (5,)),
    Threshold("BBF", "AB", "", (2,)),
    Threshold("BBF", "C", "", (3,)),
    Threshold("BBF", "D", "", (4,)),
    Threshold("BBG", "", "", (2,)),
)


@dataclass(frozen=True)
class Input:
    """One defect that a grade follows from, or that has no class."""

    entry: Entry
    value: int | None
    """Its class on the scale of the grade; None where it has none."""
    threshold: str = ""
    """The severity, or the range of the quantity such as `5–10 mm`, that makes it this class;
    empty: any quantity."""
    reason: str | None = None
    """Why it has no class: cleaned, unrated, no_rule, no_quantity or no_material."""

    @property
    def why(self) -> str:
        """The key of the words for the reason."""
        return f"reason.{self.reason}"


@dataclass(frozen=True)
class Grade:
    """The grade of an asset: the higher, the worse."""

    rule: Rule
    grade: int | None
    """own: 1 excellent to 4 severe; structural: 0 no defect, 1 slight to 5 act at once; None
    where it cannot be graded."""
    worst: Entry | None
    """The first defect along the pipe that decides."""
    inputs: tuple[Input, ...]
    """Defects with a class, the worst first; a stretch counts once."""
    unclassified: tuple[Input, ...]
    """Defects without a class, along the pipe."""

    @property
    def source(self) -> str:
        """The key of the sentence that names the source of the rule."""
        return f"grade.{self.rule}_source"

    @property
    def word(self) -> str:
        """The key of the word for the grade."""
        if self.rule == "own":
            return f"overall.{self.grade or 0}"
        return f"structural.{'none' if self.grade is None else self.grade}"

    def decides(self, found: Input) -> bool:
        """Return whether the grade follows from this defect."""
        return found.value is not None and found.value == self.grade


def grade_of(report: Report) -> Grade | None:
    """Return the grade by the rule of the report's template; None where it wants no grade."""
    if report.template.grade == "none":
        return None
    return _structural(report) if report.template.grade == "structural" else _own(report)


def _own(report: Report) -> Grade:
    found = [_rated(entry) for entry in report.defects]
    condition = condition_of(report)
    inputs, unclassified = _sorted(found, report.entries, lambda one: one.entry.tag.severity or 0)
    return Grade("own", int(condition.overall) or None, condition.deciding, inputs, unclassified)


def _rated(entry: Entry) -> Input:
    severity = entry.tag.severity
    if severity is None:
        return Input(entry, None, "", "unrated")
    if entry.tag.code in CLEANED_AWAY:
        return Input(entry, None, str(severity), "cleaned")
    return Input(entry, int(overall_of(severity)), str(severity))


def _structural(report: Report) -> Grade:
    flexible = _is_flexible(report.header.get("material"))
    worst: dict[str, Input] = {}
    """Every entry with its class; of a stretch the part with the highest class."""
    for entry in report.entries:
        one = _classed(entry, flexible)
        known = worst.setdefault(entry.counted_as, one)
        if (one.value or 0) > (known.value or 0):
            worst[entry.counted_as] = one
    inputs, without = _sorted([*worst.values()], report.entries, lambda one: one.value or 0)
    if inputs:
        return Grade("structural", inputs[0].value, inputs[0].entry, inputs, without)
    is_sound = bool(report.entries) and not without
    return Grade("structural", 0 if is_sound else None, None, (), without)


def _sorted(
    found: Sequence[Input], entries: Sequence[Entry], badness: Callable[[Input], int]
) -> tuple[tuple[Input, ...], tuple[Input, ...]]:
    """Return those with a class, the worst first, and the defects among the others."""
    order = {entry.id: number for number, entry in enumerate(entries)}
    along = sorted(found, key=lambda one: order[one.entry.id])
    with_class = sorted((one for one in along if one.value is not None), key=badness, reverse=True)
    without = (one for one in along if one.value is None and is_defect(one.entry))
    return tuple(with_class), tuple(without)


def _is_flexible(words: object) -> bool | None:
    """Return whether a pipe of this material deforms before it breaks; None if it is unknown."""
    if not isinstance(words, str) or MATERIALS.meaning_of(words) is None:
        return None
    return MATERIALS.code("en", words) in _FLEXIBLE


def _classed(entry: Entry, flexible: bool | None) -> Input:
    """Return the class of an entry in a pipe that is flexible, rigid, or of unknown material."""
    row = next((row for row in THRESHOLDS if row.concerns(entry)), None)
    size = entry.tag.quant1
    if row is None or (row.is_flexible_only and flexible is False):
        return Input(entry, None, reason="no_rule")
    if row.is_flexible_only and flexible is None:
        return Input(entry, None, reason="no_material")
    if not row.limits:
        return Input(entry, row.classes[0])
    if size is None or entry.unit1 != row.unit:
        return Input(entry, None, reason="no_quantity")
    if size < row.least:
        return Input(entry, None, reason="no_rule")
    number = sum(size >= limit for limit in row.limits)
    return Input(entry, row.classes[number], _range(row, number))


def _range(row: Threshold, number: int) -> str:
    low = (row.least, *row.limits)[number]
    if number == len(row.limits):
        return f"≥ {low:g} {row.unit}"
    high = f"{row.limits[number]:g} {row.unit}"
    return f"{low:g}–{high}" if low else f"< {high}"
