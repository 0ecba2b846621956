"""Parts of pages: headings, paragraphs and figures that always fit; `grid` has the tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable

from app.reports.pdf.paper import Paper, Rect
from app.reports.pdf.styles import (
    ACCENT,
    BODY,
    CELL,
    HEADING,
    INK,
    SEVERITY,
    SMALL,
    SUBHEADING,
    WASH,
    WIDTH,
    Style,
    on_severity,
)
from app.reports.pdf.tags import Element, Kind
from app.reports.pdf.text import Line, draw, lines_of, shortened, width_of

Item = TypeVar("Item")

Align = Literal["left", "centre", "right"]
Texts = Sequence[tuple[str, Style]]
"""Paragraphs, each with its style."""


_PART_ROOM, _ROOM = 50 * mm, 20 * mm
"""Least height below the heading of a part, and of what it contains."""


class Piece(Flowable):
    """A flowable that draws on tagged paper."""

    canv: Paper


class Heading(Piece):
    """The title of a part, with its bookmark; what follows is a section of its own."""

    def __init__(
        self, title: str, *, level: int = 0, bookmark: bool = True, is_continued: bool = False
    ) -> None:
        super().__init__()
        self.title = title
        self.level = level
        self.bookmark = bookmark
        self.is_continued = is_continued
        """Whether it only repeats the title on a further page."""
        self.style = HEADING if level == 0 else SUBHEADING

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return the size, including space below; too much where little of what follows would
        stay on the page.
        """
        self.width = width
        needed = self._above + self.style.leading + self._below
        is_near_end = height < needed + (_PART_ROOM if self.level == 0 else _ROOM)
        return width, height + 1 if is_near_end else needed

    def getSpaceBefore(self) -> float:  # noqa: N802
        """Return the space to a part before it on the same page."""
        return 9 * mm if self.level == 0 else 0.0

    @property
    def _above(self) -> float:
        return 0.0 if self.level == 0 else 2 * mm

    @property
    def _below(self) -> float:
        return 4 * mm if self.level == 0 else 1.6 * mm

    def draw(self) -> None:
        """Draw the heading."""
        paper = self.canv
        if self.is_continued:
            with paper.artifact():
                self._draw_title(paper)
        else:
            paper.tags.begin_section(paper.level + self.level)
            with paper.element(paper.heading_kind(1 + self.level)):
                self._draw_title(paper)
        if self.level == 0:
            with paper.artifact():
                paper.setStrokeColor(ACCENT)
                paper.setLineWidth(0.9)
                paper.line(0, self._below - 2, self.width, self._below - 2)
        if self.bookmark:
            paper.bookmark(self.title, self.level, 0, self._below + self.style.leading)

    def _draw_title(self, paper: Paper) -> None:
        title = shortened(self.title, self.style, WIDTH)
        draw(paper, 0, self._below + 4, title, self.style)


class Title(Piece):
    """The title of a report, at its beginning: the place `title` of the report."""

    def __init__(self, title: str, style: Style, *, after: float, bookmark: str) -> None:
        super().__init__()
        self._lines = lines_of(title, style, WIDTH)
        self._after = after
        self.bookmark = bookmark

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return the height of the lines."""
        return width, height_of(self._lines) + self._after

    def draw(self) -> None:
        """Draw the title; it has a bookmark where there are other reports."""
        paper, top = self.canv, height_of(self._lines) + self._after
        paper.place("title", 0, top)
        if paper.level:
            paper.bookmark(self.bookmark, -1, 0, top)
        with paper.element(paper.heading_kind(0)):
            draw_lines(paper, self._lines, 0, top, WIDTH, "left")


def space_below(wanted: float, room: float) -> float:
    """Return the space below a piece: what is left of a page must not push the piece off it."""
    return min(wanted, max(0.0, room))


class Prose(Piece):
    """Paragraphs of any length; they continue over pages line by line."""

    def __init__(self, texts: Texts, *, after: float = 2 * mm) -> None:
        super().__init__()
        self._after = after
        self._paragraphs = [
            _Paragraph(tuple(lines_of(text, style, WIDTH)), Mark()) for text, style in texts
        ]

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return the height of the lines, and of the space below as far as there is any."""
        self._below = space_below(self._after, height - self._lines_height)
        return width, self._lines_height + self._below

    @property
    def _lines_height(self) -> float:
        return sum(height_of(paragraph.lines) for paragraph in self._paragraphs)

    def split(self, width: float, height: float) -> list[Flowable]:
        """Split into the lines that fit and the others."""
        kept: list[_Paragraph] = []
        rest = list(self._paragraphs)
        while rest and height_of(rest[0].lines) <= height:
            height -= height_of(rest[0].lines)
            kept.append(rest.pop(0))
        if rest:
            upper, lower = cut_lines(rest[0].lines, height)
            if upper:
                kept.append(replace(rest[0], lines=upper, goes_on=True))
                rest[0] = replace(rest[0], lines=lower)
        return [self._part(kept, 0), self._part(rest, self._after)] if kept and rest else []

    def _part(self, paragraphs: list[_Paragraph], after: float) -> Prose:
        part = Prose((), after=after)
        part._paragraphs = paragraphs
        return part

    def draw(self) -> None:
        """Draw the lines."""
        paper, top = self.canv, self._lines_height + self._below
        for paragraph in self._paragraphs:
            mark = paragraph.mark
            if mark.element is None:
                mark.element = paper.tags.open("P")
            with paper.tagged(mark.element):
                draw_lines(paper, paragraph.lines, 0, top, WIDTH, "left")
            if not paragraph.goes_on:
                paper.tags.close(mark.element)
            top -= height_of(paragraph.lines)


