"""The act-now sheet: one page for the person who must close the road tonight."""

from __future__ import annotations

from reportlab.lib.units import mm

from app.reports.content.condition import urgent
from app.reports.content.translator import NOTHING, Translator
from app.reports.pdf.flow import Figure, draw_badge, say
from app.reports.pdf.glyphs import missing_glyphs
from app.reports.pdf.pages import made
from app.reports.pdf.paper import Paper
from app.reports.pdf.photos import draw_photo, photo_alt
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
from app.reports.pdf.text import lines_of, shortened
from app.reports.report import Entry, Report, Written

_HEIGHT = HEIGHT - 1
"""Height of the sheet, a point less than the page, so that rounding starts no second page."""
_PHOTO = (92 * mm, 69 * mm)
_LIST = 4
_REMARK_LINES = 5


def write(report: Report) -> Written:
    """Write one page about every entry of severity 5: the first with photo, the others listed."""
    t, entries = Translator.of(report), urgent(report)
    sheet = Figure(_HEIGHT, lambda canvas: _sheet(canvas, report, entries, t))
    return Written(made(report, t, _title(entries, t), [sheet]), missing_glyphs(report))


def _title(entries: list[Entry], t: Translator) -> str:
    """Return a calm title where there is no emergency."""
    return t("emergency.title" if entries else "emergency.calm")


def _sheet(canvas: Paper, report: Report, entries: list[Entry], t: Translator) -> None:
    y = _HEIGHT - 18 * mm
    ground, ink = (ALARM, WASH) if entries else (WASH, INK)
    canvas.setFillColor(ground)
    canvas.rect(0, y, WIDTH, 18 * mm, 0, 1)
    style = TITLE.on(ink)
    title = shortened(_title(entries, t), style, 110 * mm)
    say(canvas, 5 * mm, y + 5.6 * mm, title, style, kind="H1")
    said = t("emergency.made", at=t.instant(report.made_at))
    say(canvas, WIDTH - 5 * mm, y + 7 * mm, said, BODY.on(ink), "right")
    y = _facts(canvas, y - 9 * mm, _where(report, t), 0, WIDTH)
    if not entries:
        say(canvas, 0, y - 8 * mm, t("emergency.none"), SUBHEADING.on(INK))
        return
    y -= 4 * mm
    _rule(canvas, y)
    y = _first(canvas, y - 8 * mm, entries[0], t)
    _others(canvas, y - 4 * mm, entries[1:], t)
    _sign(canvas, report, t)


def _where(report: Report, t: Translator) -> list[tuple[str, str]]:
    header = report.header
    nodes = [str(header.get(name) or NOTHING) for name in ("start_node", "end_node")]
    road = " · ".join(
        str(header[name]) for name in ("road", "road_chainage", "location_text") if header.get(name)
    )
    return [
        (t("emergency.asset"), report.asset),
        (t("emergency.road"), road or NOTHING),
        (t("cover.nodes"), t("cover.from_to", start=nodes[0], end=nodes[1])),
        (t("cover.client"), str(header.get("client") or NOTHING)),
    ]


