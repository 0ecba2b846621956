"""Parts of pages: headings, paragraphs, tables and figures that always fit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import zip_longest
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
    LINK,
    RULE,
    SEVERITY,
    SMALL,
    SUBHEADING,
    WASH,
    WIDTH,
    Style,
    on_severity,
)
from app.reports.pdf.tags import Element, Kind
from app.reports.pdf.text import Line, clean, draw, lines_of, shortened, width_of

Item = TypeVar("Item")

Align = Literal["left", "centre", "right"]
Texts = Sequence[tuple[str, Style]]
"""Paragraphs, each with its style."""


_PART_ROOM, _ROOM = 50 * mm, 20 * mm
"""Least height below the heading of a part, and of what it contains."""


class _Piece(Flowable):
    """A flowable that draws on tagged paper."""

    canv: Paper


class Heading(_Piece):
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


class Title(_Piece):
    """The title of a report, at its beginning: the place `title` of the report."""

    def __init__(self, title: str, style: Style, *, after: float, bookmark: str) -> None:
        super().__init__()
        self._lines = lines_of(title, style, WIDTH)
        self._after = after
        self.bookmark = bookmark

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return the height of the lines."""
        return width, _height(self._lines) + self._after

    def draw(self) -> None:
        """Draw the title; it has a bookmark where there are other reports."""
        paper, top = self.canv, _height(self._lines) + self._after
        paper.place("title", 0, top)
        if paper.level:
            paper.bookmark(self.bookmark, -1, 0, top)
        with paper.element(paper.heading_kind(0)):
            _draw_lines(paper, self._lines, 0, top, WIDTH, "left")


