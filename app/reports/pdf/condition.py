"""The grade of the asset with its rule and its inputs, the counts, and the recommendations."""

from __future__ import annotations

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import CondPageBreak, Flowable

from app.reports.content.condition import SEVERITIES, Condition, condition_of
from app.reports.content.grade_words import SHOWN, class_of, rule_of, threshold_of
from app.reports.content.grades import Grade, Input, grade_of
from app.reports.content.recommendations import (
    Costs,
    costs_of,
    count_without,
    has_recommendations,
    recommended,
)
from app.reports.content.translator import NOTHING, Translator
from app.reports.pdf.flow import BADGE, Figure, Heading, Prose, draw_badge, note
from app.reports.pdf.grid import Badge, Cell, Column, Grid
from app.reports.pdf.styles import (
    ACCENT,
    BODY,
    CELL,
    INK,
    SEVERITY,
    SUBHEADING,
    WASH,
    WIDTH,
)
from app.reports.pdf.text import draw, shortened
from app.reports.report import Report

_ROW = 7 * mm
_DECIDING = 84 * mm
"""Where the deciding defect stands beside the grade."""


def condition(report: Report, t: Translator) -> list[Flowable]:
    """Build the grade, the counts, the rule, what the grade follows from, and recommendations."""
    found, grade = condition_of(report), grade_of(report)
    texts = [(t("condition.who"), BODY.soft())]
    if found.stretch_percent is not None:
        share = t("condition.stretches", percent=f"{found.stretch_percent:.0f}")
        texts.append((share, BODY))
    if report.header.get("end_condition") == "abandoned":
        texts.append((t("condition.abandoned"), BODY))
    return [
        Heading(t("condition.title")),
        *([_overall(grade, t)] if grade else []),
        _counts(found, t),
        *(Prose([text]) for text in texts),
        *(_reasons(grade, t) if grade else []),
        *(_recommendations(report, t) if has_recommendations(report) else []),
    ]


def _overall(grade: Grade, t: Translator) -> Flowable:
    name = t("condition.overall") if grade.rule == "own" else t("grade.structural")
    worst = grade.worst
    deciding = f"{t.place(worst)} · {t.code(worst)}" if worst else ""

    def paint(canvas: Canvas) -> None:
        canvas.setFillColor(WASH)
        canvas.rect(0, 4 * mm, WIDTH, 19 * mm, 0, 1)
        draw(canvas, 5 * mm, 17 * mm, name, CELL.soft())
        style = type(SUBHEADING)(16, 20, 600, ACCENT)
        draw(canvas, 5 * mm, 9 * mm, shortened(t(grade.word), style, _DECIDING - 8 * mm), style)
        if worst is not None:
            draw(canvas, _DECIDING, 17 * mm, t("condition.deciding"), CELL.soft())
            draw_badge(canvas, _DECIDING, 9.2 * mm, worst.tag.severity)
            room = WIDTH - _DECIDING - BADGE - 4 * mm
            text = shortened(deciding, BODY.bold(), room)
            draw(canvas, _DECIDING + BADGE + 2 * mm, 9.8 * mm, text, BODY.bold())

    alt = f"{name}: {t(grade.word)}."
    if worst is not None:
        alt += f" {t('condition.deciding')}: {deciding}."
    return Figure(24 * mm, paint, alt=alt)


def _reasons(grade: Grade, t: Translator) -> list[Flowable]:
    """Build the rule with its source, and the defects that it classes or cannot class."""
    rule, *others = rule_of(grade, t)
    parts: list[Flowable] = [
        Heading(t("condition.rule_title"), level=1, bookmark=False),
        Prose([(rule, BODY)]),
        *(Prose([(text, BODY.bold() if text == others[-1] else BODY)]) for text in others),
        Heading(t("grade.inputs"), level=1, bookmark=False),
    ]
    if grade.inputs:
        rows = [
            (*_defect(found, t), threshold_of(grade, found, t), class_of(grade, found, t))
            for found in grade.inputs[:SHOWN]
        ]
        heads = (t("grade.threshold"), t("grade.class"))
        parts.append(Grid((*_defect_columns(t), *_last_columns(*heads)), rows))
        if rest := len(grade.inputs) - SHOWN:
            parts += [note(t("grade.more", n=rest))] if rest > 0 else []
    else:
        parts.append(note(t("grade.no_inputs")))
    if grade.unclassified:
        parts += [
            CondPageBreak(30 * mm),
            Heading(t("grade.unclassified"), level=1, bookmark=False),
            note(t("grade.unclassified_note")),
            Grid(
                (*_defect_columns(t), Column(t("grade.reason"), 58 * mm)),
                [(*_defect(found, t), t(found.why)) for found in grade.unclassified[:SHOWN]],
            ),
        ]
        if (rest := len(grade.unclassified) - SHOWN) > 0:
            parts.append(note(t("grade.more_unclassified", n=rest)))
    return parts


