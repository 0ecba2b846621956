"""The worst first: what an engineer reads when there is time for one page."""

from __future__ import annotations

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable, PageBreak

from app.reports.content.axis import Axis, tick_step_m
from app.reports.content.condition import condition_of, worst_first
from app.reports.content.telling import NOTHING, Teller
from app.reports.pdf.cover import abandoned_sentence
from app.reports.pdf.flow import Badge, Column, Figure, Grid, Heading, note, paragraph
from app.reports.pdf.styles import (
    ACCENT,
    BODY,
    CELL,
    INK,
    RULE,
    SEVERITY,
    SMALL,
    TINY,
    WASH,
    WIDTH,
    on_severity,
)
from app.reports.pdf.text import draw, shortened
from app.reports.report import Entry, Report

_SHOWN = 15


def summary(report: Report, tell: Teller) -> list[Flowable]:
    """Key figures, the pipe at a glance, the worst defects."""
    worst = worst_first(report)
    parts: list[Flowable] = [
        Heading(tell("summary.title")),
        *(paragraph(text) for text in opening(report, tell)),
        Figure(26 * mm, lambda canvas: _figures(canvas, report, tell)),
        Heading(tell("summary.glance"), level=1, bookmark=False),
        Figure(30 * mm, lambda canvas: _glance(canvas, report, tell)),
        Heading(tell("summary.worst"), level=1, bookmark=False),
    ]
    if worst:
        parts.append(_table(worst[:_SHOWN], tell))
    else:
        parts.append(note(tell("summary.none_rated")))
    if len(worst) > _SHOWN:
        parts.append(note(tell("summary.more", n=len(worst) - _SHOWN)))
    return [*parts, PageBreak()]


def opening(report: Report, tell: Teller) -> list[str]:
    """The first sentences: that the survey was abandoned, if it was, and what is worst."""
    said = (abandoned_sentence(report, tell), worst_sentence(report, tell))
    return [text for text in said if text]


def worst_sentence(report: Report, tell: Teller) -> str:
    """The worst defect, or that nothing was rated."""
    worst = next(iter(worst_first(report)), None)
    if worst is None:
        return tell("summary.no_worst")
    return tell(
        "summary.worst_at",
        label=tell.label(worst),
        place=tell.place(worst),
        severity=worst.tag.severity,
        word=tell.severity(worst.tag.severity),
    )


def _figures(canvas: Canvas, report: Report, tell: Teller) -> None:
    condition = condition_of(report)
    met = report.adjusted.distance_class() if report.adjusted else None
    share = condition.stretch_percent
    figures = [
        (tell.length(report.distance_m), tell("summary.surveyed")),
        (str(len(report.defects)), tell("summary.observations")),
        (str(condition.counts[5]), tell("summary.act_now")),
        (tell(f"overall.{int(condition.overall)}"), tell("summary.overall")),
        (
            NOTHING if met is None else tell("summary.not_met") if met.percent is None
            else f"{met.percent:g} %",
            tell("summary.distance_class"),
        ),
        (NOTHING if share is None else f"{share:.0f} %", tell("summary.stretches")),
    ]  # fmt: skip
    gap = 3 * mm
    width = (WIDTH - (len(figures) - 1) * gap) / len(figures)
    big = BODY.bold().on(ACCENT)
    for n, (value, name) in enumerate(figures):
        x = n * (width + gap)
        canvas.setFillColor(WASH)
        canvas.rect(x, 6 * mm, width, 17 * mm, 0, 1)
        style = type(big)(12.5, 15, 600, ACCENT)
        draw(canvas, x + 2.5 * mm, 14.5 * mm, shortened(value, style, width - 4 * mm), style)
        draw(canvas, x + 2.5 * mm, 9 * mm, shortened(name, TINY, width - 4 * mm), TINY.soft())


def _glance(canvas: Canvas, report: Report, tell: Teller) -> None:
    """The pipe from the side, with its entries."""
    axis = Axis.of(report)
    top, bottom = 18 * mm, 11 * mm
    scale = (WIDTH - 8 * mm) / axis.length_m

    def x_of(distance_m: float) -> float:
        return 4 * mm + (distance_m - axis.first_m) * scale

    canvas.setFillColor(WASH)
    canvas.setStrokeColor(INK)
    canvas.setLineWidth(0.8)
    canvas.rect(x_of(axis.first_m), bottom, axis.length_m * scale, top - bottom, 0, 1)
    for y in (top, bottom):
        canvas.line(x_of(axis.first_m), y, x_of(axis.last_m), y)
    step_m = tick_step_m(tell, scale, 14 * mm)
    for distance_m in axis.ticks(step_m):
        x = x_of(distance_m)
        canvas.setStrokeColor(RULE)
        canvas.setLineWidth(0.4)
        canvas.line(x, bottom, x, bottom - 1.5 * mm)
        draw(canvas, x, bottom - 4.3 * mm, f"{distance_m / tell.per_unit_m:g}", TINY.soft(),
             "centre")  # fmt: skip
    draw(canvas, WIDTH, 2 * mm, tell("summary.axis", unit=tell.units), TINY.soft(), "right")
    for stretch in report.stretches:
        if stretch.start.distance_m is not None and stretch.finish.distance_m is not None:
            canvas.setStrokeColor(INK)
            canvas.setLineWidth(1.6)
            canvas.line(x_of(stretch.start.distance_m), bottom + 1.2 * mm,
                        x_of(stretch.finish.distance_m), bottom + 1.2 * mm)  # fmt: skip
    placed = [entry for entry in report.entries if entry.distance_m is not None]
    for entry in sorted(placed, key=lambda entry: entry.tag.severity or 0):  # the worst on top
        _mark(canvas, x_of(entry.distance_m or 0.0), top, bottom, entry)


def _mark(canvas: Canvas, x: float, top: float, bottom: float, entry: Entry) -> None:
    canvas.setStrokeColor(INK)
    canvas.setLineWidth(0.4)
    canvas.line(x, bottom, x, top + 2 * mm)
    if entry.tag.severity:
        canvas.setFillColor(SEVERITY.get(entry.tag.severity, WASH))
        canvas.circle(x, top + 4 * mm, 1.9 * mm, 1, 1)
        style = SMALL.bold().on(on_severity(entry.tag.severity))
        draw(canvas, x, top + 3.15 * mm, str(entry.tag.severity), style, "centre")


def _table(entries: list[Entry], tell: Teller) -> Grid:
    columns = (
        Column(tell("entry.severity_short"), 9 * mm),
        Column(tell("entry.place"), 31 * mm),
        Column(tell("entry.joint"), 14 * mm, "centre"),
        Column(tell("entry.clock_short"), 16 * mm, "centre"),
        Column(tell("entry.code"), 17 * mm),
        Column(tell("entry.what"), 75 * mm),
        Column(tell("entry.no"), 12 * mm, "right"),
    )
    rows = [
        (
            Badge(entry.tag.severity),
            [(tell.place(entry), CELL.bold())],
            "" if entry.joint_no is None else str(entry.joint_no),
            tell.clock(entry),
            tell.code(entry),
            [
                (tell.label(entry), CELL),
                (shortened(entry.tag.remark or "", SMALL, 72 * mm), SMALL.soft()),
            ],
            str(entry.seq),
        )
        for entry in entries
    ]
    return Grid(columns, rows)
