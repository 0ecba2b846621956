"""The table of all observations, whole: its rows go on over pages."""

from __future__ import annotations

from reportlab.lib.units import mm
from reportlab.platypus import CondPageBreak, Flowable, PageBreak

from app.reports.content.telling import Teller
from app.reports.pdf.flow import Badge, Cell, Column, Grid, Heading, Prose, note
from app.reports.pdf.styles import CELL
from app.reports.pdf.text import one_line
from app.reports.report import Entry, Report

_LONG, _SHOWN = 500, 250
"""Remarks with more characters are in full behind the table, of which this many are in it."""


def observations(report: Report, tell: Teller) -> list[Flowable]:
    """Every entry, by distance."""
    heading = Heading(tell("observations.title"))
    if not report.entries:
        return [heading, note(tell("observations.none")), PageBreak()]
    columns = (
        Column(tell("entry.no"), 9 * mm, "right"),
        Column(tell("entry.distance"), 25 * mm, "right"),
        Column(tell("entry.joint"), 12 * mm, "centre"),
        Column(tell("entry.code"), 16 * mm),
        Column(tell("entry.what_and_remark"), 53 * mm),
        Column(tell("entry.clock_short"), 14 * mm, "centre"),
        Column(tell("entry.quantity"), 16 * mm, "right"),
        Column(tell("entry.stretch_short"), 10 * mm, "centre"),
        Column(tell("entry.severity_short"), 8 * mm),
        Column(tell("entry.time"), 11 * mm, "right"),
    )
    rows = [_row(entry, tell) for entry in report.entries]
    return [
        heading,
        note(tell("observations.help", reference=reference_of(report, tell), pack=report.pack)),
        Grid(columns, rows),
        *_long_remarks(report, tell),
        PageBreak(),
    ]


def _row(entry: Entry, tell: Teller) -> tuple[Cell, ...]:
    return (
        str(entry.seq),
        tell.short_place(entry),
        "" if entry.joint_no is None else str(entry.joint_no),
        [(tell.code(entry), CELL.bold())],
        [(tell.label(entry), CELL), (_short_remark(entry, tell), CELL.soft())],
        tell.clock(entry),
        [(quantity, CELL) for quantity in tell.quantities(entry)],
        tell.stretch(entry),
        Badge(entry.tag.severity),
        tell.time(entry.time_s),
    )


def _short_remark(entry: Entry, tell: Teller) -> str:
    remark = entry.tag.remark or ""
    if not _is_long(entry):
        return remark
    return tell("observations.goes_on", start=one_line(remark[:_SHOWN]))


def _is_long(entry: Entry) -> bool:
    return len(entry.tag.remark or "") > _LONG


def _long_remarks(report: Report, tell: Teller) -> list[Flowable]:
    """In full, over the width of the page."""
    entries = [entry for entry in report.entries if _is_long(entry)]
    if not entries:
        return []
    texts = [
        Prose([(f"{tell.number_of(entry)} · {tell.place(entry)} · {tell.code(entry)}", CELL.bold()),
               (entry.tag.remark or "", CELL)])
        for entry in entries
    ]  # fmt: skip
    title = tell("observations.remarks")
    return [CondPageBreak(30 * mm), Heading(title, level=1, bookmark=False), *texts]


def reference_of(report: Report, tell: Teller) -> str:
    """What distances are counted from."""
    value = report.header.get("reference_point")
    return str(value) if value else tell("observations.no_reference")
