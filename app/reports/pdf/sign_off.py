"""Open issues of the report, its history, and signatures."""

from __future__ import annotations

from collections import Counter

from reportlab.lib.units import mm
from reportlab.platypus import CondPageBreak, Flowable, Spacer

from app.reports.content.translator import Translator
from app.reports.pdf.flow import Figure, Heading, Prose, note, say
from app.reports.pdf.grid import Column, Grid
from app.reports.pdf.paper import Paper
from app.reports.pdf.styles import BODY, CELL, INK, RULE, SMALL, WIDTH
from app.reports.pdf.text import shortened
from app.reports.report import Report

_EVENTS = 12


def sign_off(report: Report, t: Translator) -> list[Flowable]:
    """Build checks, history and signatures."""
    return [
        Heading(t("sign.title")),
        Heading(t("sign.checks"), level=1, bookmark=False),
        *_checks(report, t),
        Heading(t("sign.history"), level=1, bookmark=False),
        *_history(report, t),
        *closing(report, t),
        CondPageBreak(80 * mm),  # heading, notes and both fields stay together
        Heading(t("sign.signatures"), level=1, bookmark=False),
        note(f"{t('cover.review')}: {t.review(report)}."),
        note(t("sign.statement", report=report.id, revision=report.revision)),
        Figure(52 * mm, lambda canvas: _signatures(canvas, report, t)),
    ]


def closing(report: Report, _: Translator) -> list[Flowable]:
    """Build the closing text of the template, if it has one."""
    text = report.template.closing
    return [Spacer(0, 4 * mm), Prose([(text, BODY)], after=4 * mm)] if text else []


def _checks(report: Report, t: Translator) -> list[Flowable]:
    if not report.issues:
        return [note(t("sign.nothing"))]
    columns = (Column(t("sign.level"), 24 * mm), Column(t("sign.issue"), WIDTH - 24 * mm))
    entries = {entry.id: entry for entry in report.entries}
    rows = [
        (
            [(t(f"sign.{issue.level}"), CELL.bold() if issue.level == "block" else CELL)],
            t.issue(issue, entries),
        )
        for issue in report.issues
    ]
    return [Grid(columns, rows)]


def _history(report: Report, t: Translator) -> list[Flowable]:
    if not report.events:
        return [note(t("sign.no_history"))]
    counts = Counter((event.who, t.action(event)) for event in report.events)
    columns = (
        Column(t("sign.who"), 60 * mm),
        Column(t("sign.what"), WIDTH - 80 * mm),
        Column(t("sign.times"), 20 * mm, "right"),
    )
    rows = [(who, action, str(count)) for (who, action), count in counts.most_common(_EVENTS)]
    last = report.events[-1]
    return [
        Grid(columns, rows, after=1 * mm),
        note(t("sign.last", at=t.instant(last.at), who=last.who, n=len(report.events))),
    ]


def _signatures(canvas: Paper, report: Report, t: Translator) -> None:
    header = report.header
    gap = 8 * mm
    width = (WIDTH - gap) / 2
    people = (
        (t("sign.operator"), header.get("operator"), header.get("operator_certificate")),
        (t("sign.reviewer"), header.get("reviewer"), None),
    )
    for n, (role, name, certificate) in enumerate(people):
        x = n * (width + gap)
        canvas.setStrokeColor(RULE)
        canvas.setLineWidth(0.6)
        canvas.rect(x, 2 * mm, width, 46 * mm, 1, 0)
        say(canvas, x + 4 * mm, 42 * mm, role, CELL.soft())
        who = shortened(str(name or ""), BODY.bold(), width - 8 * mm)
        say(canvas, x + 4 * mm, 36.5 * mm, who, BODY.bold())
        if certificate:
            text = t("sign.certificate", certificate=certificate)
            said = shortened(text, SMALL, width - 8 * mm)
            say(canvas, x + 4 * mm, 32 * mm, said, SMALL.soft())
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.5)
        for label, left, right in (
            (t("sign.signature"), 4 * mm, width - 32 * mm),
            (t("sign.date"), width - 28 * mm, width - 4 * mm),
        ):
            canvas.line(x + left, 11 * mm, x + right, 11 * mm)
            say(canvas, x + left, 7 * mm, label, SMALL.soft())
