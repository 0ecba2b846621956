"""Parts of pages: headings, paragraphs, tables and figures that always fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeVar

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable

from app.reports.pdf.styles import (
    ACCENT,
    BODY,
    CELL,
    HEADING,
    INK,
    RULE,
    SEVERITY,
    SMALL,
    SUBHEADING,
    WASH,
    WIDTH,
    Style,
    on_severity,
)
from app.reports.pdf.text import Line, clean, draw, lines_of, one_line, shortened

Item = TypeVar("Item")

Align = Literal["left", "centre", "right"]
Texts = Sequence[tuple[str, Style]]
"""Paragraphs, each with its style."""


class Heading(Flowable):
    """The title of a part, with its bookmark."""

    def __init__(self, title: str, *, level: int = 0, bookmark: bool = True) -> None:
        super().__init__()
        self.title = title
        self.level = level
        self.bookmark = bookmark
        self.below = 0
        """Levels of bookmarks above its own."""
        self.style = HEADING if level == 0 else SUBHEADING

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return the size, including space below."""
        self.width = width
        return width, self._above + self.style.leading + self._below

    @property
    def _above(self) -> float:
        return 0.0 if self.level == 0 else 2 * mm

    @property
    def _below(self) -> float:
        return 4 * mm if self.level == 0 else 1.6 * mm

    def draw(self) -> None:
        """Draw the heading."""
        canvas = self.canv
        below = self._below
        draw(canvas, 0, below + 4, shortened(self.title, self.style, WIDTH), self.style)
        if self.level == 0:
            canvas.setStrokeColor(ACCENT)
            canvas.setLineWidth(0.9)
            canvas.line(0, below - 2, self.width, below - 2)
        if self.bookmark:
            key = f"{canvas.getPageNumber()} {self.title}"
            canvas.bookmarkHorizontal(key, 0, below + self.style.leading)
            canvas.addOutlineEntry(one_line(self.title), key, self.level + self.below, closed=False)


