"""The facts of one inspection in a document over many: small, so that its report can be dropped."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from app.reports.content.condition import is_defect
from app.reports.content.grades import grade_of
from app.reports.report import Entry, Report
from app.survey.fields.header import number_of, project_of

_YEAR = re.compile(r"(\d{4})-\d{2}-\d{2}")


@dataclass(frozen=True)
class Found:
    """The defects of one code in one inspection."""

    label: str
    """Its meaning in the language of the report; empty for a code that no table has."""
    count: int
    worst: int | None
    """Highest severity, 0 to 5; None if no defect was rated."""
    stretches_m: float
    """Length of those that are stretches, together."""


@dataclass(frozen=True)
class Collected:
    """One inspection among many."""

    number: int
    """From 1, in the order of the document."""
    id: str
    name: str
    asset: str
    project: str
    road: str
    material: str
    date: str
    length_m: float | None
    defects: int
    """Counted defects: a stretch counts once."""
    urgent: int
    """Those of severity 5."""
    worst: int | None
    """Highest severity of a defect."""
    grade: str | None
    """Key of the words for its grade; None where the template wants none."""
    source: str | None
    """Key of the sentence about the rule of the grade."""
    built: str
    """Year of construction; empty if unknown, like the next field."""
    inspected: str
    codes: Mapping[str, Found]
    """Its defects by main code."""
    ends: tuple[tuple[float, float], tuple[float, float]] | None
    """Longitude and latitude of both ends, degrees; equal ones if only one end is known."""


def collected(number: int, report: Report) -> Collected:
    """Return the facts of an inspection.

    Args:
        number: Its place in the document, from 1.
        report: Its report.
    """
    header = report.header
    defects = [entry for entry in report.defects if is_defect(entry)]
    severities = [entry.tag.severity for entry in defects if entry.tag.severity is not None]
    grade = grade_of(report)
    date = " ".join(report.date.split())
    year, built = _YEAR.match(date), number_of(header.get("year"))
    return Collected(
        number=number,
        id=report.id,
        name=report.name,
        asset=report.asset,
        project=project_of(header) or "",
        road=_text(header, "road"),
        material=_text(header, "material"),
        date=date,
        length_m=report.distance_m,
        defects=len(defects),
        urgent=severities.count(5),
        worst=max(severities, default=None),
        grade=grade.word if grade else None,
        source=grade.source if grade else None,
        built=f"{built:.0f}" if built else "",
        inspected=year[1] if year else "",
        codes=_by_code(report, defects),
        ends=_ends(header),
    )


def _by_code(report: Report, defects: list[Entry]) -> dict[str, Found]:
    counts = Counter(entry.tag.code or "" for entry in defects)
    stretches_m = {
        stretch.number: (stretch.finish.distance_m or 0.0) - (stretch.start.distance_m or 0.0)
        for stretch in report.stretches
    }
    found = {}
    for code, count in counts.items():
        own = [entry for entry in defects if (entry.tag.code or "") == code]
        severities = [entry.tag.severity for entry in own if entry.tag.severity is not None]
        found[code] = Found(
            label=own[0].label(report.language) or "",
            count=count,
            worst=max(severities, default=None),
            stretches_m=sum(stretches_m.get(entry.cont_id or 0, 0.0) for entry in own),
        )
    return found


def _ends(
    header: Mapping[str, Any],
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return both ends; where one is unknown, the other stands for the whole culvert."""
    known = [
        (lon, lat)
        for end in ("start", "end")
        if (lon := number_of(header.get(f"{end}_lon"))) is not None
        and (lat := number_of(header.get(f"{end}_lat"))) is not None
        and abs(lon) <= 180
        and abs(lat) <= 90
    ]
    return (known[0], known[-1]) if known else None


def _text(header: Mapping[str, Any], name: str) -> str:
    return " ".join(str(header.get(name) or "").split())
