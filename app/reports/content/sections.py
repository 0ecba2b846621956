"""Sections that formats lay out, each in its way: plain data in the words of a language.

An observation is its index in the entries of the report.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

from app.reports.content.condition import condition_of
from app.reports.content.grade_words import SHOWN, class_of, name_of, rule_of, threshold_of
from app.reports.content.grades import Grade, Input, grade_of
from app.reports.content.recommendations import (
    costs_of,
    count_without,
    has_recommendations,
    recommended,
)
from app.reports.content.translator import Translator
from app.reports.report import Report

_EVENTS = 12
"""Most sorts of changes that a history on paper sums up."""


def order_of(report: Report) -> dict[str, int]:
    """Return the index of each entry in the data, by its id."""
    return {entry.id: n for n, entry in enumerate(report.entries)}


def _sentences(report: Report, t: Translator) -> list[str]:
    """Return whose the severities are, how much is stretches, and that the rest was not seen."""
    share = condition_of(report).stretch_percent
    sentences = [t("condition.who")]
    if share is not None:
        sentences.append(t("condition.stretches", percent=f"{share:.0f}"))
    if report.header.get("end_condition") == "abandoned":
        sentences.append(t("condition.abandoned"))
    return sentences


def condition(report: Report, t: Translator) -> dict[str, Any]:
    """Return what follows from the defects: sentences, the grade, and what should be done."""
    grade = grade_of(report)
    return {
        "sentences": _sentences(report, t),
        "grade": _graded(report, grade, t) if grade else None,
        "recommendations": _advice(report, t) if has_recommendations(report) else None,
    }


def _graded(report: Report, grade: Grade, t: Translator) -> dict[str, Any]:
    """Return a grade with its rule, and the defects that it classes or cannot class."""
    order, worst = order_of(report), grade.worst

    def reasoned(found: Input, *why: str) -> dict[str, Any]:
        return {"entry": order[found.entry.id], "why": why}

    more, unclassified = len(grade.inputs) - SHOWN, len(grade.unclassified) - SHOWN
    return {
        "name": name_of(grade, t),
        "word": t(grade.word),
        "deciding": None if worst is None else order[worst.id],
        "place": "" if worst is None else f"{t.place(worst)} · {t.code(worst)}",
        "rule": rule_of(grade, t),
        "inputs": [
            reasoned(found, threshold_of(grade, found, t), class_of(grade, found, t))
            for found in grade.inputs[:SHOWN]
        ],
        "more": t("grade.more", n=more) if more > 0 else "",
        "unclassified": [reasoned(found, t(found.why)) for found in grade.unclassified[:SHOWN]],
        "more_unclassified": (
            t("grade.more_unclassified", n=unclassified) if unclassified > 0 else ""
        ),
    }


def _advice(report: Report, t: Translator) -> dict[str, Any]:
    """Return what people accepted for the defects, and the sums of its costs."""
    costs, order = costs_of(report), order_of(report)
    currency = report.template.currency
    return {
        "rows": [
            {
                "entry": order[entry.id],
                "text": entry.tag.recommendation or "",
                "cost": "" if entry.tag.cost is None else t.amount(entry.tag.cost),
            }
            for entry in recommended(report)
        ],
        "without": t("recommendation.without", n=count_without(report)),
        "cost_head": t("sheet.cost", currency=currency) if costs else "",
        "sums": [
            {"severity": severity, "name": t.severity(severity), "cost": t.amount(amount)}
            for severity, amount in (costs.by_severity if costs else {}).items()
        ],
        "total": t.amount(costs.total) if costs else "",
    }


def checks(report: Report, t: Translator) -> dict[str, Any]:
    """Return what is to be resolved, who did what, and what is signed."""
    entries = {entry.id: entry for entry in report.entries}
    counts = Counter((event.who, t.action(event)) for event in report.events)
    last = report.events[-1] if report.events else None
    header = report.header
    certificate = header.get("operator_certificate")
    return {
        "issues": [
            {
                "level": t(f"sign.{issue.level}"),
                "is_blocking": issue.level == "block",
                "text": t.issue(issue, entries),
            }
            for issue in report.issues
        ],
        "history": [
            (who, action, str(count)) for (who, action), count in counts.most_common(_EVENTS)
        ],
        "last": (
            t("sign.last", at=t.instant(last.at), who=last.who, n=len(report.events))
            if last
            else ""
        ),
        "statements": [
            f"{t('cover.review')}: {t.review(report)}.",
            *(
                t(
                    "sign.proposals",
                    detector=count.detector,
                    total=count.total,
                    accepted=count.accepted,
                    rejected=count.rejected,
                )
                for count in report.proposals
            ),
            t("sign.statement", report=report.id, revision=report.revision),
        ],
        "people": [
            (
                t("sign.operator"),
                str(header.get("operator") or ""),
                t("sign.certificate", certificate=certificate) if certificate else "",
            ),
            (t("sign.reviewer"), str(header.get("reviewer") or ""), ""),
        ],
    }
