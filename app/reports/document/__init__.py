"""The report as a PDF: vectors, embedded fonts, bookmarks; one module for each of its parts."""

from __future__ import annotations

from app.reports.document.condition import condition
from app.reports.document.cover import cover
from app.reports.document.header_sheet import header_sheet
from app.reports.document.measurement import measurement
from app.reports.document.observations import observations
from app.reports.document.pages import made
from app.reports.document.photos import photos
from app.reports.document.pipe_graphic import pipe_graphic
from app.reports.document.sign_off import sign_off
from app.reports.document.summary import summary
from app.reports.document.telling import Teller
from app.reports.document.unrolled_wall import unrolled_wall
from app.reports.report import Report, Written

PARTS = (
    cover, summary, header_sheet, pipe_graphic, observations, photos, unrolled_wall, condition,
    measurement, sign_off,
)  # fmt: skip
"""In the order of the pages."""


def write(report: Report) -> Written:
    """All parts, in the report's language and units."""
    tell = Teller.of(report)
    story = [piece for part in PARTS for piece in part(report, tell)]
    return Written(made(report, tell, tell("cover.title"), story))
