"""The header of the survey, field by field, with a plan sketch of both ends."""

from __future__ import annotations

import math

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import CondPageBreak, Flowable

from app.reports.content.header import GROUPS, header_row
from app.reports.content.translator import NOTHING, Translator
from app.reports.pdf.flow import Figure, Heading, note
from app.reports.pdf.grid import Column, Grid, pairs
from app.reports.pdf.styles import (
    ACCENT,
    BODY,
    CELL,
    INK,
    RULE,
    SMALL,
    TINY,
    WASH,
    WIDTH,
)
from app.reports.pdf.text import draw, shortened
from app.reports.report import Report
from app.survey.fields.header import is_empty, required_to_issue


def header_sheet(report: Report, t: Translator) -> list[Flowable]:
    """Build plan and fields; empty required fields are named."""
    parts: list[Flowable] = [
        Heading(t("header.title")),
        Figure(
            34 * mm,
            lambda canvas: _plan(canvas, report, t),
            alt=t(
                "alt.plan",
                length=t.length(report.distance_m),
                **{
                    end: str(report.header.get(f"{end}_node") or NOTHING)
                    for end in ("start", "end")
                },
            ),
        ),
    ]
    missing = set(required_to_issue(dict(report.header)))
    for group, names in GROUPS:
        rows = [row for name in names if (row := header_row(report, t, name, name in missing))]
        if rows:
            heading = Heading(t(f"header.{group}"), level=1, bookmark=False)
            parts += [CondPageBreak(22 * mm), heading, _two_up(rows)]
    known = {name for _, names in GROUPS for name in names}
    others = [
        (t.field(name), t.value(name, value))
        for name, value in report.header.items()
        if name not in known and not is_empty(value)
    ]
    if others:
        parts += [Heading(t("header.others"), level=1, bookmark=False), pairs(others)]
    if not report.header:
        parts.append(note(t("header.empty")))
    return parts


def _two_up(rows: list[tuple[str, str]]) -> Grid:
    """Build the table; two pairs a row where values are short."""
    if any(len(value) > 45 for _, value in rows):
        return pairs(rows, after=0)
    half = (len(rows) + 1) // 2
    left, right = rows[:half], [*rows[half:], ("", "")][:half]
    columns = tuple(Column("", width * mm, is_head=width == 36) for width in (36, 51, 36, 51))
    cells = [
        ([(a, CELL.soft())], [(b, CELL)], [(c, CELL.soft())], [(d, CELL)])
        for (a, b), (c, d) in zip(left, right, strict=True)
    ]
    return Grid(columns, cells, after=0)


def _plan(canvas: Canvas, report: Report, t: Translator) -> None:
    """Draw both ends, the directions of flow and travel, and north."""
    header = report.header
    left, right, y = 36 * mm, WIDTH - 36 * mm, 17 * mm
    canvas.setFillColor(WASH)
    canvas.rect(0, 1 * mm, WIDTH, 31 * mm, 0, 1)
    canvas.setStrokeColor(INK)
    canvas.setLineWidth(0.8)
    for offset in (-2.4 * mm, 2.4 * mm):
        canvas.line(left, y + offset, right, y + offset)
    for x, sign, end in ((left, -1, "start"), (right, 1, "end")):
        canvas.setFillColor(ACCENT)
        canvas.rect(x - 1.2 * mm, y - 5 * mm, 2.4 * mm, 10 * mm, 0, 1)
        align = "right" if sign < 0 else "left"
        room, at = 30 * mm, x + sign * 4 * mm
        name = str(header.get(f"{end}_node") or NOTHING)
        style = BODY.bold()
        draw(canvas, at, y + 1.2 * mm, shortened(name, style, room), style, align)
        draw(canvas, at, y - 2.6 * mm, t(f"header.plan_{end}"), TINY.soft(), align)
        for n, axis in enumerate(("lat", "lon")):
            value = header.get(f"{end}_{axis}")
            if _is_number(value):
                place = f"{float(value):.6f}° {'NE'[n]}"  # type: ignore[arg-type]
                draw(canvas, at, y - (6 + 2.9 * n) * mm, place, TINY.soft(), align)
    middle = (left + right) / 2
    _arrow(canvas, left + 12 * mm, y + 6.5 * mm, 26 * mm, True)
    draw(canvas, left + 41 * mm, y + 5.6 * mm, t("header.plan_camera"), SMALL)
    direction = header.get("direction")
    if direction in ("with_flow", "against_flow"):
        _arrow(canvas, middle - 13 * mm, y, 26 * mm, direction == "with_flow")
        draw(canvas, middle, y - 6.8 * mm, t("header.plan_flow"), SMALL, "centre")
    length = t("header.plan_length", length=t.length(report.distance_m))
    draw(canvas, middle, y - 11.5 * mm, length, SMALL.bold(), "centre")
    _north(canvas, report, WIDTH - 8 * mm, 25 * mm)


def _arrow(canvas: Canvas, x: float, y: float, length: float, is_forward: bool) -> None:
    start, tip = (x, x + length) if is_forward else (x + length, x)
    back = tip - math.copysign(2.2 * mm, tip - start)
    canvas.setStrokeColor(INK)
    canvas.setFillColor(INK)
    canvas.setLineWidth(0.7)
    canvas.line(start, y, back, y)
    path = canvas.beginPath()
    path.moveTo(tip, y)
    path.lineTo(back, y + 1.1 * mm)
    path.lineTo(back, y - 1.1 * mm)
    path.close()
    canvas.drawPath(path, 0, 1)


def _north(canvas: Canvas, report: Report, x: float, y: float) -> None:
    """Draw north relative to the pipe drawn from left to right; only where both ends are known."""
    values = [
        report.header.get(f"{end}_{axis}") for end in ("start", "end") for axis in ("lat", "lon")
    ]
    if not all(map(_is_number, values)):
        return
    lat, lon, end_lat, end_lon = (float(value) for value in values)  # type: ignore[arg-type]
    east, north = (end_lon - lon) * math.cos(math.radians(lat)), end_lat - lat
    if math.hypot(east, north) < 1e-9:
        return
    canvas.saveState()
    canvas.translate(x, y)
    canvas.rotate(-math.degrees(math.atan2(north, east)))
    canvas.setStrokeColor(RULE)
    canvas.setFillColor(INK)
    canvas.setLineWidth(0.6)
    canvas.line(0, -4 * mm, 0, 4 * mm)
    path = canvas.beginPath()
    path.moveTo(0, 4.5 * mm)
    path.lineTo(1.1 * mm, 1.5 * mm)
    path.lineTo(-1.1 * mm, 1.5 * mm)
    path.close()
    canvas.drawPath(path, 0, 1)
    draw(canvas, 1.6 * mm, 2.2 * mm, "N", TINY)
    canvas.restoreState()


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
