"""What stands against the report, who changed it since, and who answers for it."""

from __future__ import annotations

from collections import Counter

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import CondPageBreak, Flowable

from app.reports.content.telling import Teller
from app.reports.pdf.flow import Column, Figure, Grid, Heading, note
from app.reports.pdf.styles import BODY, CELL, INK, RULE, SMALL, WIDTH
from app.reports.pdf.text import draw, shortened
from app.reports.report import Report
from app.survey.records import Event

_EVENTS = 12


def sign_off(report: Report, tell: Teller) -> list[Flowable]:
    """Checks, history, signatures."""
    return [
        Heading(tell("sign.title")),
        Heading(tell("sign.checks"), level=1, bookmark=False),
        *_checks(report, tell),
        Heading(tell("sign.history"), level=1, bookmark=False),
        *_history(report, tell),
        CondPageBreak(70 * mm),
        Heading(tell("sign.signatures"), level=1, bookmark=False),
        note(tell("sign.statement", report=report.id, revision=report.revision)),
        Figure(52 * mm, lambda canvas: _signatures(canvas, report, tell)),
    ]


def _checks(report: Report, tell: Teller) -> list[Flowable]:
    if not report.issues:
        return [note(tell("sign.nothing"))]
    columns = (Column(tell("sign.level"), 24 * mm), Column(tell("sign.issue"), WIDTH - 24 * mm))
    entries = {entry.id: entry for entry in report.entries}
    rows = [
        (
            [(tell(f"sign.{issue.level}"), CELL.bold() if issue.level == "block" else CELL)],
            tell.issue(issue, entries),
        )
        for issue in report.issues
    ]
    return [Grid(columns, rows)]


def _history(report: Report, tell: Teller) -> list[Flowable]:
    if not report.events:
        return [note(tell("sign.no_history"))]
    counts = Counter((event.who, action_of(event)) for event in report.events)
    columns = (
        Column(tell("sign.who"), 60 * mm),
        Column(tell("sign.what"), WIDTH - 80 * mm),
        Column(tell("sign.times"), 20 * mm, "right"),
    )
    rows = [
        (who, tell.one_of("action", action), str(count))
        for (who, action), count in counts.most_common(_EVENTS)
    ]
    last = report.events[-1]
    return [
        Grid(columns, rows, after=1 * mm),
        note(tell("sign.last", at=tell.instant(last.at), who=last.who, n=len(report.events))),
    ]


def action_of(event: Event) -> str:
    """What was done to what, as its word is called."""
    subject = "inspection" if event.observation_id is None else "observation"
    return f"{subject}_{event.action}"


def _signatures(canvas: Canvas, report: Report, tell: Teller) -> None:
    header = report.header
    gap = 8 * mm
    width = (WIDTH - gap) / 2
    people = (
        (tell("sign.operator"), header.get("operator"), header.get("operator_certificate")),
        (tell("sign.reviewer"), header.get("reviewer"), None),
    )
    for n, (role, name, certificate) in enumerate(people):
        x = n * (width + gap)
        canvas.setStrokeColor(RULE)
        canvas.setLineWidth(0.6)
        canvas.rect(x, 2 * mm, width, 46 * mm, 1, 0)
        draw(canvas, x + 4 * mm, 42 * mm, role, CELL.soft())
        who = shortened(str(name or ""), BODY.bold(), width - 8 * mm)
        draw(canvas, x + 4 * mm, 36.5 * mm, who, BODY.bold())
        if certificate:
            text = tell("sign.certificate", certificate=certificate)
            draw(canvas, x + 4 * mm, 32 * mm, shortened(text, SMALL, width - 8 * mm), SMALL.soft())
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.5)
        for label, left, right in (
            (tell("sign.signature"), 4 * mm, width - 32 * mm),
            (tell("sign.date"), width - 28 * mm, width - 4 * mm),
        ):
            canvas.line(x + left, 11 * mm, x + right, 11 * mm)
            draw(canvas, x + left, 7 * mm, label, SMALL.soft())
