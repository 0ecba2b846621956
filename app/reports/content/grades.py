"""The grade of an asset by the rule that its template chooses, with everything it follows from.

None of the rules is a PACP, MSCC or DWA grade, and every report that shows a grade says so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from app.reports.content.condition import CLEANED_AWAY, condition_of, is_defect, overall_of
from app.reports.content.stability import Classed, classed, is_flexible
from app.reports.report import Entry, Report

Rule = Literal["own", "structural"]


@dataclass(frozen=True)
class Input:
    """One defect that a grade follows from, or that has no class."""

    entry: Entry
    value: int | None
    """Its class on the scale of the grade; None where it has none."""
    threshold: str
    """The severity, or the range of the quantity, that makes it this class; empty: any quantity."""
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
    flexible = is_flexible(report.header.get("material"))
    found = [
        Input(entry, one.value, one.range, one.reason)
        for entry, one in _worst_parts(report.entries, flexible)
    ]
    inputs, unclassified = _sorted(found, report.entries, lambda one: one.value or 0)
    if inputs:
        return Grade("structural", inputs[0].value, inputs[0].entry, inputs, unclassified)
    is_sound = bool(report.entries) and not unclassified
    return Grade("structural", 0 if is_sound else None, None, (), unclassified)


def _worst_parts(
    entries: Iterable[Entry], is_flexible: bool | None
) -> Iterable[tuple[Entry, Classed]]:
    """Return every entry with its class; of a stretch the part with the highest class."""
    found: dict[str, tuple[Entry, Classed]] = {}
    for entry in entries:
        key = entry.id if entry.cont_id is None else f"stretch {entry.cont_id}"
        one = classed(entry, is_flexible)
        if key not in found or (one.value or 0) > (found[key][1].value or 0):
            found[key] = (entry, one)
    return found.values()


def _sorted(
    found: Sequence[Input], entries: Sequence[Entry], badness: Callable[[Input], int]
) -> tuple[tuple[Input, ...], tuple[Input, ...]]:
    """Return those with a class, the worst first, and the defects among the others."""
    order = {entry.id: number for number, entry in enumerate(entries)}
    along = sorted(found, key=lambda one: order[one.entry.id])
    with_class = sorted((one for one in along if one.value is not None), key=badness, reverse=True)
    without = (one for one in along if one.value is None and is_defect(one.entry))
    return tuple(with_class), tuple(without)