def _defect_columns(t: Translator) -> tuple[Column, ...]:
    return (
        Column(t("entry.no"), 10 * mm, "right"),
        Column(t("entry.place"), 31 * mm, "right"),
        Column(t("entry.code"), 17 * mm),
        Column(t("entry.what"), 42 * mm),
        Column(t("entry.quantity"), 16 * mm, "right"),
    )


def _last_columns(threshold: str, value: str) -> tuple[Column, ...]:
    return (Column(threshold, 29 * mm), Column(value, 29 * mm))


def _defect(found: Input, t: Translator) -> tuple[Cell, ...]:
    entry = found.entry
    return (
        str(entry.number),
        t.short_place(entry),
        [(t.code(entry), CELL.bold())],
        t.label(entry),
        [(quantity, CELL) for quantity in t.quantities(entry)],
    )


def _recommendations(report: Report, t: Translator) -> list[Flowable]:
    """Build what people accepted for the defects, and the sums of its costs."""
    entries, costs = recommended(report), costs_of(report)
    without = note(t("recommendation.without", n=count_without(report)))
    title = [CondPageBreak(40 * mm), Heading(t("recommendation.title"), level=1, bookmark=False)]
    if not entries:
        return [*title, note(t("recommendation.none")), without]
    currency = report.template.currency
    cost = [Column(t("sheet.cost", currency=currency), 24 * mm, "right")] if costs else []
    columns = (
        Column(t("entry.no"), 10 * mm, "right"),
        Column(t("entry.place"), 31 * mm, "right"),
        Column(t("entry.code"), 17 * mm),
        Column(t("entry.severity_short"), 9 * mm),
        Column(t("sheet.recommendation"), (83 if costs else 107) * mm),
        *cost,
    )
    rows: list[tuple[Cell, ...]] = [
        (
            str(entry.number),
            t.short_place(entry),
            [(t.code(entry), CELL.bold())],
            Badge(entry.tag.severity),
            entry.tag.recommendation or "",
            *([_amount(entry.tag.cost, t)] if costs else []),
        )
        for entry in entries
    ]
    return [*title, Grid(columns, rows), without, *_sums(costs, currency, t)]


def _sums(costs: Costs | None, currency: str, t: Translator) -> list[Flowable]:
    """Build the table of the costs by severity; nothing without costs."""
    if costs is None or not costs.by_severity:
        return []
    columns = (
        Column(t("entry.severity_short"), 12 * mm),
        Column("", 60 * mm),
        Column(t("sheet.cost", currency=currency), 34 * mm, "right"),
    )
    rows: list[tuple[Cell, ...]] = [
        (Badge(severity), t.severity(severity), t.amount(amount))
        for severity, amount in costs.by_severity.items()
    ]
    total = [(t("recommendation.total"), CELL.bold())], [(t.amount(costs.total), CELL.bold())]
    title = Heading(t("recommendation.costs"), level=1, bookmark=False)
    return [CondPageBreak(40 * mm), title, Grid(columns, [*rows, ("", *total)])]


def _amount(cost: float | None, t: Translator) -> str:
    return "" if cost is None else t.amount(cost)


def _counts(found: Condition, t: Translator) -> Flowable:
    """Build a bar for each severity, the severest first."""
    rows = [
        *((severity, found.counts[severity]) for severity in reversed(SEVERITIES)),
        (None, found.unrated),
    ]
    most = max(1, *(count for _, count in rows))
    start, room = 62 * mm, WIDTH - 75 * mm

    def paint(canvas: Canvas) -> None:
        y = len(rows) * _ROW + 4 * mm
        for severity, count in rows:
            y -= _ROW
            draw_badge(canvas, 0, y + 1.4 * mm, severity)
            draw(canvas, BADGE + 2.5 * mm, y + 2.1 * mm, t.severity(severity), CELL)
            canvas.setFillColor(WASH if severity is None else SEVERITY[severity])
            canvas.setStrokeColor(INK)
            canvas.setLineWidth(0.35)
            if count:
                canvas.rect(start, y + 1.2 * mm, room * count / most, 4 * mm, 1, 1)
            text = str(count) if count else NOTHING
            x = start + room * count / most + 2 * mm
            draw(canvas, x, y + 2.1 * mm, text, CELL.bold())

    counted = ", ".join(f"{t.severity(severity)} {count}" for severity, count in rows)
    alt = t("condition.counts", counts=counted)
    return Figure(len(rows) * _ROW + 8 * mm, paint, alt=alt)
