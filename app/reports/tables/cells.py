"""Cells of a workbook: their looks, and texts that are never a formula."""

from __future__ import annotations

import math
from typing import Any

from xlsxwriter import Workbook
from xlsxwriter.format import Format
from xlsxwriter.worksheet import Worksheet

from app.reports.text.legible import legible
from vo_core.csv_rows import is_like_formula

LONGEST_TEXT = 32_767
"""Characters that a cell can hold in the programs that read it."""
LINE_PT = 13.0
"""Height of a line."""
_SPARE = 1.1
"""Width of wrapped texts against that of their letters, since lines end between words."""


class Cells:
    """Writes cells of a workbook; equal looks share one format."""

    def __init__(self, book: Workbook) -> None:
        self._book = book
        self._formats: dict[tuple[tuple[str, Any], ...], Format] = {}

    def look(self, **properties: Any) -> Format:
        """Return the format with these properties of XlsxWriter."""
        key = tuple(sorted(properties.items()))
        if key not in self._formats:
            self._formats[key] = self._book.add_format({"valign": "top", **properties})
        return self._formats[key]

    def text(self, sheet: Worksheet, row: int, column: int, text: str, **properties: Any) -> None:
        """Write a text as it is, cut to what a cell holds."""
        shown = cell_text(text)[:LONGEST_TEXT]
        if is_like_formula(shown):
            # Like text typed after an apostrophe: it stays text when somebody edits the cell.
            properties = {**properties, "quote_prefix": True}
        sheet.write_string(row, column, shown, self.look(**properties))


def cell_text(text: str) -> str:
    """Clean a text; lines end with LF alone, since a workbook stores CR as _x000D_, which some
    programs show.
    """
    return legible(text).replace("\r\n", "\n").replace("\r", "\n")


def lines_of(text: str, width: float) -> int:
    """Return about how many lines a wrapped text has, in a column of a width in characters."""
    return sum(max(1, math.ceil(len(line) * _SPARE / width)) for line in text.split("\n"))


_A4 = 9
"""Number of the paper in the file format."""


def fit_on_page(sheet: Worksheet, *, head: int = 0) -> None:
    """Print on A4 across, one page wide, with a row of heads on each page."""
    sheet.set_landscape()
    sheet.set_paper(_A4)
    sheet.fit_to_pages(1, 0)
    sheet.repeat_rows(head)