class Prose(Flowable):
    """Paragraphs of any length; they continue over pages line by line."""

    def __init__(self, texts: Texts, *, after: float = 2 * mm) -> None:
        super().__init__()
        self._lines = [line for text, style in texts for line in lines_of(text, style, WIDTH)]
        self._after = after

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return the height of the lines."""
        return width, _height(self._lines) + self._after

    def split(self, width: float, height: float) -> list[Flowable]:
        """Split into the lines that fit and the others."""
        kept, rest = _cut_lines(self._lines, height)
        return [self._part(kept, 0), self._part(rest, self._after)] if kept and rest else []

    def _part(self, lines: list[Line], after: float) -> Prose:
        part = Prose((), after=after)
        part._lines = lines
        return part

    def draw(self) -> None:
        """Draw the lines."""
        _draw_lines(self.canv, self._lines, 0, _height(self._lines) + self._after, WIDTH, "left")


@dataclass(frozen=True)
class Column:
    """A column of a table."""

    title: str
    width: float
    align: Align = "left"


@dataclass(frozen=True)
class Badge:
    """A cell that shows a severity by number and shade."""

    severity: int | None


Cell = Texts | Badge | str
Laid = list[Line] | Badge
"""The content of a cell: lines or a badge."""


@dataclass(frozen=True)
class Row:
    """A row of a table, laid out."""

    cells: tuple[Laid, ...]

    @property
    def height(self) -> float:
        """Height of its highest cell, with space around."""
        return max(_cell_height(cell) for cell in self.cells) + 2 * _PADDING

    def cut(self, height: float) -> tuple[Row, Row] | None:
        """Split into the lines that fit and the others; None if it cannot be split."""
        halves = [_cut_cell(cell, height - 2 * _PADDING) for cell in self.cells]
        upper, lower = (Row(tuple(half[n] for half in halves)) for n in (0, 1))
        is_cut = any(isinstance(cell, list) and cell for cell in upper.cells)
        return (upper, lower) if is_cut and any(lower.cells) else None


_PADDING = 1.1 * mm
_TALL = 60 * mm
"""Rows above this height are split where the page ends, so that no page stays half empty."""


class Grid(Flowable):
    """A table: its head is repeated on every page, and any row may continue on the next."""

    def __init__(
        self,
        columns: Sequence[Column],
        rows: Sequence[Sequence[Cell]],
        *,
        after: float = 4 * mm,
    ) -> None:
        super().__init__()
        self._columns = columns
        self._after = after
        widths = [column.width - 2 * _PADDING for column in columns]
        self._rows = [
            Row(tuple(_laid(cell, width) for cell, width in zip(row, widths, strict=True)))
            for row in rows
        ]
        heads = [
            lines_of(column.title, SMALL.bold().on(ACCENT), width)
            for column, width in zip(columns, widths, strict=True)
        ]
        self._head = Row(tuple(heads))
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
        kept: list[Row] = []
        rest = list(self._rows)
        while rest and rest[0].height <= room:
            room -= rest[0].height
            kept.append(rest.pop(0))
        if rest and rest[0].height > _TALL and (halves := rest[0].cut(room)):
            kept.append(halves[0])
            rest[0] = halves[1]
        return [self._part(kept, 0), self._part(rest, self._after)] if kept and rest else []

    def _part(self, rows: list[Row], after: float) -> Grid:
        part = Grid(self._columns, (), after=after)
        part._rows = rows
        return part

    def draw(self) -> None:
        """Draw the table from the top down."""
        canvas = self.canv
        y = self._head_height + sum(row.height for row in self._rows) + self._after
        if self._has_head:
            canvas.setFillColor(WASH)
            canvas.rect(0, y - self._head.height, self._width, self._head.height, 0, 1)
            y = self._draw_row(self._head, y)
            self._rule(y, 0.8)
        for row in self._rows:
            y = self._draw_row(row, y)
            self._rule(y, 0.3)

    @property
    def _width(self) -> float:
        return sum(column.width for column in self._columns)

    def _rule(self, y: float, width: float) -> None:
        self.canv.setStrokeColor(RULE)
        self.canv.setLineWidth(width)
        self.canv.line(0, y, self._width, y)

    def _draw_row(self, row: Row, top: float) -> float:
        x = 0.0
        for cell, column in zip(row.cells, self._columns, strict=True):
            room = column.width - 2 * _PADDING
            if isinstance(cell, Badge):
                draw_badge(self.canv, x + _PADDING, top - _PADDING - 3.4 * mm, cell.severity)
            else:
                _draw_lines(self.canv, cell, x + _PADDING, top - _PADDING, room, column.align)
            x += column.width
        return top - row.height


class Figure(Flowable):
    """A drawing of a given size, with its origin at the lower left."""

    def __init__(self, height: float, paint: Callable[[Canvas], None], *, alt: str = "") -> None:
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
        self._paint(self.canv)


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
    columns = (Column("", 50 * mm), Column("", WIDTH - 50 * mm))
    return Grid(
        columns,
        [([(name, CELL.soft())], [(value, CELL)]) for name, value in rows],
        after=after,
    )


def _laid(cell: Cell, width: float) -> Laid:
    if isinstance(cell, Badge):
        return cell
    texts = [(cell, CELL)] if isinstance(cell, str) else cell
    return [line for text, style in texts if clean(text) for line in lines_of(text, style, width)]


def _cell_height(cell: Laid) -> float:
    return 3.4 * mm if isinstance(cell, Badge) else _height(cell)


def _height(lines: Sequence[Line]) -> float:
    return sum(line.style.leading for line in lines)


def _cut_cell(cell: Laid, height: float) -> tuple[Laid, Laid]:
    return (cell, []) if isinstance(cell, Badge) else _cut_lines(cell, height)


def _cut_lines(lines: list[Line], height: float) -> tuple[list[Line], list[Line]]:
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


def note(text: str) -> Prose:
    """Build an explanatory paragraph."""
    return Prose([(text, CELL.soft())])


def paragraph(text: str) -> Prose:
    """Build a plain paragraph."""
    return Prose([(text, BODY)])


def batches(items: Sequence[Item], size: int) -> list[tuple[Item, ...]]:
    """Split the items into groups of a size, in order."""
    return [tuple(items[at : at + size]) for at in range(0, len(items), size)]
