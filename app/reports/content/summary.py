"""The first sentences about an inspection."""

from __future__ import annotations

from app.reports.content.condition import ACT_NOW, condition_of, worst_first
from app.reports.content.cover import abandoned_sentence
from app.reports.content.grades import grade_of
from app.reports.content.translator import NOTHING, Translator
from app.reports.report import Report

MOST_WORST = 15
"""Defects that a summary lists, the worst first; the table has all."""


def opening(report: Report, t: Translator) -> list[str]:
    """Return the first sentences: that the survey was abandoned, if it was, and what is worst."""
    said = (abandoned_sentence(report, t), worst_sentence(report, t))
    return [text for text in said if text]


def worst_sentence(report: Report, t: Translator) -> str:
    """Name the worst defect, or say that nothing was rated."""
    worst = next(iter(worst_first(report)), None)
    if worst is None:
        return t("summary.no_worst")
    return t(
        "summary.worst_at",
        label=t.label(worst),
        place=t.place(worst),
        severity=worst.tag.severity,
        word=t.severity(worst.tag.severity),
    )


def key_figures(report: Report, t: Translator) -> list[tuple[str, str]]:
    """Return names and values of what a reader wants to know first."""
    condition, grade = condition_of(report), grade_of(report)
    met = report.adjusted.distance_class() if report.adjusted else None
    distance_class = NOTHING
    if met is not None:
        percent = met.percent
        distance_class = t("summary.not_met") if percent is None else f"{t.figure(percent)} %"
    share = condition.stretch_percent
    return [
        (t("summary.surveyed"), t.length(report.distance_m)),
        (t("summary.observations"), str(len(report.entries))),
        (t("summary.act_now"), str(condition.counts[ACT_NOW])),
        (t("summary.overall"), t(grade.word) if grade else t("grade.none")),
        (t("summary.distance_class"), distance_class),
        (t("summary.stretches"), NOTHING if share is None else f"{share:.0f} %"),
    ]
