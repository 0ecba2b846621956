"""What a template does to the PDF, as pypdf reads it and PDFium draws it."""

from __future__ import annotations

import base64
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pypdfium2
import pytest
from PIL import Image
from pypdf import PdfReader
from reports import full_report, report

from app.reports import pdf as document
from app.reports.report import Company
from app.reports.template import SECTIONS, ReportTemplate
from app.reports.templates import company_of

BROWN = (0x8A, 0x3C, 0x00)
TITLES = {
    "summary": "Summary", "header": "Header sheet", "graphic": "Pipe graphic",
    "observations": "Observations", "photos": "Photos", "wall": "Unrolled wall",
    "condition": "Condition", "measurement": "Measurement", "checks": "Checks and sign-off",
}  # fmt: skip


def written(**chosen: Any) -> PdfReader:
    template = ReportTemplate(**chosen)
    company = company_of(template, Company("Server Ltd"))
    made = replace(report(), template=template, company=company)
    return PdfReader(io.BytesIO(document.write(made).content))


def bookmarks(read: PdfReader) -> list[str]:
    return [one["/Title"] for one in read.outline if not isinstance(one, list)]


@pytest.mark.parametrize(
    "sections",
    [list(SECTIONS), list(reversed(SECTIONS)), ["checks", "summary"], ["condition"], ["scene"], []],
)
def test_sections_are_printed_in_the_order_of_the_template(sections: list[str]) -> None:
    read = written(sections=sections)
    assert bookmarks(read) == [TITLES[one] for one in sections if one != "scene"]
    last = read.pages[-1].extract_text()
    assert len(last.split()) > 20, "no page holds nothing but its head and foot"


def test_each_section_stands_alone(tmp_path: Path) -> None:
    """None links to a place in another, which may not be printed."""
    full = full_report(tmp_path)
    for section in TITLES:
        made = replace(full, template=ReportTemplate(sections=[section]))
        assert bookmarks(PdfReader(io.BytesIO(document.write(made).content))) == [TITLES[section]]


def test_the_cover_has_the_company_and_the_introduction() -> None:
    out = io.BytesIO()
    Image.new("RGB", (64, 32), BROWN).save(out, "PNG")
    read = written(
        company_name="North Ltd",
        company_address="1 High Street\nNorthtown",
        logo=base64.b64encode(out.getvalue()).decode(),
        introduction="As ordered.\nAnd more.",
    )
    text = read.pages[0].extract_text()
    for words in ("North Ltd", "1 High Street", "Northtown", "As ordered.", "And more."):
        assert words in text
    assert "Server Ltd" not in text
    (logo,) = read.pages[0].images
    assert logo.image is not None
    assert logo.image.size == (64, 32)
    assert "North Ltd" in read.pages[1].extract_text(), "in the head of the pages"
    assert read.metadata is not None
    assert read.metadata.author == "North Ltd"


def test_what_the_template_leaves_empty_is_the_servers() -> None:
    assert "Server Ltd" in written().pages[0].extract_text()


@pytest.mark.parametrize("sections", [["summary", "checks"], ["summary"]])
def test_the_closing_text_is_there_with_or_without_signatures(sections: list[str]) -> None:
    text = "\n".join(
        page.extract_text() for page in written(sections=sections, closing="Yours.").pages
    )
    assert text.count("Yours.") == 1
    if "checks" in sections:
        assert text.index("Yours.") < text.index("Signatures")


def test_an_introduction_of_many_pages_is_printed_in_full() -> None:
    words = [f"word{n}" for n in range(440)]
    read = written(introduction="\n".join(words), sections=["summary"])
    found = "\n".join(page.extract_text() for page in read.pages).split()
    assert [word for word in found if word.startswith("word")] == words


def test_titles_have_the_colour_of_the_template() -> None:
    for accent, is_brown in (("#8a3c00", True), ("#1d3b50", False)):
        template = ReportTemplate(accent=accent, sections=["summary", "checks"])
        made = document.write(replace(report(), template=template)).content
        with pypdfium2.PdfDocument(made) as pdf:
            drawn = [np.asarray(page.render(scale=1).to_pil().convert("RGB")) for page in pdf]
        assert [bool((page == BROWN).all(axis=2).any()) for page in drawn] == [is_brown] * len(
            drawn
        )
