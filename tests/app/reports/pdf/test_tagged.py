"""The PDF as a screen reader and an archive take it: tags, order, links, metadata."""

import io
import re
from dataclasses import replace

import pypdfium2
import pytest
from hypothesis import given, settings
from pdf_structure import check, check_glyphs
from pypdf import PdfReader
from random_reports import reports
from reports import full_report, remarked, report

from app.reports import pdf as document
from app.reports.content.translator import Translator
from app.reports.pdf import emergency
from app.reports.pdf.flow import Title
from app.reports.pdf.grid import Column, Contents, PageOf
from app.reports.pdf.pages import Document, Running, about
from app.reports.pdf.styles import TITLE
from app.reports.report import Extras
from app.reports.template import ReportTemplate

LONG = "Retak memanjang. 钢\u200d筋外露。 ظاهر تسرب. தமிழ் சாலை. ถนนสุขุมวิท " * 160


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    return full_report(tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="module")
def content(full):
    """A report with every script, in Malay, whose film lies beside it."""
    entries = (remarked(full.entries[0], LONG), *full.entries[1:])
    filmed = Extras(film_path="./my film.mp4")
    return document.write(replace(full, entries=entries, language="ms", extras=filmed)).content


@pytest.fixture(scope="module")
def tree(content):
    return check(content, "ms")


@pytest.fixture(scope="module")
def reader(content):
    return PdfReader(io.BytesIO(content))


def kinds_of(tree, *kinds):
    return [node for node in tree.walk() if node.kind in kinds]


def test_a_full_report_with_every_script_is_tagged(content, tree):
    check_glyphs(content)

    assert {"/H1", "/H2", "/H3", "/Table", "/Figure", "/Link"} <= {n.kind for n in tree.walk()}


@settings(max_examples=max(1, settings().max_examples // 5))
@given(reports())
def test_any_report_is_tagged(made):
    check(document.write(made).content, made.language)


def test_an_empty_report_and_the_act_now_sheet_are_tagged(full):
    check(document.write(report(observations=(), header={}, events=())).content)
    sheet = check(emergency.write(full).content)
    check(emergency.write(report(observations=())).content)

    assert len(kinds_of(sheet, "/H1")) == 1
    (photo,) = kinds_of(sheet, "/Figure")
    assert "Broken wall: fallen in" in photo.entry["/Alt"]
    assert "12.40 m" in photo.entry["/Alt"]


def test_a_table_over_pages_is_one_table_with_one_head(full):
    observations = [{"distance_m": n / 10, "code": "BAB"} for n in range(120)]
    tree = check(document.write(report(observations=observations)).content)

    table = max(kinds_of(tree, "/Table"), key=lambda node: len(node.kids))
    assert len(table.kids) == 121
    assert {cell.kind for cell in table.kids[0].kids} == {"/TH"}
    pages = {page for row in table.kids for cell in row.kids for page, _ in cell.contents}
    assert len(pages) > 2


def test_parts_are_sections_in_the_order_of_the_bookmarks(reader, tree):
    parts = [node for node in tree.kids if node.kind == "/Sect"]
    assert len(parts) == len([item for item in reader.outline if not isinstance(item, list)])
    assert all(part.kids[0].kind == "/H2" for part in parts)


def test_links_lead_from_a_defect_to_its_photo_and_back_and_to_the_film_beside_it(full, reader):
    alone = replace(full, template=ReportTemplate(sections=["observations", "photos"]))
    assert b"/URI" not in document.write(alone).content
    targets, films = set(), set()
    for page in reader.pages:
        for link in page.get("/Annots", []):
            one = link.get_object()
            if "/Dest" in one:
                targets.add(one["/Dest"])
            else:
                films.add(one["/A"]["/URI"])
    with_photo = [entry for entry in full.entries if entry.photo]

    assert {f"photo-{entry.seq}" for entry in with_photo} <= targets
    assert {f"row-{entry.seq}" for entry in with_photo} <= targets
    timed = [entry for entry in with_photo if entry.time_s is not None]
    assert {f"./my%20film.mp4#t={entry.time_s:g}" for entry in timed} == films


def test_the_page_of_a_place_is_that_of_the_text(reader):
    page = reader.get_destination_page_number(reader.named_destinations["row-3"])

    assert "Pemerhatian" in reader.pages[page].extract_text()


def test_two_reports_of_one_asset_in_a_document_keep_their_links_apart(full):
    full = replace(full, template=ReportTemplate(sections=["observations", "photos"]))
    t, out = Translator.of(full), io.BytesIO()
    book = Document(out, about(full, "Both"))
    rows = [[key, PageOf(f"{key}/title", "To the report")] for key in ("first", "second")]
    columns = (Column("", 40), Column("", 40, "right"))
    front = [Title("Both", TITLE, after=0, bookmark=""), Contents(columns, rows)]
    book.add_pages(Running("", "Both", "", t), front)
    for key in ("first", "second"):
        book.add(full, t, "Report", document.story_of(full, t), level=1, key=key)
    book.close()

    tree = check(out.getvalue())
    reader = PdfReader(out)
    pages = [
        reader.get_destination_page_number(reader.named_destinations[f"{key}/row-3"])
        for key in ("first", "second")
    ]
    assert pages[0] < pages[1]
    with pypdfium2.PdfDocument(out.getvalue()) as read:
        contents = read[0].get_textpage().get_text_range().split()
    starts = [
        reader.get_destination_page_number(reader.named_destinations[f"{key}/title"]) + 1
        for key in ("first", "second")
    ]
    assert contents[:5] == ["Both", "first", str(starts[0]), "second", str(starts[1])]
    assert len(kinds_of(tree, "/Part")) == 2
    assert len(kinds_of(tree, "/TOCI")) == 2
    titles = [item.title for item in reader.outline if not isinstance(item, list)]
    assert titles == ["CUL-0041", "CUL-0041"]


def test_shaped_letters_are_read_as_they_were_written(reader):
    read = "".join(
        bytes.fromhex(text.decode()).decode("utf-16-be")
        for page in reader.pages
        for text in re.findall(rb"/ActualText <FEFF(\w+)>", page.get_contents().get_data())
    )
    assert "ظاهر" in read
    assert "தமிழ்" in read
