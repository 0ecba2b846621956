"""Six photos a page, with captions that state defect and place."""

from __future__ import annotations

from collections.abc import Sequence

from reportlab.lib.colors import HexColor
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable, PageBreak

from app.reports.content.sizes import Outline, outlines
from app.reports.content.translator import Translator
from app.reports.pdf.flow import BADGE, Figure, Heading, batches, draw_badge, note
from app.reports.pdf.pictures import jpeg_of
from app.reports.pdf.styles import CELL, RULE, SMALL, WASH, WIDTH
from app.reports.pdf.text import draw, lines_of, shortened
from app.reports.report import Entry, Photo, Report

ENOUGH_PX = 800
"""Pixels for 250 dpi in print."""

_HALO, _SIZE = HexColor(0x080A0C), HexColor(0x5FF2E0)
"""Colours of measures, as on the page."""

_GAP = 8 * mm
_WIDTH = (WIDTH - _GAP) / 2
_PICTURE = 56 * mm
_CAPTION = 17 * mm


def photos(report: Report, t: Translator) -> list[Flowable]:
    """Build pages of photos in the order of the table."""
    shown = [
        (entry, photo, outlines(entry, photo, report.source.video))
        for entry in report.entries
        for photo in entry.photos
        if photo.jpeg
    ]
    if not shown:
        return [Heading(t("photos.title")), note(t("photos.none")), PageBreak()]
    parts: list[Flowable] = []
    for number, page in enumerate(batches(shown, 6)):
        title = t("photos.title")
        if number:
            title = t("graphic.continued", title=title)
        parts.append(Heading(title, bookmark=number == 0))
        parts += [_pair(pair, t) for pair in batches(page, 2)]
        parts.append(PageBreak())
    return parts


def _pair(pair: tuple[tuple[Entry, Photo, list[Outline]], ...], t: Translator) -> Figure:
    def paint(canvas: Canvas) -> None:
        for n, (entry, photo, lines) in enumerate(pair):
            x = n * (_WIDTH + _GAP)
            draw_photo(canvas, photo, x, _CAPTION, _WIDTH, _PICTURE, t, lines)
            _caption(canvas, entry, photo, x, t)

    return Figure(_PICTURE + _CAPTION + 1.5 * mm, paint)


def draw_photo(
    canvas: Canvas,
    photo: Photo | None,
    x: float,
    y: float,
    width: float,
    height: float,
    t: Translator,
    lines: Sequence[Outline] = (),
) -> None:
    """Draw the picture as large as the field allows, with what was measured on it; without one,
    the field says so.
    """
    canvas.setFillColor(WASH)
    canvas.rect(x, y, width, height, 0, 1)
    jpeg = photo.shown if photo else None
    picture = jpeg_of(jpeg, ENOUGH_PX) if jpeg else None
    if picture is not None:
        px_wide, px_high = picture.size
        scale = min(width / px_wide, height / px_high)
        shown_w, shown_h = px_wide * scale, px_high * scale
        left, bottom = x + (width - shown_w) / 2, y + (height - shown_h) / 2
        canvas.drawImage(picture, left, bottom, shown_w, shown_h)
        for line in lines:
            _draw_outline(
                canvas,
                [
                    (left + across * shown_w, bottom + (1 - down) * shown_h)
                    for across, down in line.points
                ],
                is_closed=line.is_closed,
            )
        return
    canvas.setStrokeColor(RULE)
    canvas.setLineWidth(0.6)
    canvas.rect(x, y, width, height, 1, 0)
    if photo is None:
        reason = t("photos.no_photo")
    else:
        is_there = jpeg is not None and jpeg.exists()
        reason = t("photos.broken" if is_there else "photos.missing", name=photo.name)
    sentence = lines_of(reason, CELL.bold(), width - 10 * mm)
    top = y + height / 2 + (len(sentence) / 2 - 1) * CELL.leading + 2
    for n, row in enumerate(sentence):
        draw(canvas, x + width / 2, top - n * CELL.leading, row.text, row.style, "centre")


def _draw_outline(
    canvas: Canvas, points: Sequence[tuple[float, float]], *, is_closed: bool
) -> None:
    canvas.saveState()
    canvas.setLineJoin(1)
    for width_pt, colour in ((2.4, _HALO), (1.1, _SIZE)):
        canvas.setLineWidth(width_pt)
        canvas.setStrokeColor(colour)
        path = canvas.beginPath()
        path.moveTo(*points[0])
        for point in points[1:]:
            path.lineTo(*point)
        if is_closed:
            path.close()
        canvas.drawPath(path)
    canvas.restoreState()


def _caption(canvas: Canvas, entry: Entry, photo: Photo, x: float, t: Translator) -> None:
    y = _CAPTION - 4.6 * mm
    draw_badge(canvas, x, y - 0.8 * mm, entry.tag.severity)
    indent = BADGE + 1.6 * mm if entry.tag.severity is not None else 0
    first = t("photos.caption", seq=entry.seq, place=t.place(entry), code=t.code(entry))
    style = CELL.bold()
    draw(canvas, x + indent, y, shortened(first, style, _WIDTH - indent), style)
    label = t.label(entry)
    draw(canvas, x, y - 3.7 * mm, shortened(label, CELL, _WIDTH), CELL)
    clock = t.clock_in_words(entry)
    details = [*t.sizes(entry), clock, t.time(entry.time_s), photo.name]
    line = " · ".join(part for part in details if part)
    draw(canvas, x, y - 7.1 * mm, shortened(line, SMALL, _WIDTH), SMALL.soft())
