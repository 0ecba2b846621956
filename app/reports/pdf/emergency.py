"""The act-now sheet: one page for whoever has to close the road tonight."""

from __future__ import annotations

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

from app.reports.content.condition import urgent
from app.reports.content.telling import NOTHING, Teller
from app.reports.pdf.flow import Figure, draw_badge
from app.reports.pdf.pages import made
from app.reports.pdf.photos import draw_photo
from app.reports.pdf.styles import (
    ALARM,
    BODY,
    CELL,
    HEIGHT,
    INK,
    RULE,
    SMALL,
    SUBHEADING,
    TITLE,
    WASH,
    WIDTH,
    Style,
)
from app.reports.pdf.text import draw, lines_of, shortened
from app.reports.report import Entry, Report, Written

_HEIGHT = HEIGHT - 1
"""Rounding must not begin a second page."""
_PHOTO = (92 * mm, 69 * mm)
_LIST = 4
_REMARK_LINES = 5


def write(report: Report) -> Written:
    """One page about every entry of severity 5: the first of them with photo, the others listed."""
    tell, entries = Teller.of(report), urgent(report)
    sheet = Figure(_HEIGHT, lambda canvas: _sheet(canvas, report, entries, tell))
    return Written(made(report, tell, _title(entries, tell), [sheet]))


def _title(entries: list[Entry], tell: Teller) -> str:
    """No alarm where there is none."""
    return tell("emergency.title" if entries else "emergency.calm")


def _sheet(canvas: Canvas, report: Report, entries: list[Entry], tell: Teller) -> None:
    y = _HEIGHT - 18 * mm
    ground, ink = (ALARM, WASH) if entries else (WASH, INK)
    canvas.setFillColor(ground)
    canvas.rect(0, y, WIDTH, 18 * mm, 0, 1)
    style = TITLE.on(ink)
    title = shortened(_title(entries, tell), style, 110 * mm)
    draw(canvas, 5 * mm, y + 5.6 * mm, title, style)
    said = tell("emergency.made", at=tell.instant(report.made_at))
    draw(canvas, WIDTH - 5 * mm, y + 7 * mm, said, BODY.on(ink), "right")
    y = _facts(canvas, y - 9 * mm, _where(report, tell), 0, WIDTH)
    if not entries:
        draw(canvas, 0, y - 8 * mm, tell("emergency.none"), SUBHEADING.on(INK))
        return
    y -= 4 * mm
    _rule(canvas, y)
    y = _first(canvas, y - 8 * mm, entries[0], tell)
    _others(canvas, y - 4 * mm, entries[1:], tell)
    _sign(canvas, report, tell)


def _where(report: Report, tell: Teller) -> list[tuple[str, str]]:
    header = report.header
    nodes = [str(header.get(name) or NOTHING) for name in ("start_node", "end_node")]
    road = " · ".join(
        str(header[name]) for name in ("road", "road_chainage", "location_text") if header.get(name)
    )
    return [
        (tell("emergency.asset"), report.asset),
        (tell("emergency.road"), road or NOTHING),
        (tell("cover.nodes"), tell("cover.from_to", start=nodes[0], end=nodes[1])),
        (tell("cover.client"), str(header.get("client") or NOTHING)),
    ]


