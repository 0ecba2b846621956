"""The worst defects first: one page for an engineer in a hurry."""

from __future__ import annotations

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable

from app.reports.content.axis import Axis, tick_step_m
from app.reports.content.condition import condition_of, worst_first
from app.reports.content.grades import grade_of
from app.reports.content.summary import opening
from app.reports.content.translator import NOTHING, Translator
from app.reports.pdf.flow import Figure, Heading, draw_lines, height_of, note, paragraph
from app.reports.pdf.grid import Badge, Column, Grid
from app.reports.pdf.links import number_of
from app.reports.pdf.paper import Paper
from app.reports.pdf.styles import (
    ACCENT,
    CELL,
    INK,
    RULE,
    SEVERITY,
    SMALL,
    TINY,
    WASH,
    WIDTH,
    Style,
    on_severity,
)
from app.reports.pdf.text import draw, lines_of, shortened
from app.reports.report import Entry, Report

_SHOWN = 15


def summary(report: Report, t: Translator) -> list[Flowable]:
    """Build key figures, the pipe at a glance, and the worst defects."""
    worst, axis = worst_first(report), Axis.of(report)
    glance = t(
        "alt.glance",
        first=t.length(axis.first_m),
        last=t.length(axis.last_m),
        n=len(report.entries),
    )
    parts: list[Flowable] = [
        Heading(t("summary.title")),
        *(paragraph(text) for text in opening(report, t)),
        Figure(26 * mm, lambda paper: _figures(paper, report, t)),
        Heading(t("summary.glance"), level=1, bookmark=False),
        Figure(30 * mm, lambda canvas: _glance(canvas, report, t), alt=glance),
        Heading(t("summary.worst"), level=1, bookmark=False),
    ]
    if worst:
        parts.append(_table(report, worst[:_SHOWN], t))
    else:
        parts.append(note(t("summary.none_rated")))
    if len(worst) > _SHOWN:
        parts.append(note(t("summary.more", n=len(worst) - _SHOWN)))
    return parts


def _figures(paper: Paper, report: Report, t: Translator) -> None:
    condition, grade = condition_of(report), grade_of(report)
    met = report.adjusted.distance_class() if report.adjusted else None
    share = condition.stretch_percent
    figures = [
        (t.length(report.distance_m), t("summary.surveyed")),
        (str(len(report.entries)), t("summary.observations")),
        (str(condition.counts[5]), t("summary.act_now")),
        *([(t(grade.word), t("summary.overall"))] if grade else []),
        (
            NOTHING if met is None else t("summary.not_met") if met.percent is None
            else f"{met.percent:g} %",
            t("summary.distance_class"),
        ),
        (NOTHING if share is None else f"{share:.0f} %", t("summary.stretches")),
    ]  # fmt: skip
    gap = 3 * mm
    width = (WIDTH - (len(figures) - 1) * gap) / len(figures)
    big, small = Style(12.5, 15, 600, ACCENT), Style(9, 10.5, 600, ACCENT)
    room = width - 4 * mm
    for n, (value, name) in enumerate(figures):
        x = n * (width + gap)
        paper.setFillColor(WASH)
        paper.rect(x, 6 * mm, width, 17 * mm, 0, 1)
        lines = lines_of(value, big, room)
        if len(lines) > 1:  # a grade in words
            lines = lines_of(value, small, room)[:2]
        with paper.element("P"):
            draw_lines(paper, lines, x + 2.5 * mm, 16 * mm + height_of(lines) / 2, room, "left")
            draw(paper, x + 2.5 * mm, 9 * mm, shortened(name, TINY, room), TINY.soft())


def _glance(canvas: Canvas, report: Report, t: Translator) -> None:
    """Draw the pipe from the side, with its entries."""
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
    step_m = tick_step_m(t, scale, 14 * mm)
    for distance_m in axis.ticks(step_m):
        x = x_of(distance_m)
        canvas.setStrokeColor(RULE)
        canvas.setLineWidth(0.4)
        canvas.line(x, bottom, x, bottom - 1.5 * mm)
        draw(canvas, x, bottom - 4.3 * mm, f"{distance_m / t.per_unit_m:g}", TINY.soft(),
             "centre")  # fmt: skip
    draw(canvas, WIDTH, 2 * mm, t("summary.axis", unit=t.units), TINY.soft(), "right")
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


def _table(report: Report, entries: list[Entry], t: Translator) -> Grid:
    columns = (
        Column(t("entry.severity_short"), 9 * mm),
        Column(t("entry.place"), 31 * mm),
        Column(t("entry.joint"), 14 * mm, "centre"),
        Column(t("entry.clock_short"), 16 * mm, "centre"),
        Column(t("entry.code"), 17 * mm),
        Column(t("entry.what"), 75 * mm),
        Column(t("entry.no"), 12 * mm, "right"),
    )
    rows = [
        (
            Badge(entry.tag.severity),
            [(t.place(entry), CELL.bold())],
            "" if entry.joint_no is None else str(entry.joint_no),
            t.clock(entry),
            t.code(entry),
            [
                (t.label(entry), CELL),
                (shortened(entry.tag.remark or "", SMALL, 72 * mm), SMALL.soft()),
            ],
            number_of(report, entry, t),
        )
        for entry in entries
    ]
    return Grid(columns, rows)
