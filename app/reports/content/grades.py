"""The grade of an asset by the ratings that its code pack declares, else by the rule that its
template chooses, with everything it follows from.

None of the rules is a PACP, MSCC or DWA grade, and every report that shows a grade says so.

The classes for the stability of a pipe, from 1, slight, to 5, act at once, are facts of BFR
Abwasser, annex A-3 (classes of single defects, aim "stability"), which the German federal
government publishes at bfr-abwasser.de. A row is here only if two of three public sources state it
alike: the officially rated ISYBAU sample data, and the annex as two public programs apply it. They
disagree about cracks that gape, broken walls whose pieces only moved and damaged surfaces, so those
have no row. DWA-M 149-3 itself is licensed; nothing here is taken from it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Literal

from app.reports.content.condition import CLEANED_AWAY, condition_of, is_defect, overall_of
from app.reports.report import Entry, Report
from app.survey.catalogue.ratings import GROUPS, Rated, grade_from, rate
from app.survey.fields.lists import MATERIALS

Rule = Literal["own", "structural", "pack"]


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
    value: float | None
    """Its class on the scale of the grade, a whole number but for grades that a pack states; None
    where it has none."""
    threshold: str = ""
    """The severity, or the range of the quantity such as `5–10 mm`, that makes it this class;
    empty: any quantity."""
    reason: str | None = None
    """Why it has no class: cleaned, unrated, no_rule, not_in_pack, no_quantity or no_material."""
    by_group: Mapping[str, float] = field(default_factory=dict)
    """By a pack: its grade as a defect of the structure (S), of the operation (O)."""

    @property
    def why(self) -> str:
        """The key of the words for the reason."""
        return f"reason.{self.reason}"


@dataclass(frozen=True)
class Grade:
    """The grade of an asset: the higher, the worse."""

    rule: Rule
    grade: int | None
    """own: 1 excellent to 4 severe; structural: 0 no defect, 1 slight to 5 act at once; pack: 0 to
    5, the worst; None where it cannot be graded."""
    worst: Entry | None
    """The first defect along the pipe that decides."""
    inputs: tuple[Input, ...]
    """Defects with a class, the worst first; a stretch counts once."""
    unclassified: tuple[Input, ...]
    """Defects without a class, along the pipe."""
    rated: tuple[Rated, ...] = ()
    """What each rating of a pack makes of the asset; the grade is that of the last."""
    pack: str = ""
    """Name of the pack that grades."""

    @property
    def source(self) -> str:
        """The key of the sentence that names the source of the rule."""
        return f"grade.{self.rule}_source"

    @property
    def word(self) -> str:
        """The key of the word for the grade."""
        if self.rule == "own":
            return f"overall.{self.grade or 0}"
        grade = "none" if self.grade is None else self.grade
        return f"declared.{grade}" if self.rule == "pack" else f"structural.{grade}"

    def decides(self, found: Input) -> bool:
        """Return whether the grade follows from this defect."""
        return found.value is not None and found.value == self.grade


def grade_of(report: Report) -> Grade | None:
    """Return the grade by the ratings of the report's pack, else by the rule of its template; None
    where that wants no grade.
    """
    if report.template.grade == "none":
        return None
    if report.ratings:
        return _by_pack(report)
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
    inputs, without = _worst(report, partial(_classed, flexible=flexible))
    if inputs:
        return Grade("structural", int(inputs[0].value or 0), inputs[0].entry, inputs, without)
    is_sound = bool(report.entries) and not without
    return Grade("structural", 0 if is_sound else None, None, (), without)


def _by_pack(report: Report) -> Grade:
    inputs, without = _worst(report, _graded_by_pack)
    by_group = {group: [one.by_group.get(group, 0.0) for one in inputs] for group in GROUPS}
    rated = tuple(rate(report.ratings, by_group, report.distance_m))
    grade = rated[-1].grade
    if grade is None and all(one.value is None for one in rated):
        grade = 0 if report.entries and not without else None
    worst = inputs[0].entry if inputs and inputs[0].value == grade else None
    return Grade("pack", grade, worst, inputs, without, rated, report.pack)


def _graded_by_pack(entry: Entry) -> Input:
    """Return the grade of an entry as its pack declares it."""
    kind = entry.kind
    if kind is None:
        return Input(entry, None, reason="not_in_pack")
    if kind.grade_by is None:
        stated = zip(GROUPS, (kind.grade_s, kind.grade_o), strict=True)
        fixed = {group: grade for group, grade in stated if grade is not None}
        reason = None if fixed else "not_in_pack"
        return Input(entry, max(fixed.values(), default=None), reason=reason, by_group=fixed)
    size = entry.tag.quant1 if kind.grade_by == "q1" else entry.tag.quant2
    unit = kind.unit_q1 if kind.grade_by == "q1" else kind.unit_q2
    if size is None:
        return Input(entry, None, reason="no_quantity")
    limits = [limit for limit in kind.grades if limit is not None]
    grade = grade_from(size, kind.grades)
    extent = _range(limits, sum(size >= limit for limit in limits), unit)
    return Input(entry, grade, extent, by_group={kind.group: float(grade)})


def _worst(
    report: Report, rated: Callable[[Entry], Input]
) -> tuple[tuple[Input, ...], tuple[Input, ...]]:
    """Return the entries with a class, the worst first, and the defects without one; of a stretch
    the part with the highest class.
    """
    worst: dict[str, Input] = {}
    for entry in report.entries:
        one = rated(entry)
        known = worst.setdefault(entry.counted_as, one)
        if (one.value or 0) > (known.value or 0):
            worst[entry.counted_as] = one
    return _sorted([*worst.values()], report.entries, lambda one: one.value or 0)


def _sorted(
    found: Sequence[Input], entries: Sequence[Entry], badness: Callable[[Input], float]
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
    extent = _range(row.limits, number, row.unit, row.least)
    return Input(entry, row.classes[number], extent)


def _range(limits: Sequence[float], number: int, unit: str | None, least: float = 0.0) -> str:
    """Return the values of a range: below the first limit it has number 0."""
    low = (least, *limits)[number]
    if number == len(limits):
        return f"≥ {low:g} {unit or ''}".rstrip()
    high = f"{limits[number]:g} {unit or ''}".rstrip()
    return f"{low:g}–{high}" if low else f"< {high}"
