"""The first sheet of the workbook, for people: facts of the inspection, then every observation."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from PIL import Image
from xlsxwriter import Workbook
from xlsxwriter.worksheet import Worksheet

from app.reports.content.condition import urgent
from app.reports.content.grades import grade_of
from app.reports.content.recommendations import costs_of
from app.reports.content.shown_photos import photo_alt
from app.reports.content.translator import NOTHING, Translator
from app.reports.drawings.svg import fill_of, ink_on
from app.reports.report import Entry, Photo, Report, says_source
from app.reports.tables.cells import LINE_PT, Cells, fit_on_page, lines_of
from app.reports.text.legible import legible
from app.reports.text.typesetting import one_line
from app.survey.fields.header import project_of

_THUMBNAIL_PX = (160, 120)
"""Room for a thumbnail on the sheet."""
_SHARPNESS = 1.25
"""Pixels of a thumbnail in a pixel of the sheet: readable in print, yet a few kB each."""
_QUALITY = 60
_PHOTO_WIDTH = 23.5
"""Width of the column with the photo, in characters."""
_PX_PT = 0.75
_TALLEST_PT = 409.0
"""Height that a row can have in the programs that read it."""
_HEAD = 6
"""The row with the names of the columns, below the facts."""
_FRAME = {"border": 1, "border_color": "#C2CBD2"}
_SOFT = "#56636E"


@dataclass(frozen=True)
class _Column:
    """A column of the table of observations."""

    title: str
    width: float
    """Characters of the sheet's font, as Excel measures columns."""
    value: Callable[[Entry], str | float | None]
    look: tuple[tuple[str, Any], ...] = ()
    kind: Literal["plain", "severity", "photo", "cost", "time", "source"] = "plain"


def add(book: Workbook, cells: Cells, report: Report, t: Translator) -> None:
    """Add the sheet."""
    sheet = book.add_worksheet(t("sheet.report"))
    columns = _columns(report, t)
    for number, column in enumerate(columns):
        sheet.set_column(number, number, column.width)
    _write_facts(sheet, cells, report, t)
    accent = report.template.accent
    for number, column in enumerate(columns):
        cells.text(
            sheet, _HEAD, number, column.title,
            bold=True, text_wrap=True, font_color="#FFFFFF", bg_color=accent, **_FRAME,
        )  # fmt: skip
    sheet.set_row(_HEAD, 2.4 * LINE_PT)
    for row, entry in enumerate(report.entries, _HEAD + 1):
        _write_entry(sheet, cells, row, entry, columns, report, t)
    last = _HEAD + len(report.entries)
    sheet.autofilter(_HEAD, 0, last, len(columns) - 1)
    sheet.freeze_panes(_HEAD + 1, 2)
    _set_up_print(sheet, report, t, last, len(columns))


def _columns(report: Report, t: Translator) -> Sequence[_Column]:
    places = "0.0" if t.units == "ft" else "0.00"
    centre, wrap, bold = (("align", "center"),), (("text_wrap", True),), (("bold", True),)
    columns = (
        _Column(t("entry.no"), 6, lambda entry: entry.number),
        _Column(t("sheet.distance", unit=t.units), 10, lambda entry: t.cells(entry)[0],
                (("num_format", places), *bold)),
        _Column(t("sheet.half_width", unit=t.units), 8, lambda entry: t.cells(entry)[1],
                (("num_format", f'"±" {places}'),)),
        _Column(t("measurement.sources"), 14,
                lambda entry: t.source(entry.source) if says_source(entry) else None, wrap,
                kind="source"),
        _Column(t("entry.joint"), 7, lambda entry: entry.joint_no, centre),
        _Column(t("entry.code"), 11, t.code, bold),
        _Column(t("entry.what"), 34, t.label, wrap),
        _Column(t("entry.clock_short"), 8, t.clock, centre),
        _Column(t("entry.quantity"), 14, lambda entry: _sizes(entry, t), wrap),
        _Column(t("sheet.stretch"), 9, t.stretch, centre),
        _Column(t("sheet.severity"), 15, lambda entry: entry.tag.severity, kind="severity"),
        _Column(t("sheet.photo"), _PHOTO_WIDTH, lambda _: None, kind="photo"),
        _Column(t("sheet.remark"), 36, lambda entry: entry.tag.remark, wrap),
        _Column(t("sheet.recommendation"), 32, lambda entry: entry.tag.recommendation, wrap),
        _Column(t("sheet.cost", currency=report.template.currency), 11,
                lambda entry: entry.tag.cost, (("num_format", "#,##0.00"),), kind="cost"),
        _Column(t("sheet.time"), 9, lambda entry: t.time(entry.time_s), kind="time"),
    )  # fmt: skip
    hidden = set() if report.template.costs else {"cost"}
    if not any(map(says_source, report.entries)):
        hidden.add("source")
    return [one for one in columns if one.kind not in hidden]


