"""The first page: author, asset, and whether the report is final."""

from __future__ import annotations

from dataclasses import dataclass

from reportlab.lib.units import mm
from reportlab.platypus import Flowable, NextPageTemplate, PageBreak, Spacer

from app.reports.content.condition import urgent
from app.reports.content.translator import NOTHING, Translator
from app.reports.pdf.flow import Figure, Prose, Title, height_of, paragraph, say
from app.reports.pdf.grid import pairs
from app.reports.pdf.paper import Paper
from app.reports.pdf.pictures import jpeg_of
from app.reports.pdf.styles import (
    ACCENT,
    ALARM,
    BODY,
    INK,
    RULE,
    SMALL,
    SUBHEADING,
    TITLE,
    WASH,
    WIDTH,
)
from app.reports.pdf.text import Line, draw, lines_of, one_line, shortened
from app.reports.report import Company, Report

_LETTERHEAD_TEXT = 105 * mm
"""Width of name and address, right of the logo."""
_MOST_ADDRESS_LINES = 12


def cover(report: Report, t: Translator) -> list[Flowable]:
    """Build the cover."""
    introduction = report.template.introduction
    return [
        NextPageTemplate("page"),
        *letterhead(report.company, t),
        Title(t("cover.title"), TITLE, after=1 * mm, bookmark=report.asset),
        Prose([(report.asset[:200], TITLE.on(INK))], after=3 * mm),
        Prose([(_where(report), BODY.soft())], after=10 * mm),
        *(band(warned) for warned in warnings_of(report, t)),
        Spacer(0, 6 * mm),
        pairs(cover_rows(report, t)),
        *([Spacer(0, 6 * mm), paragraph(introduction)] if introduction else []),
        PageBreak(),
    ]


def letterhead(company: Company, t: Translator) -> list[Flowable]:
    """Build the logo and, to its right, the name of the company above its address."""
    name = lines_of(company.name or "", SUBHEADING, _LETTERHEAD_TEXT) if company.name else []
    address = lines_of(company.address, SMALL, _LETTERHEAD_TEXT)[:_MOST_ADDRESS_LINES]
    height = max(26 * mm, height_of(name) + height_of(address) + 4 * mm)
    return [
        Figure(height, lambda paper: _letterhead(paper, company, t, height, name, address)),
        Spacer(0, max(4 * mm, 68 * mm - height)),
    ]


def _letterhead(
    paper: Paper,
    company: Company,
    t: Translator,
    height: float,
    name: list[Line],
    address: list[Line],
) -> None:
    logo = jpeg_of(company.logo, 700)
    if logo is not None:
        width, across = logo.size
        scale = min(60 * mm / width, 20 * mm / across)
        x, y = width * scale, height - 20 * mm
        with paper.figure(t("web.logo", company=company.name or ""), (0, y, x, y + 20 * mm)):
            paper.drawImage(logo, 0, y, x, across * scale)
    y = 5 * mm + height_of(address) if address else 8 * mm
    if name or address:
        with paper.element("P"):
            for n, line in enumerate(name):
                above = (len(name) - 1 - n) * SUBHEADING.leading
                draw(paper, WIDTH, y + above, line.text, SUBHEADING, "right")
            for line in address:
                y -= SMALL.leading
                draw(paper, WIDTH, y, line.text, SMALL, "right")
    paper.setStrokeColor(ACCENT)
    paper.setLineWidth(1.2)
    paper.line(0, 0, WIDTH, 0)


def _where(report: Report) -> str:
    names = ("road", "road_chainage", "location_text")
    parts = (str(report.header.get(name) or "").strip() for name in names)
    return " · ".join(one_line(part)[:300] for part in parts if part)


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


def band(warned: Warned) -> Flowable:
    """Build the band of a warning."""

    def paint(canvas: Paper) -> None:
        canvas.setFillColor(ALARM if warned.is_alarm else WASH)
        canvas.setStrokeColor(ALARM if warned.is_alarm else RULE)
        canvas.rect(0, 2 * mm, WIDTH, 9 * mm, 1, 1)
        style = BODY.bold().on(WASH if warned.is_alarm else INK)
        say(canvas, 4 * mm, 5.3 * mm, shortened(warned.text, style, WIDTH - 8 * mm), style)

    return Figure(12 * mm, paint)


def cover_rows(report: Report, t: Translator) -> list[tuple[str, str]]:
    """Return the rows of the cover."""
    header = report.header
    operator = " · ".join(
        str(header[name]) for name in ("operator", "operator_certificate") if header.get(name)
    )
    dates = " ".join(str(header[name]) for name in ("date", "time") if header.get(name))
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
