"""The report as a PDF: vectors, embedded fonts, bookmarks; one module for each part."""

from __future__ import annotations

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
from app.reports.pdf.sign_off import sign_off
from app.reports.pdf.summary import summary
from app.reports.pdf.unrolled_wall import unrolled_wall
from app.reports.report import Report, Written

PARTS = (
    cover, summary, header_sheet, pipe_graphic, observations, photos, unrolled_wall, condition,
    measurement, sign_off,
)  # fmt: skip
"""Parts in the order of the pages."""


def write(report: Report) -> Written:
    """Write all parts in the report's language and units."""
    t = Translator.of(report)
    story = [piece for part in PARTS for piece in part(report, t)]
    return Written(made(report, t, t("cover.title"), story), missing_glyphs(report))
