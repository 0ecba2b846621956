"""The complete table of observations, whose rows continue over pages."""

from __future__ import annotations

from reportlab.lib.units import mm
from reportlab.platypus import CondPageBreak, Flowable

from app.reports.content.translator import Translator
from app.reports.content.typesetting import one_line
from app.reports.pdf.flow import Heading, Prose, note
from app.reports.pdf.grid import Badge, Cell, Column, Grid
from app.reports.pdf.links import number_of, row_of
from app.reports.pdf.styles import CELL
from app.reports.report import Entry, Report

_LONG = 500
"""A remark with more characters is printed in full after the table."""
_SHOWN = 250
"""Characters of such a remark that the table shows."""


def observations(report: Report, t: Translator) -> list[Flowable]:
    """Build the table of every entry, by distance."""
    heading = Heading(t("observations.title"))
    if not report.entries:
        return [heading, note(t("observations.none"))]
    columns = (
        Column(t("entry.no"), 9 * mm, "right"),
        Column(t("entry.distance"), 25 * mm, "right"),
        Column(t("entry.joint"), 12 * mm, "centre"),
        Column(t("entry.code"), 16 * mm),
        Column(t("entry.what_and_remark"), 53 * mm),
        Column(t("entry.clock_short"), 14 * mm, "centre"),
        Column(t("entry.quantity"), 16 * mm, "right"),
        Column(t("entry.stretch_short"), 10 * mm, "centre"),
        Column(t("entry.severity_short"), 8 * mm),
        Column(t("entry.time"), 11 * mm, "right"),
    )
    rows = [_row(report, entry, t) for entry in report.entries]
    return [
        heading,
        note(t("observations.help", reference=t.reference(report), pack=report.pack)),
        Grid(columns, rows, places=[row_of(entry) for entry in report.entries]),
        *_long_remarks(report, t),
    ]


def _row(report: Report, entry: Entry, t: Translator) -> tuple[Cell, ...]:
    return (
        number_of(report, entry, t),
        t.short_place(entry),
        "" if entry.joint_no is None else str(entry.joint_no),
        [(t.code(entry), CELL.bold())],
        [
            (t.label(entry), CELL),
            *((size, CELL) for size in t.sizes(entry)),
            (_short_remark(entry, t), CELL.soft()),
        ],
        t.clock(entry),
        [(quantity, CELL) for quantity in t.quantities(entry)],
        t.stretch(entry),
        Badge(entry.tag.severity),
        t.time(entry.time_s),
    )


def _short_remark(entry: Entry, t: Translator) -> str:
    remark = entry.tag.remark or ""
    if not _is_long(entry):
        return remark
    return t("observations.goes_on", start=one_line(remark[:_SHOWN]))


def _is_long(entry: Entry) -> bool:
    return len(entry.tag.remark or "") > _LONG


def _long_remarks(report: Report, t: Translator) -> list[Flowable]:
    """Build the long remarks in full, over the width of the page."""
    entries = [entry for entry in report.entries if _is_long(entry)]
    if not entries:
        return []
    texts = [
        Prose([(f"{t.number_of(entry)} · {t.place(entry)} · {t.code(entry)}", CELL.bold()),
               (entry.tag.remark or "", CELL)])
        for entry in entries
    ]  # fmt: skip
    title = t("observations.remarks")
    return [CondPageBreak(30 * mm), Heading(title, level=1, bookmark=False), *texts]
