"""The report as a PDF: vectors, embedded fonts, bookmarks; one module for each part."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from reportlab.platypus import Flowable, PageBreak

from app.reports.content.translator import Translator
from app.reports.pdf.condition import condition
from app.reports.pdf.cover import cover
from app.reports.pdf.glyphs import missing_glyphs
from app.reports.pdf.header_sheet import header_sheet
from app.reports.pdf.measurement import measurement
from app.reports.pdf.observations import observations
from app.reports.pdf.pages import made
from app.reports.pdf.photos import photos
from app.reports.pdf.pipe_graphic import pipe_graphic
from app.reports.pdf.sign_off import closing, sign_off
from app.reports.pdf.summary import summary
from app.reports.pdf.unrolled_wall import unrolled_wall
from app.reports.report import Report, Written
from app.reports.template import ReportTemplate, Section

Part = Callable[[Report, Translator], list[Flowable]]

PARTS: Mapping[Section, Part] = {
    "summary": summary,
    "header": header_sheet,
    "graphic": pipe_graphic,
    "observations": observations,
    "photos": photos,
    "wall": unrolled_wall,
    "condition": condition,
    "measurement": measurement,
    "checks": sign_off,
}
"""What may follow the cover."""


def parts_of(template: ReportTemplate) -> list[Part]:
    """Return the parts that a template chooses, in its order; without the signatures, the closing
    text stands alone.
    """
    chosen = [PARTS[section] for section in template.sections if section in PARTS]
    return [cover, *chosen, *([] if sign_off in chosen else [closing])]


def story_of(report: Report, t: Translator) -> list[Flowable]:
    """Build the parts that the report's template chooses."""
    story = [piece for part in parts_of(report.template) for piece in part(report, t)]
    if isinstance(story[-1], PageBreak):
        story.pop()  # a cover alone is not followed by an empty page
    return story


def write(report: Report) -> Written:
    """Write the chosen parts in the report's language and units."""
    t = Translator.of(report)
    return Written(made(report, t, t("cover.title"), story_of(report, t)), missing_glyphs(report))
