"""Rows that lead to another page of the document, and name its number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable

from app.reports.pdf.flow import Cell, Column, Grid, Row
from app.reports.pdf.styles import CELL
from app.reports.pdf.text import draw

_DIGITS_WIDTH = 34
"""Room for a page number, to the left of its right end, in points."""


@dataclass(frozen=True)
class Lead:
    """A row that leads to a target."""

    target: str
    """Key of the `Target`."""
    cells: Sequence[Cell]


class Target(Flowable):
    """A place that rows lead to; when it is drawn, the number of its page is known."""

    def __init__(self, key: str) -> None:
        super().__init__()
        self._key = key

    def wrap(self, width: float, height: float) -> tuple[float, float]:
        """Return no size."""
        return 0, 0

    def draw(self) -> None:
        """Fill in the form that the rows draw, and mark the page."""
        canvas = self.canv
        canvas.bookmarkPage(_mark(self._key))
        canvas.beginForm(_form(self._key), -_DIGITS_WIDTH, -6, 0, 15)
        draw(canvas, 0, 0, str(canvas.getPageNumber()), CELL, "right")
        canvas.endForm()


class LeadGrid(Grid):
    """A table with a last column of page numbers, of which every row is a link."""

    def __init__(self, columns: Sequence[Column], leads: Sequence[Lead], *, page: Column) -> None:
        super().__init__([*columns, page], [[*lead.cells, ""] for lead in leads])
        self._page = page
        self._targets: Mapping[int, str] = {
            id(row): lead.target for row, lead in zip(self._rows, leads, strict=True)
        }

    def _part(self, rows: list[Row], after: float) -> LeadGrid:
        part = LeadGrid(self._columns[:-1], (), page=self._page)
        part._rows, part._after, part._targets = rows, after, self._targets
        return part

    def _draw_row(self, row: Row, top: float) -> float:
        below = super()._draw_row(row, top)
        target = self._targets.get(id(row))
        if target is not None:  # else it is the head
            self._lead(self.canv, target, top, below)
        return below

    def _lead(self, canvas: Canvas, target: str, top: float, below: float) -> None:
        canvas.saveState()
        canvas.translate(self._width - 1.1 * mm, top - 3.9 * mm)
        canvas.doForm(_form(target))
        canvas.restoreState()
        canvas.linkRect("", _mark(target), (0, below, self._width, top), relative=1, thickness=0)


def _mark(key: str) -> str:
    return f"to {key}"


def _form(key: str) -> str:
    return f"page-of-{key}"
