"""Lays out flowables on pages: head, foot, page n of N, and the metadata of the file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import IO, Any, cast

from reportlab import rl_config
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import BaseDocTemplate, Flowable, Frame, PageTemplate

from app.reports.content.translator import Translator
from app.reports.pdf.fonts import LATIN, font_of
from app.reports.pdf.styles import (
    ACCENT,
    BOTTOM,
    HEIGHT,
    LEFT,
    PAGE_HEIGHT,
    PAGE_WIDTH,
    RIGHT,
    RULE,
    SMALL,
    WIDTH,
)
from app.reports.pdf.text import draw, one_line, shortened, width_of
from app.reports.report import Report

# Streams as bytes, not as text: a fifth smaller.
rl_config.useA85 = 0

_TOTAL = "total"
_TOTAL_DIGITS = 3


def made(report: Report, t: Translator, title: str, story: Sequence[Flowable]) -> bytes:
    """Return the document as a file; the first page has no head."""
    out = _Sink()
    foot = _foot(report, t)
    document = BaseDocTemplate(
        cast(IO[bytes], out),
        pageTemplates=[
            _template("cover", lambda _: None, foot),
            _template("page", _head(report, title), foot),
        ],
        title=one_line(f"{title} · {report.asset}"),
        author=one_line(report.company.name or "Chainage"),
        subject=one_line(f"{report.name} · {report.id}"),
        creator="Chainage",
        lang=report.language,
        pageCompression=1,
        invariant=1,
    )
    pages = _Pages(document)
    document.build([*story, pages], canvasmaker=partial(_canvas, report.made_at))
    return out.content


class _Sink:
    """A file that is written at once and not copied again."""

    content = b""

    def write(self, content: bytes) -> None:
        """Store the content."""
        self.content = content


class _Pages(Flowable):
    """Last flowable: it knows the number of pages, which every foot shows."""

    def __init__(self, document: BaseDocTemplate) -> None:
        super().__init__()
        self._document = document

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return no size."""
        return 0, 0

    def draw(self) -> None:
        """Fill in the form that every foot draws."""
        canvas = self.canv
        canvas.beginForm(_TOTAL)
        draw(canvas, 0, 0, str(self._document.page), SMALL.soft())
        canvas.endForm()


def _canvas(made_at: datetime, *args: Any, **options: Any) -> Canvas:
    """Make a canvas whose file states the time of the report, so that equal reports give equal
    files.

    It begins with an embedded font; otherwise every page would name a font that is not embedded.
    """
    canvas = Canvas(*args, **options | {"initialFontName": font_of(LATIN, 400).fontName})
    date = f"{made_at.astimezone(UTC):D:%Y%m%d%H%M%SZ}"
    canvas.setDateFormatter(lambda *_: date)
    return canvas


def _template(
    name: str, head: Callable[[Canvas], None], foot: Callable[[Canvas], None]
) -> PageTemplate:
    frame = Frame(
        LEFT, BOTTOM, WIDTH, HEIGHT, leftPadding=0, rightPadding=0, topPadding=0, bottomPadding=0
    )
    return PageTemplate(
        name,
        [frame],
        onPage=lambda canvas, _: head(canvas),
        onPageEnd=lambda canvas, _: foot(canvas),
    )


def _head(report: Report, title: str) -> Callable[[Canvas], None]:
    company = report.company.name or ""

    def paint(canvas: Canvas) -> None:
        y = PAGE_HEIGHT - 15 * mm
        style = SMALL.soft()
        draw(canvas, LEFT, y, shortened(company, style, WIDTH / 2 - 5 * mm), style)
        right = shortened(f"{title} · {report.asset}", style, WIDTH / 2)
        draw(canvas, PAGE_WIDTH - RIGHT, y, right, style, "right")
        canvas.setStrokeColor(RULE)
        canvas.setLineWidth(0.5)
        canvas.line(LEFT, y - 2.2 * mm, PAGE_WIDTH - RIGHT, y - 2.2 * mm)

    return paint


def _foot(report: Report, t: Translator) -> Callable[[Canvas], None]:
    date = report.header.get("date") or f"{report.created_at:%Y-%m-%d}"
    left = t("page.foot", asset=report.asset, date=date, report=report.id, revision=report.revision)

    def paint(canvas: Canvas) -> None:
        y = 12 * mm
        style = SMALL.soft()
        canvas.setStrokeColor(RULE)
        canvas.setLineWidth(0.5)
        canvas.line(LEFT, y + 3.6 * mm, PAGE_WIDTH - RIGHT, y + 3.6 * mm)
        draw(canvas, LEFT, y, shortened(left, style, WIDTH - 35 * mm), style)
        # The total is known only at the end: three digits are reserved.
        x = PAGE_WIDTH - RIGHT - width_of("0" * _TOTAL_DIGITS, style)
        number = t("page.of", page=canvas.getPageNumber())
        draw(canvas, x, y, number, style, "right")
        canvas.saveState()
        canvas.translate(x, y)
        canvas.doForm(_TOTAL)
        canvas.restoreState()
        canvas.setFillColor(ACCENT)

    return paint
