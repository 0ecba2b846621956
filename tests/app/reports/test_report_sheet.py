"""The sheets for people, read back with openpyxl."""

import io

import openpyxl
import pytest
from PIL import Image
from reports import advised, full_report, report

from app.reports.report import Company
from app.reports.tables.spreadsheet import write
from app.reports.template import ReportTemplate

HEAD = 7
"""The row with the names of the columns."""


def book_of(made):
    return openpyxl.load_workbook(io.BytesIO(write(made).content))


def table_of(sheet):
    head, *rows = sheet.iter_rows(min_row=HEAD, values_only=True)
    return [dict(zip(head, row, strict=True)) for row in rows]


def words_of(sheet):
    return [cell for row in sheet.iter_rows(values_only=True) for cell in row if cell is not None]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    made = full_report(
        tmp_path_factory.mktemp("photos"),
        template=ReportTemplate(grade="structural", costs=True, currency="MYR"),
        company=Company(server="https://culverts.example/"),
    )
    return advised(
        made,
        {
            9: {"recommendation": "=rebuild", "cost": 9000.0},
            10: {"recommendation": "Coat the wall.", "cost": 1250.5},
        },
    )


@pytest.fixture(scope="module")
def book(made):
    return book_of(made)


def test_people_see_the_report_first_and_programs_find_their_sheets_by_name(book):
    assert book.sheetnames == [
        "Report", "Statistics", "observations", "header", "joints", "corrections", "dictionary",
    ]  # fmt: skip


def test_every_observation_is_a_row_that_people_can_read(book, made):
    rows = table_of(book["Report"])
    assert [row["No."] for row in rows] == [entry.seq for entry in made.entries]
    assert [row["Distance (m)"] for row in rows] == [
        pytest.approx(entry.distance_m, abs=0.005) for entry in made.entries
    ]
    crack = {
        "Code": "BAB B A", "What": "Crack: line, edges touching, along the pipe", "Clock": "11",
        "Quantity": "2 mm", "Stretch": "A1", "Severity": 3, "Video": "0:10.6",
    }  # fmt: skip
    assert {name: rows[2][name] for name in crack} == crack
    assert rows[8]["Recommendation"] == "=rebuild"
    assert [row["Cost (MYR)"] for row in rows if row["Cost (MYR)"]] == [9000.0, 1250.5]


def test_no_text_is_a_formula_and_a_time_opens_the_film_there(book, made):
    sheet = book["Report"]
    cells = {cell.value: cell for row in sheet.iter_rows() for cell in row}
    assert (cells["=rebuild"].data_type, cells["=rebuild"].quotePrefix) == ("s", True)
    assert cells["0:10.6"].hyperlink.target == (
        f"https://culverts.example/inspections/{made.id}?defect={made.entries[2].id}"
    )


def test_the_sheet_can_be_filtered_scrolled_and_printed(book, made):
    sheet = book["Report"]
    assert sheet.auto_filter.ref == f"A{HEAD}:O{HEAD + len(made.entries)}"
    assert sheet.freeze_panes == f"C{HEAD + 1}"
    assert not sheet.merged_cells.ranges
    assert (sheet.page_setup.orientation, sheet.page_setup.paperSize) == ("landscape", 9)
    assert sheet.page_setup.fitToWidth in (None, 1)  # 1 is what a file without it means
    assert sheet.page_setup.fitToHeight == 0
    assert sheet.sheet_properties.pageSetUpPr.fitToPage
    assert sheet.print_title_rows == f"${HEAD}:${HEAD}"
    assert "&P / &N" in "".join(
        part.text or "" for part in (sheet.oddFooter.left, sheet.oddFooter.right)
    ).replace("&[Page]", "&P").replace("&[Pages]", "&N")


def test_each_photo_is_a_small_picture_in_the_row_of_its_observation(book, made):
    pictures = book["Report"]._images
    assert len(pictures) == len([entry for entry in made.entries if entry.photo])
    assert {picture.anchor._from.row for picture in pictures} == set(
        range(HEAD, HEAD + len(made.entries))
    )
    for picture in pictures:
        content = picture._data()
        assert len(content) < 15_000
        assert max(Image.open(io.BytesIO(content)).size) <= 200


def test_the_head_names_the_asset_the_grade_and_the_costs(book):
    words = words_of(book["Report"])
    assert words[0] == "CUL-0041 · Culvert inspection report"
    assert "5 · act at once" in words
    assert "MYR 10,250.50" in words
    assert any("not a DWA grade" in str(word) for word in words)


def test_statistics_print_counts_costs_and_what_the_grade_follows_from(book):
    rows = [[*row] for row in book["Statistics"].iter_rows(values_only=True)]
    assert [5, 1, 9000.0, None, "act now"] in [row[:5] for row in rows]
    assert [None, None, 10250.5, None, "Total"] in [row[:5] for row in rows]
    assert any("BFR Abwasser" in str(row[0]) for row in rows)
    decisive = next(row for row in rows if row[0] == 9)
    assert decisive[1:5] == [12.4, 0.06, None, "BAC C"]
    assert decisive[7:] == ["any extent", "5 · decides"]
    crack = next(row for row in rows if row[7] == "2–5 mm")
    assert (crack[4], crack[8]) == ("BAB B A", "3")
    assert any(row[4] == "BAF F E" and "no published threshold" in row[7] for row in rows if row[7])
    heads = {t for row in rows[1:] for t in row[:4] if isinstance(t, str)}
    assert not any(isinstance(value, int | float) for row in rows for value in row[4:])
    assert "No." in heads


def test_feet_and_malay_and_a_template_without_costs_or_grade():
    made = report(language="ms", units="ft", template=ReportTemplate(grade="none"))
    book = book_of(made)
    rows = table_of(book["Laporan"])
    assert book.sheetnames[:2] == ["Laporan", "Statistik"]
    assert rows[2]["Jarak (ft)"] == 10.5
    assert not any(name and name.startswith("Kos") for name in rows[0])
    assert "tidak digredkan" in words_of(book["Laporan"])


def test_a_distance_that_is_not_the_cameras_says_so_beside_it():
    entries = [{"distance_m": 1.5}, {"distance_m": 3.2, "source": "counter"}]
    rows = table_of(book_of(report(observations=entries))["Report"])
    assert [row["Source of the distance"] for row in rows] == [None, "by the counter"]


def test_a_missing_photo_leaves_its_name(tmp_path):
    made = report(tmp_path)
    for path in tmp_path.glob("1.jpg"):
        path.write_bytes(b"broken")
    sheet = book_of(made)["Report"]
    assert len(sheet._images) == len(made.entries) - 1
    assert table_of(sheet)[0]["Photo"] == "CUL-0041-001.jpg"
