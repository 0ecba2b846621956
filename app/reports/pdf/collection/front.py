"""What precedes the reports: cover, contents, and the list of the inspections."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

from reportlab.lib.units import mm
from reportlab.platypus import Flowable, NextPageTemplate, PageBreak, Spacer

from app.reports.collection.collected import Collected
from app.reports.collection.statistics import total
from app.reports.content.cover import Warned
from app.reports.content.translator import NOTHING, Translator
from app.reports.pdf.cover import band, letterhead
from app.reports.pdf.flow import Heading, Prose, Title, note
from app.reports.pdf.grid import Badge, Cell, Column, Contents, Grid, Linked, PageOf, pairs
from app.reports.pdf.paper import Paper
from app.reports.pdf.styles import BODY, CELL, INK, LINK, TITLE, WIDTH
from app.reports.pdf.text import shortened
from app.reports.report import Company

OVERALL = ("list", "statistics", "plan")
"""The parts over all inspections, which are places of the document."""
_NAMED = 30
"""Numbers of inspections that the warning on the cover names."""


def cover(
    inspections: Sequence[Collected], company: Company, made_at: datetime, t: Translator
) -> list[Flowable]:
    """Build the cover."""
    whole = total(inspections)
    projects = list(dict.fromkeys(one.project for one in inspections if one.project))
    said = t(
        "collection.summary",
        n=whole.inspections,
        length=t.length(whole.length_m),
        defects=whole.defects,
    )
    return [
        NextPageTemplate("page"),
        *letterhead(company, t),
        Title(t("collection.title"), TITLE, after=1 * mm, bookmark=t("collection.title")),
        Prose([(", ".join(projects)[:200], TITLE.on(INK))], after=3 * mm),
        Prose([(said, BODY.soft())], after=10 * mm),
        *(band(warned) for warned in _warnings(inspections, t)),
        Spacer(0, 6 * mm),
        pairs(
            [
                (t("collection.projects"), ", ".join(projects) or NOTHING),
                (t("collection.dates"), _dates(inspections, t)),
                (t("collection.grades"), grades_of(whole.grades, t) or NOTHING),
                (t("collection.made"), t.instant(made_at)),
            ]
        ),
        PageBreak(),
    ]


def grades_of(grades: Sequence[tuple[str, int]], t: Translator) -> str:
    """Format how often each grade occurs."""
    return " · ".join(f"{t(grade)}: {count}" for grade, count in grades)


def _warnings(inspections: Sequence[Collected], t: Translator) -> list[Warned]:
    urgent = [one for one in inspections if one.urgent]
    if not urgent:
        return []
    numbers = ", ".join(str(one.number) for one in urgent[:_NAMED])
    more = ", …" if len(urgent) > _NAMED else ""
    n = sum(one.urgent for one in urgent)
    return [Warned(t("collection.urgent", n=n, numbers=numbers + more), is_alarm=True)]


def _dates(inspections: Sequence[Collected], t: Translator) -> str:
    dates = sorted({one.date for one in inspections if one.date})
    if len(dates) < 2:
        return "".join(dates) or NOTHING
    return t("collection.from_to", first=dates[0], last=dates[-1])


def contents(inspections: Sequence[Collected], t: Translator) -> list[Flowable]:
    """Build the contents: the parts over all inspections, then each inspection."""
    columns = (
        Column(t("collection.no"), 14 * mm, "right"),
        Column(t("collection.asset"), WIDTH - 32 * mm),
        Column(t("collection.page"), 18 * mm, "right"),
    )
    parts: list[Sequence[Cell]] = []
    for name in OVERALL:
        title = t(f"collection.{name}")
        parts.append(("", Linked(title, name, title), PageOf(name, title)))
    for one in inspections:
        title = _title(one)
        shown = shortened(title, LINK, WIDTH - 36 * mm)
        parts.append(
            (str(one.number), Linked(shown, _begin(one), title), PageOf(_begin(one), title))
        )
    return [Heading(t("collection.contents")), Contents(columns, parts), PageBreak()]


class Place(Flowable):
    """Names the place where a part over all inspections begins."""

    canv: Paper

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return no size."""
        return 0, 0

    def draw(self) -> None:
        """Name the place."""
        self.canv.place(self._name, 0, 0)


def _begin(one: Collected) -> str:
    """Return the place where the report of an inspection begins."""
    return f"{one.id}/title"


def _title(one: Collected) -> str:
    return one.asset if one.asset == one.name else f"{one.asset} · {one.name}"


def inspection_list(
    inspections: Sequence[Collected], missing: Sequence[str], t: Translator
) -> list[Flowable]:
    """Build the list of the inspections with their grades; each row leads to its part."""
    columns = (
        Column(t("collection.no"), 10 * mm, "right"),
        Column(t("collection.asset"), 38 * mm, is_head=True),
        Column(t("collection.road"), WIDTH - 147 * mm),
        Column(t("collection.length_in", unit=t.units), 18 * mm, "right"),
        Column(t("collection.defects"), 18 * mm, "right"),
        Column(t("collection.worst"), 16 * mm),
        Column(t("collection.grade"), 20 * mm),
        Column(t("collection.date"), 17 * mm),
        Column(t("collection.page"), 10 * mm, "right"),
    )
    sources = dict.fromkeys(one.source for one in inspections if one.source)
    return [
        Heading(t("collection.list")),
        Grid(columns, [_cells(one, t) for one in inspections]),
        *(note(t(source)) for source in sources),
        *([note(t("collection.missing", names=", ".join(missing)))] if missing else []),
        PageBreak(),
    ]


def _cells(one: Collected, t: Translator) -> Sequence[Cell]:
    return (
        Linked(str(one.number), _begin(one), _title(one)),
        [(one.asset, CELL.bold()), *([(one.name, CELL.soft())] if one.name != one.asset else [])],
        one.road or NOTHING,
        NOTHING if one.length_m is None else t.number(one.length_m),
        str(one.defects),
        Badge(one.worst),
        t(one.grade) if one.grade else NOTHING,
        one.date,
        PageOf(_begin(one), _title(one)),
    )
