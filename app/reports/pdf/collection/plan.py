"""The plan sketch, with a scale bar and a north arrow."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable, PageBreak, Spacer

from app.reports.collection.collected import Collected
from app.reports.collection.plan import Plan, plan_of
from app.reports.content.translator import Translator
from app.reports.pdf.flow import Figure, Heading, note
from app.reports.pdf.styles import ACCENT, INK, RULE, SEVERITY, SMALL, WASH, WIDTH
from app.reports.pdf.text import draw, shortened
from app.reports.report import Units

_HEIGHT_MM = 190.0
_EDGE_MM = 10.0
"""Margin within the frame, so that labels fit."""
_FOOT_MM = 14.0
"""Room for the scale bar below the sketch."""
_MARK_MM = 1.1
_LABEL_MM = 38.0
"""Longest label."""
_FEET = 0.3048


def plan(inspections: Sequence[Collected], t: Translator) -> list[Flowable]:
    """Build the sketch, and the list of inspections without coordinates."""
    width_mm = WIDTH / mm - 2 * _EDGE_MM
    sketch = plan_of(inspections, width_mm, _HEIGHT_MM - 2 * _EDGE_MM - _FOOT_MM)
    parts: list[Flowable] = [Heading(t("collection.plan"))]
    if sketch.runs:
        alt = t(
            "collection.plan_alt",
            n=len(sketch.runs),
            scale=_scale(sketch),
            names="; ".join(f"{run.one.number} {run.one.asset}" for run in sketch.runs),
        )
        parts += [
            note(t("collection.plan_note", n=len(sketch.runs), scale=_scale(sketch))),
            Figure(_HEIGHT_MM * mm, partial(_paint, sketch=sketch, units=t.units, t=t), alt=alt),
            Spacer(0, 3 * mm),
        ]
    else:
        parts.append(note(t("collection.no_plan")))
    if sketch.unplaced:
        names = ", ".join(f"{one.number} {one.asset}" for one in sketch.unplaced)
        parts.append(note(t("collection.unplaced", names=names)))
    return [*parts, PageBreak()]


def _scale(sketch: Plan) -> str:
    return f"1 : {sketch.scale:,.0f}".replace(",", "\u202f")


def _paint(canvas: Canvas, sketch: Plan, units: Units, t: Translator) -> None:
    canvas.setStrokeColor(RULE)
    canvas.setLineWidth(0.5)
    canvas.rect(0, 0, WIDTH, _HEIGHT_MM * mm, 1, 0)
    left, below = _EDGE_MM * mm, (_EDGE_MM + _FOOT_MM) * mm
    canvas.saveState()
    canvas.translate(left, below)
    for run in sketch.runs:
        (x0, y0), (x1, y1) = run.start, run.end
        canvas.setStrokeColor(ACCENT)
        canvas.setLineWidth(1.4)
        canvas.line(x0 * mm, y0 * mm, x1 * mm, y1 * mm)
        worst = run.one.worst
        canvas.setFillColor(WASH if worst is None else SEVERITY.get(worst, WASH))
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.4)
        canvas.circle(run.middle[0] * mm, run.middle[1] * mm, _MARK_MM * mm, 1, 1)
    for label in sketch.labels:
        x, y = label.at
        is_right = x > WIDTH / mm * 0.75
        at_x = x - _MARK_MM - 0.8 if is_right else x + _MARK_MM + 0.8
        text = shortened(label.text, SMALL.bold(), _LABEL_MM * mm)
        draw(canvas, at_x * mm, (y + 0.9) * mm, text, SMALL.bold(),
             "right" if is_right else "left")  # fmt: skip
    canvas.restoreState()
    _bar(canvas, sketch, units)
    _north(canvas, t)


def _bar(canvas: Canvas, sketch: Plan, units: Units) -> None:
    x, y = _EDGE_MM * mm, 9 * mm
    half = sketch.bar_mm * mm / 2
    canvas.setStrokeColor(INK)
    canvas.setLineWidth(0.5)
    for part, colour in enumerate((INK, WASH)):
        canvas.setFillColor(colour)
        canvas.rect(x + part * half, y, half, 1.6 * mm, 1, 1)
    draw(canvas, x, y + 3 * mm, "0", SMALL, "centre")
    draw(canvas, x + 2 * half, y + 3 * mm, _length(sketch.bar_m, units), SMALL, "centre")
    draw(canvas, x, y - 4 * mm, _scale(sketch), SMALL.soft())


def _length(length_m: float, units: Units) -> str:
    if units == "ft":
        return f"{length_m:g} m ({length_m / _FEET:,.0f} ft)"
    return f"{length_m / 1000:g} km" if length_m >= 1000 else f"{length_m:g} m"


def _north(canvas: Canvas, t: Translator) -> None:
    x, y = WIDTH - 8 * mm, 6 * mm
    path = canvas.beginPath()
    path.moveTo(x, y + 9 * mm)
    for dx, dy in ((2.4, 0), (0, 1.8), (-2.4, 0)):
        path.lineTo(x + dx * mm, y + dy * mm)
    path.close()
    canvas.setFillColor(INK)
    canvas.drawPath(path, 0, 1)
    draw(canvas, x, y + 10 * mm, t("collection.north"), SMALL.bold(), "centre")
