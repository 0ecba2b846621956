"""The workbook that a licence holder fills in: a made-up code pack, and what each column is for."""

from __future__ import annotations

import io
import re

import xlsxwriter

from app.imports.workbook import CODES, RATINGS
from app.reports.tables.cells import Cells
from app.survey.catalogue import example_pack
from app.survey.catalogue.columns import NEEDED, OPTIONAL, RATING_NEEDED, RATING_OPTIONAL
from app.survey.catalogue.read import RATING
from vo_core.csv_rows import records

MEDIA_TYPE = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"
_HELP = "help"
_NUMBER = re.compile(r"-?[0-9]+([.][0-9]+)?")
_WIDTHS = {"label": 36, "code": 10, RATING: 12, "of": 20}


def pack_template() -> bytes:
    """Return the workbook: the sheets `codes`, `ratings` and `help`; the import ignores the
    last.
    """
    out = io.BytesIO()
    book = xlsxwriter.Workbook(out, {"in_memory": True})
    cells = Cells(book)
    rows = [row for _, row in records(example_pack().decode())]
    first = next(number for number, row in enumerate(rows) if row[0] == RATING)
    explained = [
        [sheet, column, "yes" if is_needed else "no", text]
        for sheet, columns, is_needed in (
            (CODES, NEEDED, True), (CODES, OPTIONAL, False),
            (RATINGS, RATING_NEEDED, True), (RATINGS, RATING_OPTIONAL, False),
        )
        for column, text in columns.items()
    ]  # fmt: skip
    heads = ["sheet", "column", "needed", "what it is for"]
    for name, table in (
        (CODES, rows[:first]), (RATINGS, rows[first:]), (_HELP, [heads, *explained])
    ):  # fmt: skip
        sheet = book.add_worksheet(name)
        for number, row in enumerate(table):
            for column, text in enumerate(row):
                if number and _NUMBER.fullmatch(text):
                    sheet.write_number(number, column, float(text))
                else:
                    cells.text(sheet, number, column, text, bold=number == 0)
        for column, head in enumerate(table[0]):
            sheet.set_column(column, column, _WIDTHS.get(head[:5], 12))
        sheet.freeze_panes(1, 1)
    sheet.set_column(3, 3, 90)
    book.close()
    return out.getvalue()
