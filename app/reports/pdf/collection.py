"""One document over many inspections: cover, contents, list, statistics, plan, and every report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import IO

from app.errors import InspectionNotFound
from app.reports.collection.collected import Collected, collected
from app.reports.collection.plan import plan_of
from app.reports.collection.statistics import (
    GROUPINGS,
    By,
    CodeCount,
    Group,
    by_code,
    grouped,
    total,
)
from app.reports.content.translator import NOTHING, Translator
from app.reports.drawings.bars import Bar, bars
from app.reports.drawings.road_plan import EDGE, FOOT, HEIGHT, road_plan, scale_of
from app.reports.drawings.svg import WIDTH
from app.reports.pdf.model import Data, company_data, report_data, running_data
from app.reports.pdf.typesetter import About, Workshop, workshop
from app.reports.report import Company, FormatNeeds, Phrase, Report, failure
from app.reports.template import DEFAULT_TEMPLATE
from app.reports.text.typesetting import one_line
from vo_core.errors import ChainageError

MOST_INSPECTIONS, MOST_OBSERVATIONS = 150, 2500
"""More of either would take the memory of the machine: about 1 MB for each observation."""
_NAMED = 30
"""Numbers of inspections that the warning on the cover names."""
_BARS = 12
"""Most bars of one kind; the table below them has all."""
_RULES = {"grade.own_source": "condition.overall", "grade.structural_source": "grade.structural"}
"""Words for the grade of each rule, by the sentence about its source."""

Missing = tuple[str, str, str]
"""Id and name of an inspection that is not in the document, and why, in its language."""


@dataclass
class _Read:
    """What has been read of the inspections."""

    found: list[Collected] = field(default_factory=list)
    missing: list[Missing] = field(default_factory=list)
    company: Company = field(default_factory=Company)
    """Nobody where projects have different ones."""
    made_at: datetime = datetime.min
    """When the first report was made."""
    observations: int = 0

    def add(self, report: Report) -> Collected:
        """Keep the facts of one more report."""
        if not self.found:
            self.company, self.made_at = report.company, report.made_at
        elif report.company != self.company:
            self.company = Company()
        self.found.append(collected(len(self.found) + 1, report))
        self.observations += len(report.entries)
        if self.observations > MOST_OBSERVATIONS:
            raise _too_large()
        return self.found[-1]

    @property
    def projects(self) -> list[str]:
        """Their projects, each once."""
        return list(dict.fromkeys(one.project for one in self.found if one.project))


def write(
    out: IO[bytes],
    ids: Sequence[str],
    report_of: Callable[[str], Report],
    t: Translator,
    *,
    begin: Callable[[str], None],
    done: Callable[[], None],
    scratch: Path | None = None,
) -> list[Missing]:
    """Write the document; only one report is in memory at a time.

    Args:
        out: An empty file.
        ids: The inspections, in the order of the document.
        report_of: Builds the report of an inspection in the language of `t`.
        t: The language and the units.
        begin: Gets the name of each inspection that is read.
        done: Is called once for each inspection that is in the document, or cannot be.
        scratch: Folder for what the document is made of; None for the usual one.

    Returns:
        What is not in it.

    Raises:
        FormatNeeds: There are more inspections or observations than one document takes.
        ChainageError: None of the inspections can be read.
    """
    if len(ids) > MOST_INSPECTIONS:
        raise _too_large()
    read = _Read()
    with workshop(scratch) as shop:
        for inspection_id in ids:
            try:
                report = report_of(inspection_id)
            except ChainageError as error:
                read.missing.append((inspection_id, "", t.phrase(failure(error))))
            else:
                begin(report.name)
                one = read.add(report)
                title = t("collection.part", number=one.number, asset=one.asset)
                shop.write_data(f"report-{one.number}", report_data(report, t, shop, title=title))
            done()
        if not read.found:
            raise InspectionNotFound("None of these inspections is there any more.")
        foot = t("collection.foot", n=len(read.found), made=t.instant(read.made_at))
        about = About(
            title=one_line(" · ".join([t("collection.title"), *read.projects])[:200]),
            author=one_line(read.company.name or "") or "Chainage",
            subject=foot,
            language=t.language,
            made_at=read.made_at,
        )
        shop.write_data("front", _front(read, foot, t, shop))
        shop.set_document("collection", about, out, is_large=True)
    return read.missing


def _too_large() -> FormatNeeds:
    return FormatNeeds(
        f"One document takes at most {MOST_INSPECTIONS} inspections and {MOST_OBSERVATIONS} "
        "observations. Make several documents, or an archive with a PDF of each inspection.",
        Phrase(
            "failure.document_too_large",
            inspections=MOST_INSPECTIONS,
            observations=MOST_OBSERVATIONS,
        ),
    )


def _front(read: _Read, foot: str, t: Translator, shop: Workshop) -> Data:
    """Return what precedes the reports."""
    accent, found = DEFAULT_TEMPLATE.accent, read.found
    return {
        "accent": accent,
        "running": running_data(read.company, t("collection.title"), foot),
        "company": company_data(read.company, accent, t, shop),
        "reports": [f"report-{one.number}.json" for one in found],
        **_cover(found, read.projects, t.instant(read.made_at), t),
        "list": _list(found, read.missing, t),
        "statistics": _statistics(found, t, shop),
        "plan": _plan(found, t, shop),
    }


def _cover(found: Sequence[Collected], projects: Sequence[str], made: str, t: Translator) -> Data:
    whole = total(found)
    urgent = [one for one in found if one.urgent]
    numbers = ", ".join(str(one.number) for one in urgent[:_NAMED])
    numbers += ", …" if len(urgent) > _NAMED else ""
    n = sum(one.urgent for one in urgent)
    dates = sorted({one.date for one in found if one.date})
    first, last = (t.date(dates[0]), t.date(dates[-1])) if dates else (NOTHING, NOTHING)
    return {
        "projects": ", ".join(projects)[:200],
        "said": t(
            "collection.summary",
            n=whole.inspections,
            length=t.length(whole.length_m),
            defects=whole.defects,
        ),
        "warnings": (
            [{"text": t("collection.urgent", n=n, numbers=numbers), "is_alarm": True}]
            if urgent
            else []
        ),
        "facts": [
            (t("collection.projects"), ", ".join(projects) or NOTHING),
            (
                t("collection.dates"),
                first if first == last else t("collection.from_to", first=first, last=last),
            ),
            (t("collection.grades"), _grades(whole, t) or NOTHING),
            (t("collection.made"), made),
        ],
    }


def _grades(group: Group, t: Translator) -> str:
    """Format how often each grade occurs."""
    return " · ".join(f"{t(grade)}: {count}" for grade, count in group.grades)


def _list(found: Sequence[Collected], missing: Sequence[Missing], t: Translator) -> Data:
    """Return the list; grades of different rules stand in columns of their own."""
    sources = list(dict.fromkeys(one.source for one in found if one.source))
    names = ", ".join(name or inspection_id for inspection_id, name, _ in missing)
    return {
        "rules": (
            [t(_RULES[source]) for source in sources]
            if len(sources) > 1
            else [t("collection.grade")] * len(sources)
        ),
        "rows": [
            {
                "no": str(one.number),
                "asset": one.asset,
                "name": one.name if one.name != one.asset else "",
                "road": one.road or NOTHING,
                "length": NOTHING if one.length_m is None else t.number(one.length_m),
                "defects": str(one.defects),
                "worst": one.worst,
                "grades": [
                    t(one.grade) if one.grade and one.source == source else "" for source in sources
                ],
                "date": t.date(one.date),
            }
            for one in found
        ],
        "length_head": t("collection.length_in", unit=t.units),
        "notes": [
            *(t(source) for source in sources),
            *([t("collection.missing", names=names)] if missing else []),
        ],
    }


def _statistics(found: Sequence[Collected], t: Translator, shop: Workshop) -> Data:
    whole, codes = total(found), by_code(found)
    return {
        "totals": [
            (t("collection.inspections"), str(whole.inspections)),
            (t("collection.length"), t.length(whole.length_m)),
            (t("collection.defects"), str(whole.defects)),
            (t("collection.per_100", unit=t.units), _per_100(whole, t)),
            (t("collection.grades"), _grades(whole, t) or NOTHING),
        ],
        "stretches_head": t("collection.stretches", unit=t.units),
        "length_head": t("collection.length_in", unit=t.units),
        "per_100_head": t("collection.per_100", unit=t.units),
        "codes": [_code(one, t) for one in codes],
        "code_bars": _bars(
            t("collection.by_code"),
            [(_name(one, t), one.defects, one.worst) for one in codes],
            t,
            shop,
        ),
        "groups": [_grouped(by, grouped(found, by), t, shop) for by in GROUPINGS],
    }


def _bars(title: str, rows: Sequence[Bar], t: Translator, shop: Workshop) -> Data:
    """Return a drawing of the first rows; the table below it has all."""
    shown = rows[:_BARS]
    said = "; ".join(f"{one_line(name)}: {count}" for name, count, _ in shown)
    drawing = bars(shown, t("collection.bars_alt", title=title, bars=said))
    return {"title": title, "drawing": shop.add_drawing(drawing)}


def _name(one: CodeCount, t: Translator) -> str:
    return f"{one.code} {one.label}".strip() or t("entry.no_code")


def _code(one: CodeCount, t: Translator) -> Data:
    return {
        "code": one.code or t("entry.no_code"),
        "label": one.label,
        "defects": str(one.defects),
        "inspections": str(one.inspections),
        "stretches": t.number(one.stretches_m) if one.stretches_m else NOTHING,
        "worst": one.worst,
    }


def _grouped(by: By, groups: Sequence[Group], t: Translator, shop: Workshop) -> Data:
    def name(group: Group) -> str:
        if not group.name:
            return t("collection.not_stated")
        return t.value(by, group.name) if by == "material" else group.name

    rows = [(name(group), group.defects, group.worst) for group in groups]
    return {
        "bars": _bars(t(f"collection.by_{by}"), rows, t, shop),
        "name_head": t(f"collection.{by}"),
        "rows": [
            {
                "name": name(group),
                "inspections": str(group.inspections),
                "length": t.number(group.length_m),
                "defects": str(group.defects),
                "per_100": _per_100(group, t),
                "worst": group.worst,
                "grades": _grades(group, t),
            }
            for group in groups
        ],
    }


def _per_100(group: Group, t: Translator) -> str:
    """Format the defects on 100 m or 100 ft."""
    per = group.per_100_m
    return NOTHING if per is None else t.figure(per * t.per_unit_m, 1)


def _plan(found: Sequence[Collected], t: Translator, shop: Workshop) -> Data:
    """Return the sketch, and the inspections without coordinates."""
    margins = 2 * EDGE
    sketch = plan_of(found, WIDTH - margins, HEIGHT - margins - FOOT)
    unplaced = ", ".join(f"{one.number} {one.asset}" for one in sketch.unplaced)
    drawn = road_plan(sketch, DEFAULT_TEMPLATE.accent, t) if sketch.runs else None
    return {
        "note": t("collection.plan_note", n=len(sketch.runs), scale=scale_of(sketch)),
        "sketch": drawn and shop.add_drawing(drawn),
        "unplaced": t("collection.unplaced", names=unplaced) if unplaced else "",
    }
