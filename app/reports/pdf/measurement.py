"""How the distances were measured and corrected, and how reliable they are."""

from __future__ import annotations

from reportlab.lib.units import mm
from reportlab.platypus import CondPageBreak, Flowable

from app.reports.content.measurement import (
    correction_rows,
    counter_rows,
    joint_table,
    result_rows,
    rig_rows,
    video_rows,
)
from app.reports.content.translator import Translator
from app.reports.pdf.flow import Heading, note
from app.reports.pdf.grid import Column, Grid, pairs
from app.reports.pdf.track_charts import along
from app.reports.report import Report
from app.survey.adjustment.adjusted_track import Adjusted


def measurement(report: Report, t: Translator) -> list[Flowable]:
    """Build the page about the measurement."""
    if report.is_unmeasured:
        filename = report.source.filename
        said = note(t("measurement.imported", filename=filename))
        return [Heading(t("measurement.title")), said]
    adjusted = report.adjusted
    return [
        Heading(t("measurement.title")),
        note(t("measurement.method")),
        Heading(t("measurement.result"), level=1, bookmark=False),
        pairs(result_rows(report, t)),
        *along(report, t),
        Heading(t("measurement.corrections"), level=1, bookmark=False),
        pairs(correction_rows(report, t)),
        *(_residuals(adjusted, t) if adjusted else ()),
        *_counter(report, t),
        CondPageBreak(45 * mm),
        Heading(t("measurement.rig"), level=1, bookmark=False),
        pairs(rig_rows(report, t)),
        CondPageBreak(45 * mm),
        Heading(t("measurement.video"), level=1, bookmark=False),
        pairs(video_rows(report, t)),
    ]


def _residuals(adjusted: Adjusted, t: Translator) -> list[Flowable]:
    """Build the residuals of every joint that was used."""
    if not adjusted.evidence:
        return []
    heads, rows = joint_table(adjusted.evidence, t)
    columns = [
        Column(head, width * mm, "right" if n else "left")
        for n, (head, width) in enumerate(zip(heads, (18, 40, 34, 28, 54), strict=True))
    ]
    return [Grid(columns, rows)]


def _counter(report: Report, t: Translator) -> list[Flowable]:
    rows = counter_rows(report, t)
    if not rows:
        return []
    heading = Heading(t("measurement.counter"), level=1, bookmark=False)
    return [CondPageBreak(35 * mm), heading, pairs(rows)]
