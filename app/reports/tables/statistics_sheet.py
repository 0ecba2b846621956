"""The second sheet of the workbook, for people: counts, costs, and what the grade follows from."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

from xlsxwriter import Workbook
from xlsxwriter.worksheet import Worksheet

from app.reports.content.condition import SEVERITIES, condition_of
from app.reports.content.grade_words import class_of, rule_of, threshold_of
from app.reports.content.grades import grade_of
from app.reports.content.recommendations import costs_of, count_without
from app.reports.content.translator import Translator
from app.reports.report import Entry, Report
from app.reports.tables.cells import LINE_PT, Cells, lines_of

Value = str | float | None
_WIDTHS = (14, 22, 20, 44, 16, 20, 18)
"""Of the columns, in characters."""


class _Sheet:
    """A sheet that grows downwards."""

    def __init__(self, sheet: Worksheet, cells: Cells, accent: str) -> None:
        self._sheet = sheet
        self._cells = cells
        self._accent = accent
        self._row = 0

    def title(self, text: str, *, size: int = 12) -> None:
        self._row += self._row > 0
        look = {"bold": True, "font_size": size, "font_color": self._accent}
        self._cells.text(self._sheet, self._row, 0, text, **look)
        self._row += 1

    def note(self, text: str) -> None:
        """Write a sentence over the width of the sheet."""
        last = len(_WIDTHS) - 1
        look = self._cells.look(text_wrap=True)
        self._sheet.merge_range(self._row, 0, self._row, last, "", look)
        self._cells.text(self._sheet, self._row, 0, text, text_wrap=True)
        self._sheet.set_row(self._row, lines_of(text, sum(_WIDTHS)) * LINE_PT + 2)
        self._row += 1

    def table(self, heads: Sequence[str], rows: Iterable[Sequence[Value]]) -> None:
        for number, head in enumerate(heads):
            self._cells.text(self._sheet, self._row, number, head, bold=True, bottom=1)
        for row in rows:
            self._row += 1
            for number, value in enumerate(row):
                self._put(number, value)
        self._row += 1

    def _put(self, number: int, value: Value) -> None:
        if isinstance(value, str):
            self._cells.text(self._sheet, self._row, number, value, text_wrap=True)
        elif value is not None:
            look = {"num_format": "#,##0.00"} if isinstance(value, float) else {}
            self._sheet.write_number(self._row, number, value, self._cells.look(**look))


def add(book: Workbook, cells: Cells, report: Report, t: Translator) -> None:
    """Add the sheet."""
    sheet = book.add_worksheet(t("sheet.statistics"))
    for number, width in enumerate(_WIDTHS):
        sheet.set_column(number, number, width)
    sheet.set_landscape()
    sheet.set_paper(9)
    sheet.fit_to_pages(1, 0)
    out = _Sheet(sheet, cells, report.template.accent)
    out.title(f"{report.asset} · {t('sheet.statistics')}", size=15)
    _severities(out, report, t)
    _codes(out, report, t)
    _grade(out, report, t)


def _severities(out: _Sheet, report: Report, t: Translator) -> None:
    condition, costs = condition_of(report), costs_of(report)
    out.title(t("sheet.by_severity"))
    heads = [t("sheet.severity"), "", t("sheet.defects")]
    if costs is not None:
        heads.append(t("sheet.cost", currency=report.template.currency))
    by_severity = costs.by_severity if costs else {}
    counts: list[tuple[int | None, int]] = [
        *((severity, condition.counts[severity]) for severity in reversed(SEVERITIES)),
        (None, condition.unrated),
    ]
    rows: list[Sequence[Value]] = [
        (severity, t.severity(severity), count, by_severity.get(severity))
        for severity, count in counts
    ]
    if costs is not None:
        rows.append((t("sheet.total"), None, None, costs.total))
    out.table(heads, rows)
    out.note(t("recommendation.without", n=count_without(report)))


def _codes(out: _Sheet, report: Report, t: Translator) -> None:
    """List every code with its number of defects and its worst severity."""
    found: dict[str, list[Entry]] = defaultdict(list)
    for entry in report.defects:
        found[t.code(entry)].append(entry)
    out.title(t("sheet.by_code"))
    heads = (t("entry.code"), t("sheet.defects"), t("sheet.worst"), t("entry.what"))
    out.table(
        heads,
        (
            (
                code,
                len(entries),
                max((entry.tag.severity for entry in entries if entry.tag.severity is not None),
                    default=None),
                t.label(entries[0]),
            )
            for code, entries in sorted(found.items())
        ),
    )  # fmt: skip


def _grade(out: _Sheet, report: Report, t: Translator) -> None:
    """Print the grade with its rule, its source and every defect that it follows from."""
    grade = grade_of(report)
    if grade is None:
        return
    out.title(f"{t('grade.title')}: {t(grade.word)}")
    for sentence in rule_of(grade, t):
        out.note(sentence)
    heads = (
        t("entry.no"), t("entry.place"), t("entry.code"), t("entry.what"), t("entry.quantity"),
        t("grade.threshold"), t("grade.class"),
    )  # fmt: skip
    if grade.inputs:
        rows = (
            (
                str(found.entry.number), t.place(found.entry), t.code(found.entry),
                t.label(found.entry), ", ".join(t.quantities(found.entry)),
                threshold_of(grade, found, t), class_of(grade, found, t),
            )
            for found in grade.inputs
        )  # fmt: skip
        out.table(heads, rows)
    else:
        out.note(t("grade.no_inputs"))
    if grade.unclassified:
        out.title(t("grade.unclassified"))
        out.note(t("grade.unclassified_note"))
        out.table(
            (*heads[:5], t("grade.reason")),
            (
                (
                    str(found.entry.number), t.place(found.entry), t.code(found.entry),
                    t.label(found.entry), ", ".join(t.quantities(found.entry)), t(found.why),
                )
                for found in grade.unclassified
            ),
        )  # fmt: skip
