"""The report as a tagged PDF (PDF/UA-1, PDF/A-2a), set by Typst from the templates."""

from __future__ import annotations

import io

from app.reports.content.translator import Translator
from app.reports.pdf.characters import missing_glyphs
from app.reports.pdf.model import about, report_data
from app.reports.pdf.typesetter import workshop
from app.reports.report import Report, Written


def write(report: Report) -> Written:
    """Write the chosen parts in the report's language and units."""
    t, out = Translator.of(report), io.BytesIO()
    with workshop(report.scratch) as shop:
        shop.write_data("report", report_data(report, t, shop))
        shop.set_document("single", about(report, t("cover.title")), out)
    return Written(out.getvalue(), missing_glyphs(report))
