"""A grade in words: its rule with its source, and why each defect has its class."""

from __future__ import annotations

from app.reports.content.condition import CLEANED_AWAY
from app.reports.content.grades import Grade, Input
from app.reports.content.translator import Translator

SHOWN = 60
"""Most defects that a page lists with their classes; the workbook lists all."""


def rule_of(grade: Grade, t: Translator) -> list[str]:
    """Return the rule, its source, and what the grade is not, in sentences."""
    if grade.rule == "own":
        rule = t("condition.rule", codes=", ".join(CLEANED_AWAY))
        return [rule, t(grade.source), t("condition.not_a_grade")]
    return [t("grade.structural_rule"), t(grade.source), t("grade.structural_not")]


def threshold_of(grade: Grade, found: Input, t: Translator) -> str:
    """Return what gives a defect its class: its severity, or the range of its quantity."""
    if grade.rule == "own":
        return f"{found.threshold} · {t.severity(found.entry.tag.severity)}"
    return found.threshold or t("grade.any")


def class_of(grade: Grade, found: Input, t: Translator) -> str:
    """Return the class of a defect, and whether it decides."""
    value = t(f"overall.{found.value}") if grade.rule == "own" else str(found.value)
    return f"{value} · {t('grade.decides')}" if grade.decides(found) else value
