"""The first sentences about an inspection."""

from __future__ import annotations

from app.reports.content.condition import worst_first
from app.reports.content.cover import abandoned_sentence
from app.reports.content.translator import Translator
from app.reports.report import Report


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
