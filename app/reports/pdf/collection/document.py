"""Writes the document over many inspections; only one report is in memory at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import IO

from reportlab.lib.units import mm
from reportlab.platypus import Flowable

from app.errors import InspectionNotFound
from app.reports.collection.collected import Collected, collected
from app.reports.content.translator import Translator
from app.reports.content.typesetting import one_line
from app.reports.pdf import story_of
from app.reports.pdf.collection.front import OVERALL, Place, contents, cover, inspection_list
from app.reports.pdf.collection.plan import plan
from app.reports.pdf.collection.statistics import statistics
from app.reports.pdf.flow import Title, note
from app.reports.pdf.metadata import About
from app.reports.pdf.pages import Document, Running
from app.reports.pdf.styles import TITLE
from app.reports.report import Company, Report, failure
from vo_core.errors import ChainageError

_PAGES_OF_ONE = 50
"""Pages that hardly any report exceeds."""

Missing = tuple[str, str, str]
"""Id and name of an inspection that is not in the document, and why, in its language."""


def write(
    out: IO[bytes],
    ids: Sequence[str],
    report_of: Callable[[str], Report],
    t: Translator,
    *,
    begin: Callable[[str], None],
    done: Callable[[], None],
) -> list[Missing]:
    """Write the document.

    Args:
        out: An empty file.
        ids: The inspections, in the order of the document.
        report_of: Builds the report of an inspection in the language of `t`.
        t: The language and the units.
        begin: Gets the name of each inspection that is read or written.
        done: Is called once for each inspection that is in the document, or cannot be.

    Returns:
        What is not in it.

    Raises:
        ChainageError: None of the inspections can be read.
    """
    facts = _facts(ids, report_of, t, begin)
    front = Running(facts.company.name or "", t("collection.title"), _foot(facts, t), t)
    most_pages = _PAGES_OF_ONE * len(facts.inspections)
    document = Document(out, _about(facts, t), most_pages=most_pages)
    document.add_pages(front, _front(facts, t))
    for _ in facts.missing:
        done()
    for one in facts.inspections:
        begin(one.name)
        title = t("collection.part", number=one.number, asset=one.asset)
        try:
            report = report_of(one.id)
        except ChainageError as error:  # deleted since its facts were read
            gone = [
                Title(title, TITLE, after=4 * mm, bookmark=title),
                note(t("collection.gone")),
            ]
            document.add_pages(replace(front, title=title), gone, level=1, key=one.id)
            facts.missing.append((one.id, one.name, t.phrase(failure(error))))
        else:
            story = story_of(report, t)
            for piece in story:
                if isinstance(piece, Title):
                    piece.bookmark = title  # several may be of one asset
            document.add(report, t, str(one.number), story, level=1, key=one.id)
        done()
    document.close()
    return facts.missing


def _front(facts: _Facts, t: Translator) -> list[Flowable]:
    """Return what precedes the reports."""
    found = facts.inspections
    names = [name or inspection_id for inspection_id, name, _ in facts.missing]
    parts = {
        "list": inspection_list(found, names, t),
        "statistics": statistics(found, t),
        "plan": plan(found, t),
    }
    return [
        *cover(found, facts.company, facts.made_at, t),
        *contents(found, t),
        *(piece for name in OVERALL for piece in (Place(name), *parts[name])),
    ]


def _foot(facts: _Facts, t: Translator) -> str:
    return t("collection.foot", n=len(facts.inspections), made=t.instant(facts.made_at))


def _about(facts: _Facts, t: Translator) -> About:
    projects = dict.fromkeys(one.project for one in facts.inspections if one.project)
    return About(
        title=one_line(" · ".join([t("collection.title"), *projects])[:200]),
        author=one_line(facts.company.name or "") or "Chainage",
        subject=_foot(facts, t),
        language=t.language,
        made_at=facts.made_at,
    )


@dataclass
class _Facts:
    company: Company
    """Nobody where projects have different ones."""
    made_at: datetime
    inspections: list[Collected]
    missing: list[Missing]


def _facts(
    ids: Sequence[str],
    report_of: Callable[[str], Report],
    t: Translator,
    begin: Callable[[str], None],
) -> _Facts:
    """Read every inspection once, and keep its facts only: the list precedes the reports."""
    facts: _Facts | None = None
    missing: list[Missing] = []
    for inspection_id in ids:
        try:
            report = report_of(inspection_id)
        except ChainageError as error:
            missing.append((inspection_id, "", t.phrase(failure(error))))
            continue
        begin(report.name)
        facts = facts or _Facts(report.company, report.made_at, [], missing)
        if report.company != facts.company:
            facts.company = Company()
        facts.inspections.append(collected(len(facts.inspections) + 1, report))
    if facts is None:
        raise InspectionNotFound("None of these inspections is there any more.")
    return facts
