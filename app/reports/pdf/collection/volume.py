"""A document that is laid out part by part, each report with its own head and foot."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from functools import partial
from typing import IO, Any

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import BaseDocTemplate, Flowable, PageBreak, PageTemplate

from app.reports.content.translator import Translator
from app.reports.pdf import pages
from app.reports.pdf.flow import Heading
from app.reports.pdf.styles import LEFT, PAGE_HEIGHT, PAGE_WIDTH, RIGHT, SMALL, WIDTH
from app.reports.pdf.text import draw, one_line, shortened, width_of
from app.reports.report import Company, Report


class Volume:
    """The document; `close` writes the file."""

    def __init__(self, out: IO[bytes], t: Translator, company: Company, made_at: datetime) -> None:
        title = t("collection.title")
        self._t = t
        self._company = company
        document: Any = BaseDocTemplate(
            out,
            pageTemplates=self._templates(title, None),
            title=one_line(title),
            author=one_line(company.name or "Chainage"),
            creator="Chainage",
            lang=t.language,
            pageCompression=1,
            invariant=1,
        )
        document._startBuild(None, partial(pages._canvas, made_at))
        self._document = document

    def add(self, title: str, story: Sequence[Flowable], report: Report | None = None) -> None:
        """Lay out a part on pages of its own; the headings of a report are below its first."""
        if self._document.page and not self._document._hanging:
            self._run([PageBreak()])
        self._document.pageTemplates = self._templates(title, report)
        self._document.pageTemplate = self._document.pageTemplates[0]
        if report is not None:
            headings = [piece for piece in story if isinstance(piece, Heading)]
            for heading in headings[1:]:
                heading.below = 1
        self._run(list(story))

    def close(self) -> None:
        """Fill in the number of pages, and write the file."""
        canvas = self._document.canv
        canvas.beginForm(pages._TOTAL)
        draw(canvas, 0, 0, str(self._document.page), SMALL.soft())
        canvas.endForm()
        self._document._endBuild()

    def _run(self, story: list[Flowable]) -> None:
        while story:
            self._document.clean_hanging()
            self._document.handle_flowable(story)

    def _templates(self, title: str, report: Report | None) -> list[PageTemplate]:
        if report is None:
            return [pages._template("page", partial(self._head, title), self._foot)]
        head, foot = pages._head(report, title), pages._foot(report, self._t)
        return [pages._template("cover", lambda _: None, foot), pages._template("page", head, foot)]

    def _head(self, title: str, canvas: Canvas) -> None:
        if canvas.getPageNumber() == 1:
            return
        y, style = PAGE_HEIGHT - 15 * mm, SMALL.soft()
        company = shortened(self._company.name or "", style, WIDTH / 2 - 5 * mm)
        draw(canvas, LEFT, y, company, style)
        draw(canvas, PAGE_WIDTH - RIGHT, y, shortened(title, style, WIDTH / 2), style, "right")

    def _foot(self, canvas: Canvas) -> None:
        y, style = 12 * mm, SMALL.soft()
        x = PAGE_WIDTH - RIGHT - width_of("0" * 4, style)
        draw(canvas, x, y, self._t("page.of", page=canvas.getPageNumber()), style, "right")
        canvas.saveState()
        canvas.translate(x, y)
        canvas.doForm(pages._TOTAL)
        canvas.restoreState()
