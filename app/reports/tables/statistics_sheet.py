"""The second sheet of the workbook, for people: counts, costs, and what the grade follows from."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

from xlsxwriter import Workbook
from xlsxwriter.worksheet import Worksheet

from app.reports.content.condition import SEVERITIES, condition_of
from app.reports.content.grade_words import class_of, rule_of, threshold_of
from app.reports.content.grades import Input, grade_of
from app.reports.content.recommendations import costs_of, count_without
from app.reports.content.translator import Translator
from app.reports.report import Entry, Report
from app.reports.tables.cells import LINE_PT, Cells, fit_on_page, lines_of

_NUMBERS, _TEXTS = (12, 14, 12, 16), (18, 44, 16, 22, 24)
"""Widths of the columns, in characters: those of numbers are before those of texts, so that none
has both."""
_WIDTHS = (*_NUMBERS, *_TEXTS)


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
        look = self._cells.look(text_wrap=True)
        self._sheet.merge_range(self._row, 0, self._row, len(_WIDTHS) - 1, "", look)
        self._cells.text(self._sheet, self._row, 0, text, text_wrap=True)
        self._sheet.set_row(self._row, lines_of(text, sum(_WIDTHS)) * LINE_PT + 2)
        self._row += 1

    def table(
        self,
        numbers: Sequence[str],
        texts: Sequence[str],
        rows: Iterable[tuple[Sequence[float | None], Sequence[str]]],
    ) -> None:
        """Write a table, given the heads and in each row the cells of its numbers and texts."""
        for start, heads in ((0, numbers), (len(_NUMBERS), texts)):
            for column, head in enumerate(heads, start):
                self._cells.text(self._sheet, self._row, column, head, bold=True, bottom=1)
        for values, said in rows:
            self._row += 1
            for column, value in enumerate(values):
                if value is not None:
                    look = {"num_format": "#,##0.00"} if isinstance(value, float) else {}
                    self._sheet.write_number(self._row, column, value, self._cells.look(**look))
            for column, text in enumerate(said, len(_NUMBERS)):
                self._cells.text(self._sheet, self._row, column, text, text_wrap=True)
        self._row += 1


def add(book: Workbook, cells: Cells, report: Report, t: Translator) -> None:
    """Add the sheet."""
    sheet = book.add_worksheet(t("sheet.statistics"))
    for number, width in enumerate(_WIDTHS):
        sheet.set_column(number, number, width)
    fit_on_page(sheet)
    out = _Sheet(sheet, cells, report.template.accent)
    out.title(f"{report.asset} · {t('sheet.statistics')}", size=15)
    _severities(out, report, t)
    _codes(out, report, t)
    _grade(out, report, t)


def _severities(out: _Sheet, report: Report, t: Translator) -> None:
    condition, costs = condition_of(report), costs_of(report)
    out.title(t("sheet.by_severity"))
    by_severity = costs.by_severity if costs else {}
    counts: list[tuple[int | None, int]] = [
        *((severity, condition.counts[severity]) for severity in reversed(SEVERITIES)),
        (None, condition.unrated),
    ]
    rows: list[tuple[Sequence[float | None], Sequence[str]]] = [
        ((severity, count, by_severity.get(severity)), (t.severity(severity),))
        for severity, count in counts
    ]
    heads = [t("entry.severity_short"), t("sheet.defects")]
    if costs is not None:
        heads.append(t("sheet.cost", currency=report.template.currency))
        rows.append(((None, None, costs.total), (t("sheet.total"),)))
    out.table(heads, [t("sheet.severity")], rows)
    out.note(t("recommendation.without", n=count_without(report)))


def _codes(out: _Sheet, report: Report, t: Translator) -> None:
    found: dict[str, list[Entry]] = defaultdict(list)
    for entry in report.defects:
        found[t.code(entry)].append(entry)
    out.title(t("sheet.by_code"))
    rows = []
    for code, entries in sorted(found.items()):
        rated = [one.tag.severity for one in entries if one.tag.severity is not None]
        rows.append(((max(rated, default=None), len(entries)), (code, t.label(entries[0]))))
    out.table((t("sheet.worst"), t("sheet.defects")), (t("entry.code"), t("entry.what")), rows)


def _grade(out: _Sheet, report: Report, t: Translator) -> None:
    grade = grade_of(report)
    if grade is None:
        return
    out.title(f"{t('grade.title')}: {t(grade.word)}")
    for sentence in rule_of(grade, t):
        out.note(sentence)
    numbers = (
        t("entry.no"), t("sheet.distance", unit=t.units), t("sheet.half_width", unit=t.units),
    )  # fmt: skip
    texts = (t("entry.code"), t("entry.what"), t("entry.quantity"))
    if grade.inputs:
        out.table(
            numbers,
            (*texts, t("grade.threshold"), t("grade.class")),
            (
                (_figures(one, t), (*_words(one, t), threshold_of(grade, one, t),
                                    class_of(grade, one, t)))
                for one in grade.inputs
            ),
        )  # fmt: skip
    else:
        out.note(t("grade.no_inputs"))
    if grade.unclassified:
        out.title(t("grade.unclassified"))
        out.note(t("grade.unclassified_note"))
        out.table(
            numbers,
            (*texts, t("grade.reason")),
            ((_figures(one, t), (*_words(one, t), t(one.why))) for one in grade.unclassified),
        )


def _figures(found: Input, t: Translator) -> Sequence[float | None]:
    return found.entry.number, *t.cells(found.entry)


def _words(found: Input, t: Translator) -> Sequence[str]:
    entry = found.entry
    return t.code(entry), t.label(entry), ", ".join(t.quantities(entry))
