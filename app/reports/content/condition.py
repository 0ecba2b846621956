"""The overall condition of an asset by its worst defect: Chainage's own rule.

It is not a PACP, MSCC or DWA grade, and every report that shows it says so.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from app.reports.report import Entry, Report

CLEANED_AWAY = ("BBB", "BBC")
"""Attached and settled deposits of EN 13508-2: a need for cleaning is no damage."""
_DEFECTS = ("S", "O")
"""Groups of codes that are defects: structure and operation."""
SEVERITIES = range(6)
ACT_NOW = 5


class Overall(IntEnum):
    """Condition of the asset."""

    UNKNOWN = 0
    EXCELLENT = 1
    FAIR = 2
    POOR = 3
    SEVERE = 4


_OVERALL = (
    Overall.EXCELLENT, Overall.EXCELLENT, Overall.FAIR, Overall.FAIR, Overall.POOR, Overall.SEVERE,
)  # fmt: skip
"""By the severity of the worst defect."""


@dataclass(frozen=True)
class Condition:
    """The condition that follows from the severities of all entries."""

    overall: Overall
    deciding: Entry | None
    """The worst entry that counts."""
    counts: Mapping[int, int]
    """Number of defects of each severity, 0 to 5; a stretch counts once."""
    unrated: int
    stretch_percent: float | None
    """Share of the surveyed length covered by stretches; None without a length."""


def is_defect(entry: Entry) -> bool:
    """Return whether an entry may be a defect; one without a known code may."""
    return entry.kind is None or entry.kind.group in _DEFECTS


def overall_of(severity: int) -> Overall:
    """Return the condition that a defect of this severity makes of the asset."""
    return _OVERALL[min(max(severity, 0), 5)]


def condition_of(report: Report) -> Condition:
    """Return the condition of the asset, as far as it was seen and rated."""
    counts = Counter(entry.tag.severity for entry in report.defects)
    counted = [
        entry
        for entry in report.defects
        if entry.tag.severity is not None and entry.tag.code not in CLEANED_AWAY
    ]
    deciding = max(counted, key=lambda entry: entry.tag.severity or 0, default=None)
    severity = deciding.tag.severity if deciding else None
    return Condition(
        overall=Overall.UNKNOWN if severity is None else overall_of(severity),
        deciding=deciding,
        counts={severity: counts[severity] for severity in SEVERITIES},
        unrated=counts[None],
        stretch_percent=_stretch_percent(report),
    )


def worst_first(report: Report) -> list[Entry]:
    """Return the rated entries, the severest first, equal ones along the pipe."""
    rated = [entry for entry in report.defects if entry.tag.severity is not None]
    return sorted(rated, key=lambda entry: -(entry.tag.severity or 0))


def urgent(report: Report) -> list[Entry]:
    """Return the entries that need action now, along the pipe."""
    return [entry for entry in worst_first(report) if entry.tag.severity == ACT_NOW]


def _stretch_percent(report: Report) -> float | None:
    """Return the covered share of the length; overlaps count once."""
    if not report.distance_m or report.distance_m <= 0:
        return None
    spans = sorted(
        (stretch.start.distance_m, stretch.finish.distance_m)
        for stretch in report.stretches
        if stretch.start.distance_m is not None and stretch.finish.distance_m is not None
    )
    covered_m, reached_m = 0.0, -1e9
    for start_m, finish_m in spans:
        covered_m += max(0.0, finish_m - max(start_m, reached_m))
        reached_m = max(reached_m, finish_m)
    return 100 * min(1.0, covered_m / report.distance_m)
