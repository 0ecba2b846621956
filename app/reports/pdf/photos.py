"""Two photos beside each other, with captions that state defect and place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from reportlab.lib.colors import HexColor
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable

from app.reports.content.pictures import jpeg_of, why_not_shown
from app.reports.content.shown_photos import ShownPhoto, shown_photos
from app.reports.content.sizes import Outline
from app.reports.content.translator import Translator
from app.reports.pdf.flow import (
    BADGE,
    Figure,
    Heading,
    batches,
    draw_badge,
    note,
    say,
    say_linked,
)
from app.reports.pdf.links import place_of_photo, row_of
from app.reports.pdf.paper import Paper
from app.reports.pdf.styles import CELL, LINK, RULE, SMALL, WASH, WIDTH
from app.reports.pdf.text import draw, lines_of, shortened, width_of
from app.reports.report import Entry, Photo, Report

ENOUGH_PX = 800
"""Pixels for 250 dpi in print."""

_HALO, _SIZE = HexColor(0x080A0C), HexColor(0x5FF2E0)
"""Colours of measures, as on the page."""

_GAP = 8 * mm
_WIDTH = (WIDTH - _GAP) / 2
_PICTURE = 56 * mm
_CAPTION = 15.5 * mm
"""Height of the caption of one observation."""
_LINE = 3.9 * mm
_MOST_CAPTIONS = 12


def photos(report: Report, t: Translator) -> list[Flowable]:
    """Build the photos in the order of the table; each is shown once, for all that it shows."""
    shown = shown_photos(report)
    if not shown:
        return [Heading(t("photos.title")), note(t("photos.none"))]
    named: set[str] = set()
    parts: list[Flowable] = [Heading(t("photos.title"))]
    for pair in batches(shown, 2):
        places = [
            [place for entry, _ in photo.captions if (place := place_of_photo(entry)) not in named]
            for photo in pair
        ]
        named.update(*places)
        parts.append(_pair(report, pair, places, t))
    return parts


def _pair(
    report: Report, pair: Sequence[ShownPhoto], places: list[list[str]], t: Translator
) -> Figure:
    captions = max(_caption_height(photo) for photo in pair)

    def paint(paper: Paper) -> None:
        for n, (photo, names) in enumerate(zip(pair, places, strict=True)):
            x = n * (_WIDTH + _GAP)
            for name in names:
                paper.place(name, x, captions + _PICTURE)
            draw_photo(
                paper, photo.photo, x, captions, _WIDTH, _PICTURE, t, photo.lines,
                alt=_alt(photo, t),
            )  # fmt: skip
            (_caption if len(photo.captions) == 1 else _captions)(
                paper, report, photo, x, captions - 4.6 * mm, t
            )

    return Figure(_PICTURE + captions + 1.5 * mm, paint)


def _caption_height(photo: ShownPhoto) -> float:
    rows = len(photo.captions)
    return _CAPTION if rows == 1 else _CAPTION + (min(rows, _MOST_CAPTIONS + 1) - 2) * _LINE


def photo_alt(entry: Entry, photo: Photo | None, t: Translator) -> str:
    """Say what a photo shows: defect, place and clock position."""
    place = t.place_in_photo(entry, photo.taken if photo else None)
    parts = (f"{t.code(entry)} {t.label(entry)}", place, t.clock_in_words(entry))
    return t("alt.photo", seq=entry.number, shown=", ".join(part for part in parts if part))


def _alt(photo: ShownPhoto, t: Translator) -> str:
    return " ".join(photo_alt(entry, own, t) for entry, own in photo.captions[:_MOST_CAPTIONS])


def draw_photo(
    canvas: Paper,
    photo: Photo | None,
    x: float,
    y: float,
    width: float,
    height: float,
    t: Translator,
    lines: Sequence[Outline] = (),
    *,
    alt: str,
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
        with canvas.figure(alt, (left, bottom, left + shown_w, bottom + shown_h)):
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
    reason = t(why_not_shown(photo), name=photo.name) if photo else t("photos.no_photo")
    sentence = lines_of(reason, CELL.bold(), width - 10 * mm)
    top = y + height / 2 + (len(sentence) / 2 - 1) * CELL.leading + 2
    with canvas.element("P"):
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


def _caption(
    paper: Paper, report: Report, photo: ShownPhoto, x: float, y: float, t: Translator
) -> None:
    """Write what the photo of one observation shows."""
    ((entry, own),) = photo.captions
    _first_line(paper, report, entry, own, x, y, t)
    say(paper, x, y - 3.7 * mm, shortened(t.label(entry), CELL, _WIDTH), CELL)
    details = (*t.sizes(entry), t.clock_in_words(entry), own.name)
    _last_line(paper, report, own.time_s(entry), details, x, y - 7.1 * mm, t)


def _captions(
    paper: Paper, report: Report, photo: ShownPhoto, x: float, y: float, t: Translator
) -> None:
    """Write a line for each observation of a photo."""
    for entry, own in photo.captions[:_MOST_CAPTIONS]:
        _first_line(paper, report, entry, own, x, y, t, t.label(entry))
        y -= _LINE
    if rest := photo.captions[_MOST_CAPTIONS:]:
        say(paper, x, y, t("photos.more", n=len(rest)), CELL.soft())
        y -= _LINE
    entry, own = photo.captions[0]
    _last_line(paper, report, own.time_s(entry), (own.name,), x, y + 0.4 * mm, t)


def _first_line(
    paper: Paper,
    report: Report,
    entry: Entry,
    photo: Photo,
    x: float,
    y: float,
    t: Translator,
    label: str = "",
) -> None:
    """Write number, place and code; they link to the row in the table."""
    if entry.tag.severity is not None:
        with paper.element("P"):
            draw_badge(paper, x, y - 0.8 * mm, entry.tag.severity)
        x += BADGE + 1.6 * mm
    room = _WIDTH - BADGE - 1.6 * mm
    place = t.place_in_photo(entry, photo.taken)
    text = t("photos.caption", seq=entry.number, place=place, code=t.code(entry))
    text = shortened(text, LINK, room)
    if "observations" in report.template.sections:
        link = partial(paper.link, row_of(entry), t("alt.to_row", seq=entry.number))
        say_linked(paper, x, y, text, LINK, link)
    else:
        say(paper, x, y, text, CELL.bold())
    left = width_of(text, LINK) + 1.6 * mm
    if label and room - left > 8 * mm:
        say(paper, x + left, y, shortened(label, CELL, room - left), CELL)


def _last_line(
    paper: Paper,
    report: Report,
    time_s: float | None,
    details: Sequence[str],
    x: float,
    y: float,
    t: Translator,
) -> None:
    """Write details in small letters, after the time, which links to the film."""
    time, film = t.time(time_s), report.film_at(time_s)
    texts = [*([time] if time and film is None else []), *details]
    line = " · ".join(text for text in texts if text)
    if film is not None:
        style = replace(LINK, size=SMALL.size)
        link = partial(paper.link_out, film, t("alt.to_film", time=time))
        say_linked(paper, x, y, time, style, link)
        x += width_of(time, style)
        line = f" · {line}"
        say(paper, x, y, shortened(line, SMALL, _WIDTH - width_of(time, style)), SMALL.soft())
        return
    say(paper, x, y, shortened(line, SMALL, _WIDTH), SMALL.soft())
