"""The first page: author, asset, and whether the report is final."""

from __future__ import annotations

from reportlab.lib.units import mm
from reportlab.platypus import Flowable, NextPageTemplate, PageBreak, Spacer

from app.reports.content.cover import Warned, cover_rows, warnings_of
from app.reports.content.pictures import logo_of
from app.reports.content.translator import Translator
from app.reports.content.typesetting import one_line
from app.reports.pdf.flow import Figure, Prose, Title, height_of, paragraph, say
from app.reports.pdf.grid import pairs
from app.reports.pdf.paper import Paper
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
from app.reports.pdf.text import Line, draw, lines_of, shortened
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
    logo = logo_of(company.logo, 700)
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


def band(warned: Warned) -> Flowable:
    """Build the band of a warning."""

    def paint(canvas: Paper) -> None:
        canvas.setFillColor(ALARM if warned.is_alarm else WASH)
        canvas.setStrokeColor(ALARM if warned.is_alarm else RULE)
        canvas.rect(0, 2 * mm, WIDTH, 9 * mm, 1, 1)
        style = BODY.bold().on(WASH if warned.is_alarm else INK)
        say(canvas, 4 * mm, 5.3 * mm, shortened(warned.text, style, WIDTH - 8 * mm), style)

    return Figure(12 * mm, paint)
