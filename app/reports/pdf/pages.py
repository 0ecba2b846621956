"""Lays out flowables on pages: head, foot, page n of N, and the metadata of the file."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import IO, cast

from reportlab import rl_config
from reportlab.lib.colors import HexColor
from reportlab.lib.units import mm
from reportlab.platypus import BaseDocTemplate, Flowable, Frame, PageTemplate

from app.reports.content.translator import Translator
from app.reports.content.typesetting import one_line
from app.reports.pdf.file import File
from app.reports.pdf.metadata import About
from app.reports.pdf.paper import Paper
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
from app.reports.pdf.text import draw, shortened, width_of
from app.reports.report import Report

# Streams as bytes, not as text: a fifth smaller.
rl_config.useA85 = 0

_TOTAL = "total"


@dataclass(frozen=True)
class Running:
    """What stands at the head and the foot of pages."""

    company: str
    title: str
    foot: str
    t: Translator

    @classmethod
    def of(cls, report: Report, t: Translator, title: str) -> Running:
        """Return head and foot of a report."""
        foot = t(
            "page.foot",
            asset=report.asset,
            date=t.date(report.date),
            report=report.id,
            revision=report.revision,
        )
        return cls(report.company.name or "", f"{title} · {report.asset}", foot, t)


class Document:
    """A PDF that is laid out report by report; finished pages are in the file, not in memory."""

    def __init__(self, out: IO[bytes], about: About, *, most_pages: int = 999) -> None:
        """Begin a file.

        Args:
            out: An empty file.
            about: What it states about itself.
            most_pages: About how many pages there may be, for whose number the foot has room.
        """
        self._about = about
        self._digits = len(str(most_pages))
        self._file = File(out, about.language)
        self._paper = Paper(self._file)
        self._reports = 0

    def add(
        self,
        report: Report,
        t: Translator,
        title: str,
        story: Sequence[Flowable],
        *,
        level: int = 0,
        key: str = "",
    ) -> None:
        """Lay out the parts of a report, the first page without a head.

        Args:
            report: The report.
            t: Its words.
            title: Title in the head of the pages.
            story: Its parts.
            level: Depth of its headings and bookmarks; 0 for the only report of the document.
            key: Sets its places apart from those of other reports: the document links to its
                beginning as `<key>/title`.
        """
        self._paper.accent = HexColor(report.template.accent)
        self.add_pages(Running.of(report, t, title), story, level=level, key=key)
        self._paper.accent = ACCENT

    def add_pages(
        self, running: Running, story: Sequence[Flowable], *, level: int = 0, key: str = ""
    ) -> None:
        """Lay out pages that are of no single report, such as a table of contents."""
        paper = self._paper
        paper.level, paper.key = level, key
        if level:
            paper.tags.begin_section(level - 1, "Part")
        layout = BaseDocTemplate(
            "",
            pageTemplates=[
                _template("cover", lambda _: None, _foot(running, self._digits)),
                _template("page", _head(running), _foot(running, self._digits)),
            ],
        )
        layout._doSave = 0  # type: ignore[attr-defined]
        layout.build(list(story), canvasmaker=lambda *_, **__: paper)
        paper.tags.end_sections(level)
        paper.level, paper.key = 0, ""

    def close(self) -> None:
        """Write what is left of the file, which stays open.

        Raises:
            ValueError: A link goes to a place that no part has named.
        """
        self._paper.number(_TOTAL, self._file.page_count, SMALL.soft())
        catalog = {**self._about.write(self._file), **self._paper.finish()}
        self._file.finish(self._paper, catalog, self._about.info(self._file))


def made(report: Report, t: Translator, title: str, story: Sequence[Flowable]) -> bytes:
    """Return the document of one report as a file."""
    out = io.BytesIO()
    document = Document(out, about(report, title))
    document.add(report, t, title, story)
    document.close()
    return out.getvalue()


def about(report: Report, title: str) -> About:
    """Return what the file of a report states about itself; its date is that of the report, so
    that equal reports give equal files.
    """
    return About(
        title=one_line(f"{title} · {report.asset}"),
        author=one_line(report.company.name or "") or "Chainage",
        subject=one_line(f"{report.name} · {report.id}"),
        language=report.language,
        made_at=report.made_at,
    )


def _template(
    name: str, head: Callable[[Paper], None], foot: Callable[[Paper], None]
) -> PageTemplate:
    frame = Frame(
        LEFT, BOTTOM, WIDTH, HEIGHT, leftPadding=0, rightPadding=0, topPadding=0, bottomPadding=0
    )
    return PageTemplate(
        name,
        [frame],
        onPage=lambda paper, _: head(cast(Paper, paper)),
        onPageEnd=lambda paper, _: foot(cast(Paper, paper)),
    )


def _head(running: Running) -> Callable[[Paper], None]:
    style = SMALL.soft()
    left = shortened(running.company, style, WIDTH / 2 - 5 * mm)
    right = shortened(running.title, style, WIDTH / 2)

    def paint(paper: Paper) -> None:
        y = PAGE_HEIGHT - 15 * mm
        with paper.artifact("Header"):
            draw(paper, LEFT, y, left, style)
            draw(paper, PAGE_WIDTH - RIGHT, y, right, style, "right")
            paper.setStrokeColor(RULE)
            paper.setLineWidth(0.5)
            paper.line(LEFT, y - 2.2 * mm, PAGE_WIDTH - RIGHT, y - 2.2 * mm)

    return paint


def _foot(running: Running, digits: int) -> Callable[[Paper], None]:
    style = SMALL.soft()
    left = shortened(running.foot, style, WIDTH - 35 * mm)
    # The total is known only at the end: room is reserved for its digits.
    x = PAGE_WIDTH - RIGHT - width_of("0" * digits, style)

    def paint(paper: Paper) -> None:
        y = 12 * mm
        with paper.artifact("Footer"):
            paper.setStrokeColor(RULE)
            paper.setLineWidth(0.5)
            paper.line(LEFT, y + 3.6 * mm, PAGE_WIDTH - RIGHT, y + 3.6 * mm)
            draw(paper, LEFT, y, left, style)
            number = running.t("page.of", page=paper.getPageNumber())
            draw(paper, x, y, number, style, "right")
            paper.saveState()
            paper.translate(x, y)
            paper.doForm(_TOTAL)
            paper.restoreState()

    return paint
