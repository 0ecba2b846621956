"""Tables, whose rows continue over pages, and the table of contents."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import zip_longest

from reportlab.lib.units import mm
from reportlab.platypus import Flowable

from app.reports.content.typesetting import clean
from app.reports.pdf.flow import (
    Align,
    Mark,
    Piece,
    Texts,
    cut_lines,
    draw_badge,
    draw_lines,
    height_of,
    space_below,
)
from app.reports.pdf.paper import Paper
from app.reports.pdf.styles import ACCENT, CELL, LINK, RULE, SMALL, WASH, WIDTH
from app.reports.pdf.tags import Element, Kind
from app.reports.pdf.text import Line, lines_of


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
    mark: Mark = field(default_factory=Mark)
    place: str | None = None
    """Name of the row as a target of links."""
    goes_on: bool = False
    """Whether the next page has more of it."""

    @cached_property
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


class Grid(Piece):
    """A table: its head is repeated on every page, and any row may continue on the next."""

    _kinds: tuple[Kind, Kind] = ("Table", "TR")
    _has_read_head = True
    """Whether the head is read aloud, on the first page."""

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
        self._mark = Mark()
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
        """Return the height of the rows, and of the space below as far as there is any."""
        self._below = space_below(self._after, height - self._rows_height)
        return width, self._rows_height + self._below

    @property
    def _rows_height(self) -> float:
        return self._head_height + sum(row.height for row in self._rows)

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
        part = type(self)(self._columns, (), after=after)
        part._rows, part._mark = rows, self._mark
        return part

    def draw(self) -> None:
        """Draw the table from the top down."""
        paper = self.canv
        if self._mark.element is None:
            self._mark.element = paper.tags.open(self._kinds[0])
        y = self._rows_height + self._below
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
        if self._is_first and self._has_read_head:
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
            mark.element = paper.tags.open(self._kinds[1], self._mark.element)
            mark.cells = tuple(
                self._open_cell(paper, mark.element, cell, column, is_head=is_head)
                for cell, column in zip(row.cells, self._columns, strict=True)
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

    def _open_cell(
        self, paper: Paper, row: Element, cell: Laid, column: Column, *, is_head: bool
    ) -> Element:
        if is_head:
            return paper.tags.open("TH", row, A="<</O/Table/Scope/Column>>")
        if column.is_head:
            return paper.tags.open("TH", row, A="<</O/Table/Scope/Row>>")
        return paper.tags.open("TD", row)


class Contents(Grid):
    """A table of contents, which programs offer for finding the way; each row is an entry of it."""

    _kinds = ("TOC", "TOCI")
    _has_read_head = False

    def _open_cell(
        self, paper: Paper, row: Element, cell: Laid, column: Column, *, is_head: bool
    ) -> Element:
        return paper.tags.open("Reference" if isinstance(cell, Linked | PageOf) else "Lbl", row)


def _draw_cell(paper: Paper, cell: Laid, x: float, top: float, column: Column) -> None:
    left, y = x + _PADDING, top - _PADDING
    room = column.width - 2 * _PADDING
    if isinstance(cell, Badge):
        draw_badge(paper, left, y - 3.4 * mm, cell.severity)
    elif isinstance(cell, Linked):
        draw_lines(paper, (Line(cell.text, LINK),), left, y, room, column.align)
    elif isinstance(cell, PageOf):
        paper.saveState()
        paper.translate(left + room, y - (CELL.leading + 0.55 * CELL.size) / 2)
        paper.page_of(cell.place)
        paper.restoreState()
    else:
        draw_lines(paper, cell, left, y, room, column.align)


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
    return CELL.leading if isinstance(cell, Linked | PageOf) else height_of(cell)


def _cut_cell(cell: Laid, height: float) -> tuple[Laid, Laid]:
    return cut_lines(cell, height) if isinstance(cell, tuple) else (cell, ())
