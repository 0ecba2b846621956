"""The condition of the asset, with its rule in words."""

from __future__ import annotations

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable, PageBreak

from app.reports.content.condition import CLEANED_AWAY, SEVERITIES, Condition, condition_of
from app.reports.content.translator import NOTHING, Translator
from app.reports.pdf.flow import BADGE, Figure, Heading, Prose, draw_badge
from app.reports.pdf.styles import (
    ACCENT,
    BODY,
    CELL,
    INK,
    SEVERITY,
    SUBHEADING,
    WASH,
    WIDTH,
)
from app.reports.pdf.text import draw
from app.reports.report import Report

_ROW = 7 * mm


def condition(report: Report, t: Translator) -> list[Flowable]:
    """Build the overall condition, the counts, and the rule."""
    found = condition_of(report)
    texts = [
        (t("condition.rule", codes=", ".join(CLEANED_AWAY)), BODY),
        (t("condition.not_a_grade"), BODY.bold()),
        (t("condition.who"), BODY.soft()),
    ]
    if found.stretch_percent is not None:
        share = t("condition.stretches", percent=f"{found.stretch_percent:.0f}")
        texts.append((share, BODY))
    if report.header.get("end_condition") == "abandoned":
        texts.append((t("condition.abandoned"), BODY))
    return [
        Heading(t("condition.title")),
        Figure(24 * mm, lambda canvas: _overall(canvas, found, t)),
        Figure(_ROW * 7 + 8 * mm, lambda canvas: _counts(canvas, found, t)),
        Heading(t("condition.rule_title"), level=1, bookmark=False),
        *(Prose([text]) for text in texts),
        PageBreak(),
    ]


def _overall(canvas: Canvas, found: Condition, t: Translator) -> None:
    canvas.setFillColor(WASH)
    canvas.rect(0, 4 * mm, WIDTH, 19 * mm, 0, 1)
    draw(canvas, 5 * mm, 17 * mm, t("condition.overall"), CELL.soft())
    style = type(SUBHEADING)(16, 20, 600, ACCENT)
    draw(canvas, 5 * mm, 9 * mm, t(f"overall.{int(found.overall)}"), style)
    if found.deciding is not None:
        x = 70 * mm
        draw(canvas, x, 17 * mm, t("condition.deciding"), CELL.soft())
        draw_badge(canvas, x, 9.2 * mm, found.deciding.tag.severity)
        text = f"{t.place(found.deciding)} · {t.code(found.deciding)}"
        draw(canvas, x + BADGE + 2 * mm, 9.8 * mm, text, BODY.bold())


def _counts(canvas: Canvas, found: Condition, t: Translator) -> None:
    """Draw a bar for each severity, the severest first."""
    rows = [(s, found.counts[s], t.severity(s)) for s in reversed(SEVERITIES)]
    most = max(1, *(count for _, count, _ in rows), found.unrated)
    start, room = 62 * mm, WIDTH - 75 * mm
    y = 7 * _ROW + 4 * mm
    for severity, count, word in [*rows, (None, found.unrated, t("severity.none"))]:
        y -= _ROW
        draw_badge(canvas, 0, y + 1.4 * mm, severity)
        draw(canvas, BADGE + 2.5 * mm, y + 2.1 * mm, word, CELL)
        canvas.setFillColor(WASH if severity is None else SEVERITY[severity])
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.35)
        if count:
            canvas.rect(start, y + 1.2 * mm, room * count / most, 4 * mm, 1, 1)
        text = str(count) if count else NOTHING
        draw(canvas, start + room * count / most + 2 * mm, y + 2.1 * mm, text, CELL.bold())
