"""What should be done about the defects, and what it costs, as people accepted it.

Only what a person accepted for a defect is printed: a proposal of the template is none until then.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from app.reports.content.condition import is_defect
from app.reports.report import Entry, Report


@dataclass(frozen=True)
class Costs:
    """Sums of the estimated costs, in the currency of the template."""

    by_severity: Mapping[int | None, float]
    """The severest first, None (not rated) last; only those with a cost."""
    total: float


def costs_of(report: Report) -> Costs | None:
    """Return the sums; None where the template has no costs."""
    if not report.template.costs:
        return None
    sums: dict[int | None, float] = defaultdict(float)
    for entry in report.entries:
        if entry.tag.cost is not None:
            sums[entry.tag.severity] += entry.tag.cost
    order = sorted(sums, key=lambda severity: -1 if severity is None else severity, reverse=True)
    return Costs({severity: sums[severity] for severity in order}, sum(sums.values()))


def recommended(report: Report) -> list[Entry]:
    """Return the entries with a recommendation or a cost, along the pipe."""
    return [
        entry
        for entry in report.entries
        if entry.tag.recommendation or (report.template.costs and entry.tag.cost is not None)
    ]


def has_recommendations(report: Report) -> bool:
    """Return whether a report has anything to say about them: one, or a template with some."""
    return bool(report.template.recommendations or recommended(report))


def count_without(report: Report) -> int:
    """Return the number of defects without a recommendation; a stretch counts once."""
    defects = [entry for entry in report.entries if is_defect(entry)]
    advised = {entry.counted_as for entry in defects if entry.tag.recommendation}
    return len({entry.counted_as for entry in defects} - advised)