def _sizes(entry: Entry, t: Translator) -> str:
    return "\n".join([*t.quantities(entry), *t.sizes(entry)])


def _write_facts(sheet: Worksheet, cells: Cells, report: Report, t: Translator) -> None:
    """Write the title and three blocks of names and values; texts flow into the empty cells."""
    accent = report.template.accent
    title = f"{report.asset} · {t('cover.title')}"
    cells.text(sheet, 0, 0, title, bold=True, font_size=15, font_color=accent)
    sheet.set_row(0, 24)
    for first, rows in zip((0, 6, 11), _facts(report, t), strict=True):
        for row, (name, value) in enumerate(rows, 1):
            cells.text(sheet, row, first, name, font_color=_SOFT)
            # The value begins behind the width of the longest name.
            cells.text(sheet, row, first + (1 if first == 11 else 3), value, bold=True)
    sheet.set_row(5, 1.5 * LINE_PT)
    cells.text(sheet, 5, 0, _note(report, t), font_color=_SOFT, italic=True)


def _facts(report: Report, t: Translator) -> Sequence[Sequence[tuple[str, str]]]:
    header = report.header

    def stated(*names: str) -> str:
        return " ".join(str(header[name]) for name in names if header.get(name)) or NOTHING

    grade = grade_of(report)
    worst = grade.worst if grade else None
    costs = costs_of(report)
    company = report.company.name or stated("contractor")
    length = t.length(report.distance_m)
    if report.distance_m is not None and report.u95_m is not None:
        length += f" ± {t.half_width(report.u95_m)} {t.units}"
    return (
        (
            (t("cover.client"), stated("client")),
            (t("sheet.project"), project_of(header) or NOTHING),
            (t("cover.contractor"), company),
            (t("cover.operator"), stated("operator")),
        ),
        (
            (t("cover.inspected"), t.value("date", stated("date", "time"))),
            (t("cover.nodes"),
             t("cover.from_to", start=stated("start_node"), end=stated("end_node"))),
            (t("cover.length"), length),
            (t("sheet.act_now"), str(len(urgent(report)))),
        ),
        (
            (t("grade.title"), t("grade.none") if grade is None else t(grade.word)),
            (t("condition.deciding"),
             f"{t.place(worst)} · {t.code(worst)}" if worst else NOTHING),
            (t("sheet.costs"),
             t.money(costs.total, report.template.currency) if costs else NOTHING),
            (t("cover.report"), t("cover.version", report=report.id, revision=report.revision)),
        ),
    )  # fmt: skip


def _note(report: Report, t: Translator) -> str:
    grade = grade_of(report)
    if grade is not None and grade.rule == "pack":
        return t(grade.source)
    if report.template.grade == "structural":
        return t("grade.structural_not")
    return t("condition.not_a_grade")


