"""A grade in words: its rule with its source, and why each defect has its class."""

from __future__ import annotations

from app.reports.content.condition import CLEANED_AWAY
from app.reports.content.grades import Grade, Input
from app.reports.content.translator import Translator
from app.survey.catalogue.ratings import Rated

SHOWN = 60
"""Most defects that a page lists with their classes; the workbook lists all."""


def rule_of(grade: Grade, t: Translator) -> list[str]:
    """Return the rule, its source, and what the grade is not, in sentences."""
    if grade.rule == "own":
        rule = t("condition.rule", codes=", ".join(CLEANED_AWAY))
        return [rule, t(grade.source), t("condition.not_a_grade")]
    if grade.rule == "pack":
        said = [_rating_of(one, t) for one in grade.rated]
        return [t("grade.pack_rule", pack=grade.pack), *said, t(grade.source)]
    return [t("grade.structural_rule"), t(grade.source), t("grade.structural_not")]


def name_of(grade: Grade, t: Translator) -> str:
    """Return what the grade is called."""
    if grade.rule == "pack":
        return grade.rated[-1].rating.label_in(t.language)
    return t("condition.overall") if grade.rule == "own" else t("grade.structural")


def _rating_of(rated: Rated, t: Translator) -> str:
    """Return what a rating of a pack makes of the asset: `Shell, quick: 5×1 3×4 (grade 5)`."""
    value = rated.quick or ("–" if rated.value is None else t.figure(round(rated.value, 2)))
    rule = t(f"rule.{rated.rating.rule}")
    said = f"{rated.rating.label_in(t.language)} ({rule}): {value}"
    return said if rated.grade is None else f"{said} → {t('grade.of_pack', grade=rated.grade)}"


def threshold_of(grade: Grade, found: Input, t: Translator) -> str:
    """Return what gives a defect its class: its severity, or the range of its quantity."""
    if grade.rule == "own":
        return f"{found.threshold} · {t.severity(found.entry.tag.severity)}"
    return found.threshold or t("grade.any")


def class_of(grade: Grade, found: Input, t: Translator) -> str:
    """Return the class of a defect, and whether it decides."""
    value = t(f"overall.{found.value}") if grade.rule == "own" else f"{found.value:g}"
    return f"{value} · {t('grade.decides')}" if grade.decides(found) else value
