"""Statistics over all inspections: each as bars, and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import CondPageBreak, Flowable, PageBreak

from app.reports.collection.collected import Collected
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
from app.reports.content.typesetting import one_line
from app.reports.pdf.collection.front import grades_of
from app.reports.pdf.flow import Figure, Heading, note
from app.reports.pdf.grid import Badge, Cell, Column, Grid, pairs
from app.reports.pdf.styles import ACCENT, CELL, SEVERITY, WASH, WIDTH
from app.reports.pdf.text import draw, shortened
from app.survey.rounding import decimals

_BARS = 12
"""Most bars of one kind; the table below them has all."""
_BAR_HEIGHT = 5 * mm
_NAMES_WIDTH = 52 * mm
_FIGURES_WIDTH = 14 * mm


def statistics(inspections: Sequence[Collected], t: Translator) -> list[Flowable]:
    """Build the statistics: totals, by code, and by what inspections have in common."""
    whole = total(inspections)
    parts: list[Flowable] = [
        Heading(t("collection.statistics")),
        pairs(
            [
                (t("collection.inspections"), str(whole.inspections)),
                (t("collection.length"), t.length(whole.length_m)),
                (t("collection.defects"), str(whole.defects)),
                (t("collection.per_100", unit=t.units), _per_100(whole, t)),
                (t("collection.grades"), grades_of(whole.grades, t) or NOTHING),
            ]
        ),
        note(t("collection.counted")),
        *_by_code(by_code(inspections), t),
    ]
    for by in GROUPINGS:
        parts += _by(by, grouped(inspections, by), t)
    return [*parts, PageBreak()]


def _by_code(counts: Sequence[CodeCount], t: Translator) -> list[Flowable]:
    if not counts:
        return [note(t("collection.no_defects"))]
    columns = (
        Column(t("entry.code"), 16 * mm),
        Column(t("entry.what"), WIDTH - 100 * mm),
        Column(t("collection.defects"), 20 * mm, "right"),
        Column(t("collection.inspections"), 22 * mm, "right"),
        Column(t("collection.stretches", unit=t.units), 24 * mm, "right"),
        Column(t("collection.worst"), 18 * mm),
    )
    rows: list[Sequence[Cell]] = [
        (
            one.code or t("entry.no_code"),
            one.label,
            str(one.defects),
            str(one.inspections),
            t.number(one.stretches_m) if one.stretches_m else NOTHING,
            Badge(one.worst),
        )
        for one in counts
    ]
    bars = [
        (
            " ".join(filter(None, (one.code, one.label))) or t("entry.no_code"),
            one.defects,
            one.worst,
        )
        for one in counts
    ]
    return [*_bars(t("collection.by_code"), bars, t), Grid(columns, rows)]


def _by(by: By, groups: Sequence[Group], t: Translator) -> list[Flowable]:
    columns = (
        Column(t(f"collection.{by}"), WIDTH - 140 * mm),
        Column(t("collection.inspections"), 22 * mm, "right"),
        Column(t("collection.length_in", unit=t.units), 22 * mm, "right"),
        Column(t("collection.defects"), 18 * mm, "right"),
        Column(t("collection.per_100", unit=t.units), 20 * mm, "right"),
        Column(t("collection.worst"), 18 * mm),
        Column(t("collection.grades"), 40 * mm),
    )
    rows: list[Sequence[Cell]] = [
        (
            _name(by, group, t),
            str(group.inspections),
            t.number(group.length_m),
            str(group.defects),
            _per_100(group, t),
            Badge(group.worst),
            grades_of(group.grades, t),
        )
        for group in groups
    ]
    bars = [(_name(by, group, t), group.defects, group.worst) for group in groups]
    return [*_bars(t(f"collection.by_{by}"), bars, t), Grid(columns, rows)]


def _name(by: By, group: Group, t: Translator) -> str:
    if not group.name:
        return t("collection.not_stated")
    return t.value(by, group.name) if by == "material" else group.name


def _per_100(group: Group, t: Translator) -> str:
    """Format the defects on 100 m or 100 ft."""
    per = group.per_100_m
    return NOTHING if per is None else decimals(per * t.per_unit_m, 1)


_Bar = tuple[str, int, int | None]
"""Name, number of defects, and highest severity, which gives the colour."""


def _bars(title: str, bars: Sequence[_Bar], t: Translator) -> list[Flowable]:
    shown = bars[:_BARS]
    said = "; ".join(f"{one_line(name)}: {count}" for name, count, _ in shown)
    height = len(shown) * _BAR_HEIGHT + 3 * mm
    return [
        CondPageBreak(height + 45 * mm),  # heading, bars and the first rows stay together
        Heading(title, level=1),
        Figure(
            height,
            partial(_paint, bars=shown),
            alt=t("collection.bars_alt", title=title, bars=said),
        ),
    ]


def _paint(canvas: Canvas, bars: Sequence[_Bar]) -> None:
    most = max((count for _, count, _ in bars), default=0) or 1
    room = WIDTH - _NAMES_WIDTH - _FIGURES_WIDTH
    y = len(bars) * _BAR_HEIGHT + 2 * mm
    for name, count, worst in bars:
        y -= _BAR_HEIGHT
        draw(canvas, 0, y + 1.2 * mm, shortened(name, CELL, _NAMES_WIDTH - 2 * mm), CELL)
        canvas.setFillColor(WASH if worst is None else SEVERITY.get(worst, WASH))
        canvas.setStrokeColor(ACCENT)
        canvas.setLineWidth(0.35)
        if count:
            canvas.rect(
                _NAMES_WIDTH, y + 0.6 * mm, room * count / most, _BAR_HEIGHT - 1.4 * mm, 1, 1
            )
        x = _NAMES_WIDTH + room * count / most + 1.5 * mm
        draw(canvas, x, y + 1.2 * mm, str(count), CELL.bold())