def _write_entry(
    sheet: Worksheet,
    cells: Cells,
    row: int,
    entry: Entry,
    columns: Sequence[_Column],
    report: Report,
    t: Translator,
) -> None:
    """Write one observation; the row is as high as its photo and its texts."""
    lines, photo_px = 1, 0
    for number, column in enumerate(columns):
        value = column.value(entry)
        properties = {**_FRAME, **dict(column.look)}
        if column.kind == "photo":
            photo_px = _place_photo(sheet, cells, row, number, entry, t)
        elif value is None or value == "":
            sheet.write_blank(row, number, None, cells.look(**_FRAME))
        elif column.kind == "time" and (link := report.link_to(entry)):
            look = cells.look(**_FRAME, font_color="#0563C1", underline=1)
            sheet.write_url(row, number, link, look, str(value))
        elif isinstance(value, str):
            cells.text(sheet, row, number, value, **properties)
            lines = max(lines, lines_of(value, column.width))
        else:
            if column.kind == "severity":
                properties |= _severity_look(int(value), t)
            sheet.write_number(row, number, value, cells.look(**properties))
    sheet.set_row(row, min(max(photo_px * _PX_PT, lines * LINE_PT + 4), _TALLEST_PT))


def _severity_look(severity: int, t: Translator) -> dict[str, Any]:
    """Return the look of a severity, which stays a number to sort and filter by."""
    word = t.severity(severity).replace('"', "'")
    return {
        "bold": True,
        "align": "left",
        "num_format": f'0 "{word}"',
        "bg_color": fill_of(severity),
        "font_color": ink_on(severity),
    }


def _place_photo(
    sheet: Worksheet, cells: Cells, row: int, number: int, entry: Entry, t: Translator
) -> int:
    """Put a thumbnail into the cell, above where it was taken if that is not the entry's place, or
    the name of a photo that cannot be shown; return the height that it needs, px.
    """
    photo = entry.photo
    found = _thumbnail(photo) if photo else None
    if photo is None or found is None:
        name = photo.name if photo else ""
        cells.text(sheet, row, number, name, text_wrap=True, font_color=_SOFT, **_FRAME)
        return 0
    content, size = found
    scale = min(room / side for room, side in zip(_THUMBNAIL_PX, size, strict=True))
    sheet.insert_image(
        row, number, "thumbnail.jpg",
        {
            "image_data": io.BytesIO(content), "x_scale": scale, "y_scale": scale,
            "x_offset": 4, "y_offset": 4, "object_position": 1,
            "description": photo_alt(entry, photo, t),
        },
    )  # fmt: skip
    high_px = round(size[1] * scale) + 8
    if photo.taken is None:
        return high_px
    taken = t.place_in_photo(entry, photo.taken)
    cells.text(sheet, row, number, taken, text_wrap=True, valign="bottom", font_size=8, **_FRAME)
    return high_px + round(2 * LINE_PT / _PX_PT)


def _thumbnail(photo: Photo) -> tuple[bytes, tuple[int, int]] | None:
    """Return a small JPEG and its size, px; None where the photo is missing or broken."""
    if photo.shown is None:
        return None
    most = (int(_THUMBNAIL_PX[0] * _SHARPNESS), int(_THUMBNAIL_PX[1] * _SHARPNESS))
    try:
        with Image.open(io.BytesIO(photo.shown.read_bytes())) as picture:
            picture.draft("RGB", most)  # decodes at a part of the size: cheap
            small = picture.convert("RGB")
        small.thumbnail(most)
        out = io.BytesIO()
        small.save(out, "JPEG", quality=_QUALITY, dpi=(96, 96))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    return out.getvalue(), small.size


def _set_up_print(sheet: Worksheet, report: Report, t: Translator, last: int, columns: int) -> None:
    """Print the head on each page, and its number in the foot."""
    fit_on_page(sheet, head=_HEAD)
    sheet.print_area(0, 0, last, columns - 1)
    sheet.set_margins(left=0.4, right=0.4, top=0.5, bottom=0.6)
    what = f"{report.asset[:80]} {t.date(str(report.header.get('date') or ''))[:20]}"
    left = one_line(legible(what)).replace("&", "&&")
    sheet.set_footer(f"&L{left}&R{t('page.of', page='&P')}&N")