@dataclass
class Mark:
    """The element of something that may continue on the next page."""

    element: Element | None = None
    cells: tuple[Element, ...] = ()
    """Of a row."""


@dataclass(frozen=True)
class _Paragraph:
    lines: tuple[Line, ...]
    mark: Mark
    goes_on: bool = False
    """Whether the next page has more of it."""


class Figure(Piece):
    """A drawing of a given size, with its origin at the lower left.

    It is read aloud as its sentence; without one, only what it tags itself is read.
    """

    def __init__(self, height: float, paint: Callable[[Paper], None], *, alt: str = "") -> None:
        super().__init__()
        self._height = height
        self._paint = paint
        self.alt = alt
        """What the drawing shows, in words."""

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return the width of the page and the height of the figure."""
        return WIDTH, self._height

    def draw(self) -> None:
        """Draw the figure."""
        paper = self.canv
        if self.alt:
            with paper.figure(self.alt, (0, 0, WIDTH, self._height)):
                self._paint(paper)
        else:
            with paper.artifact():
                self._paint(paper)


def height_of(lines: Sequence[Line]) -> float:
    """Return the height of lines, points."""
    return sum(line.style.leading for line in lines)


def cut_lines(lines: tuple[Line, ...], height: float) -> tuple[tuple[Line, ...], tuple[Line, ...]]:
    """Split into the lines that fit into a height and the others."""
    used, count = 0.0, 0
    for line in lines:
        used += line.style.leading
        if used > height:
            break
        count += 1
    return lines[:count], lines[count:]


def draw_lines(
    canvas: Canvas, lines: Sequence[Line], x: float, top: float, width: float, align: Align
) -> None:
    """Draw lines below each other, from `top` down, within a width."""
    x += {"left": 0.0, "centre": width / 2, "right": width}[align]
    for line in lines:
        # The baseline is placed so that small letters are vertically centred in the line.
        base = top - (line.style.leading + 0.55 * line.style.size) / 2
        draw(canvas, x, base, line.text, line.style, align)
        top -= line.style.leading


BADGE = 4.2 * mm


def draw_badge(canvas: Canvas, x: float, y: float, severity: int | None) -> None:
    """Draw a small field with the severity; its lower left corner is at (x, y)."""
    if severity is None:
        return
    canvas.setFillColor(SEVERITY.get(severity, WASH))
    canvas.setStrokeColor(INK)
    canvas.setLineWidth(0.35)
    canvas.roundRect(x, y, BADGE, 3.4 * mm, 0.7 * mm, 1, 1)
    style = SMALL.bold().on(on_severity(severity))
    draw(canvas, x + BADGE / 2, y + 0.9 * mm, str(severity), style, "centre")


def say(
    paper: Paper,
    x: float,
    y: float,
    text: str,
    style: Style,
    align: Align = "left",
    kind: Kind = "P",
) -> None:
    """Draw one line of cleaned text that is read aloud, within a drawing without a sentence."""
    if text:
        with paper.element(kind):
            draw(paper, x, y, text, style, align)


def say_linked(
    paper: Paper,
    x: float,
    y: float,
    text: str,
    style: Style,
    link: Callable[[Rect, Element], None],
) -> None:
    """Draw one line of cleaned text whose rectangle is linked by `link`."""
    with paper.tags.element("P") as paragraph, paper.tags.element("Link", paragraph) as element:
        with paper.tagged(element):
            draw(paper, x, y, text, style)
        link((x, y - 0.3 * style.size, x + width_of(text, style), y + style.size), element)


def note(text: str) -> Prose:
    """Build an explanatory paragraph."""
    return Prose([(text, CELL.soft())])


def paragraph(text: str) -> Prose:
    """Build a plain paragraph."""
    return Prose([(text, BODY)])


def batches(items: Sequence[Item], size: int) -> list[tuple[Item, ...]]:
    """Split the items into groups of a size, in order."""
    return [tuple(items[at : at + size]) for at in range(0, len(items), size)]