def _first(canvas: Paper, y: float, entry: Entry, t: Translator) -> float:
    """Draw the worst entry with all that is known; return its lower end."""
    with canvas.element("P"):
        draw_badge(canvas, 0, y - 0.6 * mm, entry.tag.severity)
    title = f"{t.label(entry)} ({t.code(entry)})"
    style = SUBHEADING.on(INK)
    say(canvas, 6.5 * mm, y, shortened(title, style, WIDTH - 7 * mm), style)
    big = Style(19, 24, 600, ALARM)
    say(canvas, 0, y - 11 * mm, shortened(t.place(entry), big, WIDTH), big)
    y -= 17 * mm
    width, height = _PHOTO
    alt = photo_alt(entry, entry.photo, t)
    draw_photo(canvas, entry.photo, 0, y - height, width, height, t, alt=alt)
    place = NOTHING if entry.lat is None else f"{entry.lat:.6f}, {entry.lon:.6f}"
    rows = [
        (t("entry.no"), str(entry.number)),
        (t("entry.joint"), NOTHING if entry.joint_no is None else str(entry.joint_no)),
        (t("entry.clock_long"), t.clock_in_words(entry) or NOTHING),
        (t("entry.quantity"), ", ".join(t.quantities(entry)) or NOTHING),
        *([(t("entry.measured"), "; ".join(sizes))] if (sizes := t.sizes(entry)) else []),
        (t("emergency.coordinates"), place),
        (t("emergency.to_go"), t.length(entry.to_go_m)),
        (t("emergency.tagged_by"), entry.tagged_by),
        (t("emergency.tagged_at"), t.instant(entry.tagged_at)),
        (t("entry.time"), t.time(entry.time_s) or NOTHING),
    ]
    if entry.photo and entry.photo.taken:
        rows.append((t("sheet.photo"), t.place_in_photo(entry, entry.photo.taken)))
    _facts(canvas, y - 4 * mm, rows, width + 6 * mm, WIDTH)
    y -= height + 7 * mm
    advice = entry.tag.recommendation
    texts = (entry.tag.remark, f"{t('sheet.recommendation')}: {advice}" if advice else None)
    lines = [line for text in texts if text for line in lines_of(text, BODY, WIDTH)]
    for line in lines[:_REMARK_LINES]:
        say(canvas, 0, y, line.text, line.style)
        y -= line.style.leading
    if len(lines) > _REMARK_LINES:
        say(canvas, 0, y, t("emergency.remark_goes_on"), CELL.soft())
        y -= CELL.leading
    return y


def _others(canvas: Paper, y: float, entries: list[Entry], t: Translator) -> None:
    if not entries:
        return
    _rule(canvas, y + 3 * mm)
    say(canvas, 0, y - 3 * mm, t("emergency.others"), SUBHEADING)
    y -= 9 * mm
    for entry in entries[:_LIST]:
        with canvas.element("P"):
            draw_badge(canvas, 0, y - 0.7 * mm, entry.tag.severity)
        text = f"{t.place(entry)} · {t.code(entry)}"
        say(canvas, 6.5 * mm, y, shortened(text, CELL.bold(), 58 * mm), CELL.bold())
        label = " · ".join(p for p in (t.label(entry), t.clock_in_words(entry)) if p)
        say(canvas, 66 * mm, y, shortened(label, CELL, WIDTH - 66 * mm), CELL)
        y -= 5.4 * mm
    if len(entries) > _LIST:
        say(canvas, 6.5 * mm, y, t("emergency.more", n=len(entries) - _LIST), CELL.soft())


def _sign(canvas: Paper, report: Report, t: Translator) -> None:
    for name, left, right in (("reported_to", 0.0, 52 * mm), ("at", 56 * mm, 92 * mm),
                              ("done", 96 * mm, WIDTH)):  # fmt: skip
        say(canvas, left, 17 * mm, t(f"emergency.{name}"), SMALL.soft())
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.5)
        canvas.line(left, 21 * mm, right, 21 * mm)
    _rule(canvas, 12 * mm)
    who = str(report.header.get("operator") or NOTHING)
    company = report.company.name or ""
    say(canvas, 0, 7 * mm, shortened(t("emergency.from", who=who), BODY, 90 * mm), BODY)
    say(canvas, WIDTH, 7 * mm, shortened(company, BODY.bold(), 80 * mm), BODY.bold(), "right")
    note = shortened(t("condition.not_a_grade"), CELL, WIDTH)
    say(canvas, 0, 1.5 * mm, note, CELL.soft())


def _facts(
    canvas: Paper, y: float, rows: list[tuple[str, str]], left: float, right: float
) -> float:
    """Draw names and values below each other; return the last baseline."""
    for n, (name, value) in enumerate(rows):
        if n:
            y -= 6.2 * mm
        say(canvas, left, y, shortened(name, CELL, 28 * mm), CELL.soft())
        at = left + 29 * mm
        say(canvas, at, y, shortened(value, BODY.bold(), right - at), BODY.bold())
    return y


def _rule(canvas: Paper, y: float) -> None:
    canvas.setStrokeColor(RULE)
    canvas.setLineWidth(0.6)
    canvas.line(0, y, WIDTH, y)
