"""What the first page says: who, where, when, and whether the report is final."""

from __future__ import annotations

from dataclasses import dataclass

from app.reports.content.condition import urgent
from app.reports.content.translator import NOTHING, Translator
from app.reports.report import Report
from app.reports.text.typesetting import one_line


@dataclass(frozen=True)
class Warned:
    """A warning that must not be overlooked."""

    text: str
    is_alarm: bool


def warnings_of(report: Report, t: Translator) -> list[Warned]:
    """Return the warnings: immediate action, an incomplete survey, a draft."""
    warnings = []
    if entries := urgent(report):
        place, label = t.place(entries[0]), t.label(entries[0])
        more = t("cover.more", n=len(entries) - 1) if len(entries) > 1 else ""
        text = t("cover.act_now", label=label, place=place) + more
        warnings.append(Warned(text, is_alarm=True))
    if abandoned := abandoned_sentence(report, t):
        warnings.append(Warned(abandoned, is_alarm=False))
    blocking = sum(issue.level == "block" for issue in report.issues)
    if blocking:
        text = t("cover.draft", n=blocking)
        if "checks" in report.template.sections:
            text += f" {t('cover.see', part=t('sign.title'))}"
        warnings.append(Warned(text, is_alarm=False))
    return warnings


def abandoned_sentence(report: Report, t: Translator) -> str:
    """Say that the survey was abandoned and, if stated, why; empty if it was not."""
    if report.header.get("end_condition") != "abandoned":
        return ""
    reason = one_line(str(report.header.get("abandon_reason") or ""))
    return t("cover.abandoned_for", reason=reason) if reason else t("cover.abandoned")


def cover_rows(report: Report, t: Translator) -> list[tuple[str, str]]:
    """Return the rows of the cover."""
    header = report.header
    operator = " · ".join(
        str(header[name]) for name in ("operator", "operator_certificate") if header.get(name)
    )
    dates = " ".join(t.date(str(header[name])) for name in ("date", "time") if header.get(name))
    standard = " ".join(str(header[name]) for name in ("standard", "edition") if header.get(name))
    nodes = [str(header.get(name) or NOTHING) for name in ("start_node", "end_node")]
    return [
        (t("cover.client"), str(header.get("client") or NOTHING)),
        (t("cover.contractor"), str(header.get("contractor") or NOTHING)),
        (t("cover.job"), str(header.get("job_ref") or NOTHING)),
        (t("cover.nodes"), t("cover.from_to", start=nodes[0], end=nodes[1])),
        (t("cover.inspected"), dates or NOTHING),
        (t("cover.operator"), operator or NOTHING),
        (t("cover.length"), _length(report, t)),
        (t("cover.standard"), standard or NOTHING),
        (t("cover.pack"), report.pack),
        (
            t("cover.report"),
            t("cover.version", report=report.id, revision=report.revision),
        ),
        (t("cover.review"), t.review(report)),
        (t("cover.made"), t.instant(report.made_at)),
    ]


def _length(report: Report, t: Translator) -> str:
    if report.distance_m is None:
        return t("entry.not_tracked")
    surveyed = t.length(report.distance_m)
    if report.u95_m is not None:
        surveyed += f" ± {t.half_width(report.u95_m)} {report.units}"
    known = report.header.get("known_length_m")
    if isinstance(known, int | float) and not isinstance(known, bool):
        return t("cover.of_length", surveyed=surveyed, known=t.length(known))
    return surveyed