def _first(canvas: Canvas, y: float, entry: Entry, tell: Teller) -> float:
    """The worst one, with all that is known of it; returns where it ends."""
    draw_badge(canvas, 0, y - 0.6 * mm, entry.tag.severity)
    title = f"{tell.label(entry)} ({tell.code(entry)})"
    style = SUBHEADING.on(INK)
    draw(canvas, 6.5 * mm, y, shortened(title, style, WIDTH - 7 * mm), style)
    big = Style(19, 24, 600, ALARM)
    draw(canvas, 0, y - 11 * mm, shortened(tell.place(entry), big, WIDTH), big)
    y -= 17 * mm
    width, height = _PHOTO
    draw_photo(canvas, entry.photo, 0, y - height, width, height, tell)
    place = NOTHING if entry.lat is None else f"{entry.lat:.6f}, {entry.lon:.6f}"
    rows = [
        (tell("entry.no"), str(entry.seq)),
        (tell("entry.joint"), NOTHING if entry.joint_no is None else str(entry.joint_no)),
        (tell("entry.clock_long"), tell.clock_in_words(entry) or NOTHING),
        (tell("entry.quantity"), ", ".join(tell.quantities(entry)) or NOTHING),
        (tell("emergency.coordinates"), place),
        (tell("emergency.to_go"), tell.length(entry.to_go_m)),
        (tell("emergency.tagged_by"), entry.tagged_by),
        (tell("emergency.tagged_at"), tell.instant(entry.tagged_at)),
        (tell("entry.time"), tell.time(entry.time_s) or NOTHING),
    ]
    _facts(canvas, y - 4 * mm, rows, width + 6 * mm, WIDTH)
    y -= height + 7 * mm
    lines = lines_of(entry.tag.remark or "", BODY, WIDTH)
    for line in lines[:_REMARK_LINES]:
        draw(canvas, 0, y, line.text, line.style)
        y -= line.style.leading
    if len(lines) > _REMARK_LINES:
        draw(canvas, 0, y, tell("emergency.remark_goes_on"), CELL.soft())
        y -= CELL.leading
    return y


def _others(canvas: Canvas, y: float, entries: list[Entry], tell: Teller) -> None:
    if not entries:
        return
    _rule(canvas, y + 3 * mm)
    draw(canvas, 0, y - 3 * mm, tell("emergency.others"), SUBHEADING)
    y -= 9 * mm
    for entry in entries[:_LIST]:
        draw_badge(canvas, 0, y - 0.7 * mm, entry.tag.severity)
        text = f"{tell.place(entry)} · {tell.code(entry)}"
        draw(canvas, 6.5 * mm, y, shortened(text, CELL.bold(), 58 * mm), CELL.bold())
        label = " · ".join(p for p in (tell.label(entry), tell.clock_in_words(entry)) if p)
        draw(canvas, 66 * mm, y, shortened(label, CELL, WIDTH - 66 * mm), CELL)
        y -= 5.4 * mm
    if len(entries) > _LIST:
        draw(canvas, 6.5 * mm, y, tell("emergency.more", n=len(entries) - _LIST), CELL.soft())


def _sign(canvas: Canvas, report: Report, tell: Teller) -> None:
    for name, left, right in (("told", 0.0, 52 * mm), ("at", 56 * mm, 92 * mm),
                              ("done", 96 * mm, WIDTH)):  # fmt: skip
        draw(canvas, left, 17 * mm, tell(f"emergency.{name}"), SMALL.soft())
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.5)
        canvas.line(left, 21 * mm, right, 21 * mm)
    _rule(canvas, 12 * mm)
    who = str(report.header.get("operator") or NOTHING)
    company = report.company.name or ""
    draw(canvas, 0, 7 * mm, shortened(tell("emergency.from", who=who), BODY, 90 * mm), BODY)
    draw(canvas, WIDTH, 7 * mm, shortened(company, BODY.bold(), 80 * mm), BODY.bold(), "right")
    note = shortened(tell("condition.not_a_grade"), CELL, WIDTH)
    draw(canvas, 0, 1.5 * mm, note, CELL.soft())


def _facts(
    canvas: Canvas, y: float, rows: list[tuple[str, str]], left: float, right: float
) -> float:
    """Names and values below each other; returns the last baseline."""
    for n, (name, value) in enumerate(rows):
        if n:
            y -= 6.2 * mm
        draw(canvas, left, y, shortened(name, CELL, 28 * mm), CELL.soft())
        at = left + 29 * mm
        draw(canvas, at, y, shortened(value, BODY.bold(), right - at), BODY.bold())
    return y


def _rule(canvas: Canvas, y: float) -> None:
    canvas.setStrokeColor(RULE)
    canvas.setLineWidth(0.6)
    canvas.line(0, y, WIDTH, y)
