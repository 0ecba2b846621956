"""Writes the document over many inspections; only one report is in memory at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import IO

from reportlab.platypus import Flowable

from app.errors import InspectionNotFound
from app.reports.collection.collected import Collected, collected
from app.reports.content.translator import Translator
from app.reports.pdf import PARTS
from app.reports.pdf.collection.front import contents, cover, inspection_list
from app.reports.pdf.collection.leads import Target
from app.reports.pdf.collection.plan import plan
from app.reports.pdf.collection.statistics import statistics
from app.reports.pdf.collection.volume import Volume
from app.reports.pdf.flow import Heading, note
from app.reports.report import Company, Report
from vo_core.errors import ChainageError

Missing = tuple[str, str, str]
"""Id and name of an inspection that is not in the document, and why."""


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
    facts = _facts(ids, report_of, begin)
    document = Volume(out, t, facts.company, facts.made_at)
    names = [name or inspection_id for inspection_id, name, _ in facts.missing]
    for key, story in (
        ("cover", cover(facts.inspections, facts.company, facts.made_at, t)),
        ("contents", contents(facts.inspections, t)),
        ("list", inspection_list(facts.inspections, names, t)),
        ("statistics", statistics(facts.inspections, t)),
        ("plan", plan(facts.inspections, t)),
    ):
        document.add(t("collection.title"), [Target(key), *story])
    for _ in facts.missing:
        done()
    for one in facts.inspections:
        begin(one.name)
        title = t("collection.part", number=one.number, asset=one.asset)
        try:
            report = report_of(one.id)
        except ChainageError as error:  # deleted since its facts were read
            document.add(title, [Target(one.id), Heading(title), note(t("collection.gone"))])
            facts.missing.append((one.id, one.name, str(error)))
        else:
            document.add(title, [Target(one.id), Heading(title), *_story(report, t)], report)
        done()
    document.close()
    return facts.missing


def _story(report: Report, t: Translator) -> list[Flowable]:
    return [piece for part in PARTS for piece in part(report, t)]


@dataclass
class _Facts:
    company: Company
    made_at: datetime
    inspections: list[Collected]
    missing: list[Missing]


def _facts(
    ids: Sequence[str], report_of: Callable[[str], Report], begin: Callable[[str], None]
) -> _Facts:
    """Read every inspection once, and keep its facts only: the list precedes the reports."""
    facts: _Facts | None = None
    missing: list[Missing] = []
    for inspection_id in ids:
        try:
            report = report_of(inspection_id)
        except ChainageError as error:
            missing.append((inspection_id, "", str(error)))
            continue
        begin(report.name)
        facts = facts or _Facts(report.company, report.made_at, [], missing)
        facts.inspections.append(collected(len(facts.inspections) + 1, report))
    if facts is None:
        raise InspectionNotFound("None of these inspections is there any more.")
    return facts
