"""The PDF over many inspections, read with pypdf and pypdfium2."""

import io
import re
from dataclasses import replace

import pypdf
import pypdfium2
import pytest
from reports import page_of, report

from app.errors import InspectionNotFound
from app.reports.content.translator import Translator
from app.reports.content.words import LANGUAGES
from app.reports.pdf import collection
from app.reports.report import FormatNeeds
from app.reports.template import ReportTemplate

IDS = [f"{number:032x}" for number in (1, 2, 3)]


def written(language="en"):
    """The document, what is missing, and the steps that were reported."""
    steps = []

    def report_of(inspection_id):
        number = int(inspection_id, 16)
        if number > 3:
            raise InspectionNotFound("There is no such inspection.")
        made = report()
        header = {**made.header, "road": f"Road {number % 2}", "project": "Klang"}
        # Two reports of one asset must not be mistaken for each other.
        header |= {"asset_id": "CUL-A"} if number < 3 else {"start_lat": None}
        rule = ReportTemplate(grade="structural" if number == 3 else "own")
        return replace(made, id=inspection_id, name=f"Run {number}", header=header,
                       language=language, template=rule)  # fmt: skip

    out = io.BytesIO()
    missing = collection.write(
        out, [*IDS, 32 * "f"], report_of, Translator(language, "m"),
        begin=steps.append, done=lambda: steps.append(None),
    )  # fmt: skip
    return out.getvalue(), missing, steps


@pytest.fixture(scope="module")
def made():
    return written()


def outline(reader):
    """Titles with their pages, and the titles below each."""
    found = []
    for one in reader.outline:
        if isinstance(one, list):
            found[-1][2].extend(below.title for below in one if not isinstance(below, list))
        else:
            found.append((one.title, reader.get_destination_page_number(one), []))
    return found


def test_every_inspection_has_its_bookmarks_below_its_own(made):
    reader = pypdf.PdfReader(io.BytesIO(made[0]))
    found = outline(reader)
    titles = [title for title, _, _ in found]
    assert titles == [
        "Contents", "Inspections and their grades", "Statistics", "Plan sketch",
        "1 · CUL-A", "2 · CUL-A", "3 · CUL-0041",
    ]  # fmt: skip
    for title, page, below in found[4:]:
        assert title.split(" · ")[1] in reader.pages[page].extract_text()
        assert {"Summary", "Observations", "Condition"} <= set(below)


@pytest.mark.parametrize("language", LANGUAGES)
def test_heads_of_the_statistics_are_not_broken_within_a_word(language):
    t = Translator(language, "m")
    heads = ("inspections", "defects", "worst", "grades", "stretches", "length_in", "per_100")
    content, *_ = written(language)
    first, after = (page for _, page, _ in outline(pypdf.PdfReader(io.BytesIO(content)))[2:4])
    with pypdfium2.PdfDocument(content) as pdf:
        pages = [pdf[n].get_textpage().get_text_range() for n in range(first, after)]
    words = {word for page in pages for word in page.split()}
    for head in heads:
        assert {*t(f"collection.{head}", unit="m").split()} <= words, head


def test_rows_lead_to_the_page_that_they_name(made):
    reader = pypdf.PdfReader(io.BytesIO(made[0]))
    pages = {title: page for title, page, _ in outline(reader)}
    starts = [pages["1 · CUL-A"], pages["2 · CUL-A"], pages["3 · CUL-0041"]]
    shown = pypdfium2.PdfDocument(made[0])
    for title in ("Contents", "Inspections and their grades"):
        page = reader.pages[pages[title]]
        links = [link.get_object() for link in page["/Annots"]]
        led = {page_of(reader, link["/Dest"]) for link in links}
        assert led >= set(starts), title
        words = " ".join(shown[pages[title]].get_textpage().get_text_range().split())
        for number, start in enumerate(starts, 1):
            assert re.search(rf" {number} .{{0,3}}CUL-\w+.*?{start + 1}\b", words), words


def test_grades_of_different_rules_have_columns_of_their_own(made):
    text = " ".join(pypdf.PdfReader(io.BytesIO(made[0])).pages[1].extract_text().split())
    assert "Overall condition Structural grade" in text


def test_what_is_missing_is_named_and_every_step_is_reported(made):
    content, missing, steps = made
    assert [one[0] for one in missing] == [32 * "f"]
    assert steps.count(None) == 4
    text = "".join(page.extract_text() for page in pypdf.PdfReader(io.BytesIO(content)).pages)
    assert "Not in this document: ffff" in text


def test_none_at_all_is_an_error():
    with pytest.raises(InspectionNotFound):
        collection.write(
            io.BytesIO(), [], lambda _: report(), Translator("en", "m"),
            begin=lambda _: None, done=lambda: None,
        )  # fmt: skip


@pytest.mark.parametrize(("inspections", "observations"), [(151, 0), (1, 2501)])
def test_more_than_one_document_takes_is_refused_with_what_to_do(inspections, observations):
    made = report()
    large = replace(made, entries=made.entries[:1] * observations)
    with pytest.raises(FormatNeeds, match="Make several documents") as refused:
        collection.write(
            io.BytesIO(), IDS[:1] * inspections, lambda _: large, Translator("de", "m"),
            begin=lambda _: None, done=lambda: None,
        )  # fmt: skip
    assert "höchstens 150 Inspektionen und 2500" in Translator("de", "m").phrase(
        refused.value.reason
    )