class Prose(_Piece):
    """Paragraphs of any length; they continue over pages line by line."""

    def __init__(self, texts: Texts, *, after: float = 2 * mm) -> None:
        super().__init__()
        self._after = after
        self._paragraphs = [
            _Paragraph(tuple(lines_of(text, style, WIDTH)), _Mark()) for text, style in texts
        ]

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return the height of the lines."""
        return width, self._lines_height + self._after

    @property
    def _lines_height(self) -> float:
        return sum(_height(paragraph.lines) for paragraph in self._paragraphs)

    def split(self, width: float, height: float) -> list[Flowable]:
        """Split into the lines that fit and the others."""
        kept: list[_Paragraph] = []
        rest = list(self._paragraphs)
        while rest and _height(rest[0].lines) <= height:
            height -= _height(rest[0].lines)
            kept.append(rest.pop(0))
        if rest:
            upper, lower = _cut_lines(rest[0].lines, height)
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
        paper, top = self.canv, self._lines_height + self._after
        for paragraph in self._paragraphs:
            mark = paragraph.mark
            if mark.element is None:
                mark.element = paper.tags.open("P")
            with paper.tagged(mark.element):
                _draw_lines(paper, paragraph.lines, 0, top, WIDTH, "left")
            if not paragraph.goes_on:
                paper.tags.close(mark.element)
            top -= _height(paragraph.lines)


@dataclass
class _Mark:
    """The element of something that may continue on the next page."""

    element: Element | None = None
    cells: tuple[Element, ...] = ()
    """Of a row."""


@dataclass(frozen=True)
class _Paragraph:
    lines: tuple[Line, ...]
    mark: _Mark
    goes_on: bool = False
    """Whether the next page has more of it."""


@dataclass(frozen=True)
class Column:
    """A column of a table."""

    title: str
    width: float
    align: Align = "left"
    is_head: bool = False
    """Whether its cells name what their rows hold."""


@dataclass(frozen=True)
class Badge:
    """A cell that shows a severity by number and shade."""

    severity: int | None


@dataclass(frozen=True)
class Linked:
    """A cell that links to a place of the report."""

    text: str
    place: str
    target: str
    """What is there, in words."""


@dataclass(frozen=True)
class PageOf:
    """A cell with the number of the page of a place; it links there."""

    place: str
    target: str


Cell = Texts | Badge | Linked | PageOf | str
Laid = tuple[Line, ...] | Badge | Linked | PageOf
"""The content of a cell: lines or a field of its own."""


@dataclass(frozen=True)
class _Row:
    cells: tuple[Laid, ...]
    mark: _Mark = field(default_factory=_Mark)
    place: str | None = None
    """Name of the row as a target of links."""
    goes_on: bool = False
    """Whether the next page has more of it."""

    @property
    def height(self) -> float:
        return max(_cell_height(cell) for cell in self.cells) + 2 * _PADDING

    def cut(self, height: float) -> tuple[_Row, _Row] | None:
        """Split into the lines that fit and the others; None if it cannot be split."""
        halves = [_cut_cell(cell, height - 2 * _PADDING) for cell in self.cells]
        upper = replace(self, cells=tuple(half[0] for half in halves), goes_on=True)
        lower = replace(self, cells=tuple(half[1] for half in halves), place=None)
        is_cut = any(isinstance(cell, tuple) and cell for cell in upper.cells)
        return (upper, lower) if is_cut and any(lower.cells) else None


_PADDING = 1.1 * mm
_TALL = 60 * mm
"""Rows above this height are split where the page ends, so that no page stays half empty."""


class Grid(_Piece):
    """A table: its head is repeated on every page, and any row may continue on the next."""

    def __init__(
        self,
        columns: Sequence[Column],
        rows: Sequence[Sequence[Cell]],
        *,
        after: float = 4 * mm,
        places: Sequence[str] = (),
    ) -> None:
        super().__init__()
        self._columns = columns
        self._after = after
        self._mark = _Mark()
        self._is_first = self._is_last = True
        widths = [column.width - 2 * _PADDING for column in columns]
        self._rows = [
            _Row(
                tuple(_laid(cell, width) for cell, width in zip(row, widths, strict=True)),
                place=place,
            )
            for row, place in zip_longest(rows, places)
        ]
        heads = [
            tuple(lines_of(column.title, SMALL.bold().on(ACCENT), width))
            for column, width in zip(columns, widths, strict=True)
        ]
        self._head = _Row(tuple(heads))
        self._has_head = any(column.title for column in columns)

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return the height of the rows."""
        return width, self._head_height + sum(row.height for row in self._rows) + self._after

    @property
    def _head_height(self) -> float:
        return self._head.height if self._has_head else 0.0

    def split(self, width: float, height: float) -> list[Flowable]:
        """Split into the rows that fit and the others; a tall row is split."""
        room = height - self._head_height
        kept: list[_Row] = []
        rest = list(self._rows)
        while rest and rest[0].height <= room:
            room -= rest[0].height
            kept.append(rest.pop(0))
        if rest and rest[0].height > _TALL and (halves := rest[0].cut(room)):
            kept.append(halves[0])
            rest[0] = halves[1]
        if not (kept and rest):
            return []
        upper, lower = self._part(kept, 0), self._part(rest, self._after)
        upper._is_first, upper._is_last = self._is_first, False
        lower._is_first, lower._is_last = False, self._is_last
        return [upper, lower]

    def _part(self, rows: list[_Row], after: float) -> Grid:
        part = Grid(self._columns, (), after=after)
        part._rows, part._mark = rows, self._mark
        return part

    def draw(self) -> None:
        """Draw the table from the top down."""
        paper = self.canv
        if self._mark.element is None:
            self._mark.element = paper.tags.open("Table")
        y = self._head_height + sum(row.height for row in self._rows) + self._after
        with paper.artifact():
            if self._has_head:
                y = self._draw_head(paper, y)
            for row in self._rows:
                y = self._draw_row(paper, row, y)
                self._rule(y, 0.3)
        if self._is_last:
            paper.tags.close(self._mark.element)

    def _draw_head(self, paper: Paper, y: float) -> float:
        """Draw the head; where the table continues, it is not read again."""
        paper.setFillColor(WASH)
        paper.rect(0, y - self._head.height, self._width, self._head.height, 0, 1)
        if self._is_first:
            bottom = self._draw_row(paper, self._head, y, is_head=True)
        else:
            for cell, x, column in self._placed(self._head):
                _draw_cell(paper, cell, x, y, column)
            bottom = y - self._head.height
        self._rule(bottom, 0.8)
        return bottom

    @property
    def _width(self) -> float:
        return sum(column.width for column in self._columns)

    def _rule(self, y: float, width: float) -> None:
        self.canv.setStrokeColor(RULE)
        self.canv.setLineWidth(width)
        self.canv.line(0, y, self._width, y)

    def _placed(self, row: _Row) -> Iterator[tuple[Laid, float, Column]]:
        x = 0.0
        for cell, column in zip(row.cells, self._columns, strict=True):
            yield cell, x, column
            x += column.width

    def _draw_row(self, paper: Paper, row: _Row, top: float, *, is_head: bool = False) -> float:
        mark = row.mark
        if mark.element is None:
            mark.element = paper.tags.open("TR", self._mark.element)
            mark.cells = tuple(
                _cell_element(paper, mark.element, column, is_head=is_head)
                for column in self._columns
            )
        if row.place is not None:
            paper.place(row.place, 0, top)
        for (cell, x, column), element in zip(self._placed(row), mark.cells, strict=True):
            if isinstance(cell, Linked | PageOf):
                with paper.tags.element("Link", element) as link:
                    with paper.tagged(link):
                        _draw_cell(paper, cell, x, top, column)
                    rect = (x, top - row.height, x + column.width, top)
                    paper.link(cell.place, cell.target, rect, link)
            elif cell and cell != Badge(None):
                with paper.tagged(element):
                    _draw_cell(paper, cell, x, top, column)
        if not row.goes_on:
            for element in (*mark.cells, mark.element):
                paper.tags.close(element)
        return top - row.height


def _cell_element(paper: Paper, row: Element, column: Column, *, is_head: bool) -> Element:
    if is_head:
        return paper.tags.open("TH", row, A="<</O/Table/Scope/Column>>")
    if column.is_head:
        return paper.tags.open("TH", row, A="<</O/Table/Scope/Row>>")
    return paper.tags.open("TD", row)


def _draw_cell(paper: Paper, cell: Laid, x: float, top: float, column: Column) -> None:
    left, y = x + _PADDING, top - _PADDING
    room = column.width - 2 * _PADDING
    if isinstance(cell, Badge):
        draw_badge(paper, left, y - 3.4 * mm, cell.severity)
    elif isinstance(cell, Linked):
        _draw_lines(paper, (Line(cell.text, LINK),), left, y, room, column.align)
    elif isinstance(cell, PageOf):
        paper.saveState()
        paper.translate(left + room, y - (CELL.leading + 0.55 * CELL.size) / 2)
        paper.page_of(cell.place)
        paper.restoreState()
    else:
        _draw_lines(paper, cell, left, y, room, column.align)


class Figure(_Piece):
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


def pairs(rows: Sequence[tuple[str, str]], *, after: float = 4 * mm) -> Grid:
    """Build a table of names and values."""
    columns = (Column("", 50 * mm, is_head=True), Column("", WIDTH - 50 * mm))
    return Grid(
        columns,
        [([(name, CELL.soft())], [(value, CELL)]) for name, value in rows],
        after=after,
    )


def _laid(cell: Cell, width: float) -> Laid:
    if isinstance(cell, Badge | Linked | PageOf):
        return cell
    texts = [(cell, CELL)] if isinstance(cell, str) else cell
    return tuple(
        line for text, style in texts if clean(text) for line in lines_of(text, style, width)
    )


def _cell_height(cell: Laid) -> float:
    if isinstance(cell, Badge):
        return 3.4 * mm
    return CELL.leading if isinstance(cell, Linked | PageOf) else _height(cell)


def _height(lines: Sequence[Line]) -> float:
    return sum(line.style.leading for line in lines)


def _cut_cell(cell: Laid, height: float) -> tuple[Laid, Laid]:
    return _cut_lines(cell, height) if isinstance(cell, tuple) else (cell, ())


def _cut_lines(lines: tuple[Line, ...], height: float) -> tuple[tuple[Line, ...], tuple[Line, ...]]:
    used, count = 0.0, 0
    for line in lines:
        used += line.style.leading
        if used > height:
            break
        count += 1
    return lines[:count], lines[count:]


def _draw_lines(
    canvas: Canvas, lines: Sequence[Line], x: float, top: float, width: float, align: Align
) -> None:
    x += {"left": 0.0, "centre": width / 2, "right": width}[align]
    for line in lines:
        # The baseline is placed so that small letters are vertically centred in the line.
        base = top - (line.style.leading + 0.55 * line.style.size) / 2
        draw(canvas, x, base, line.text, line.style, align)
        top -= line.style.leading


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
