"""Rules of the register: what a table states, what an import does, what an inspection takes."""

from __future__ import annotations

import pytest

from app.errors import InvalidTable
from app.survey.assets.register import Asset, InvalidLine, completed, line_of, registered, wkt_of
from app.survey.assets.register_table import (
    EXAMPLE,
    MOST_ROWS,
    TEMPLATE,
    Table,
    read_table,
    steps,
    template,
    written,
)
from app.survey.fields.header import ASSET_FIELDS
from app.survey.folding import normalised_id

LINE = ((101.6869, 3.139), (101.687, 3.1391))
CULVERT = registered(
    "CV-01",
    "North",
    {"shape": "circular", "height_mm": 600, "known_length_m": 12.5, "material": "Konkrit é, =x"},
    LINE,
)


def read(text: str, encoding: str = "utf-8") -> Table:
    return read_table(text.encode(encoding))


def faults(text: str) -> list[tuple[int, str | None, str]]:
    return [(fault.row, fault.column, fault.detail) for fault in read(text).faults]


def unused(table: Table) -> list[str]:
    return [named.name for named in table.columns if named.column is None]


def test_a_register_that_is_written_and_read_again_is_the_same() -> None:
    many = [
        CULVERT,
        registered("#7", None, {"location_text": '-5 m "left"\nof; the road', "year": 1998}, ()),
        registered("=1+1", "+", {}, LINE[:1]),
    ]
    table = read("".join(written(many)))
    assert (table.faults, unused(table)) == ([], [])
    done = steps(table.stated, {asset.asset_id: asset for asset in many})
    assert [(step.action, step.asset) for step in done] == [("same", asset) for asset in many]
    assert [step.asset for step in steps(table.stated, {})] == many


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252"])
@pytest.mark.parametrize("separator", [";", "\t"])
def test_tables_as_spreadsheets_save_them(encoding: str, separator: str) -> None:
    rows = (
        ["Asset ID", "Project", "SHAPE", "known-length-m", "start_lat", "start_lon", "Colour"],
        ["CV 2 ", "Süd", "U shaped", "12,50", "3,1", "101,6", "x"],
    )
    table = read("\r\n".join(separator.join(row) for row in rows), encoding)
    assert (table.faults, unused(table)) == ([], ["Colour"])
    (step,) = steps(table.stated, {})
    header = {"shape": "u_shaped", "known_length_m": 12.5}
    assert step.asset == Asset("CV 2", "Süd", header, ((101.6, 3.1),))


def test_an_empty_cell_removes_and_a_missing_column_leaves() -> None:
    (step,) = steps(read("asset_id,height_mm,material\nCV-01,,clay\n").stated, {"CV-01": CULVERT})
    assert step.action == "change"
    header = {"shape": "circular", "known_length_m": 12.5, "material": "clay"}
    assert step.asset == Asset("CV-01", "North", header, LINE)
    (step,) = steps(read("asset_id,wkt,project\nCV-01,,\n").stated, {"CV-01": CULVERT})
    assert (step.asset.line, step.asset.project) == ((), None)


@pytest.mark.parametrize(
    ("row", "column", "said"),
    [
        (",600,,,,,", "asset_id", "empty"),
        ("--,600,,,,,", "asset_id", "letter or a digit"),
        ("OK,600,,,,,", "asset_id", "in line 2 already"),
        ("B,6OO,,,,,", "height_mm", "from 1 to 50000 mm"),
        ('B,"1,200",,,,,', "height_mm", "decimal point"),
        ("B,,3.1,,,,", "start_lat", "belong together"),
        ("B,,,,3.1,101,", "start_lat", "needed where the end"),
        ("B,,north,101,,,", "start_lat", "start_lat must be degrees"),
        ('B,,"3,145",101,,,', "start_lat", "decimal point"),
        ("B,,400000,500000,,,", "start_lat", "EPSG:4326"),
        ("B,,,,,,POINT (500000 400000)", "wkt", "EPSG:4326"),
        ("B,,,,,,LINESTRING (here)", "wkt", "longitude and latitude"),
        ("B,,,,,,somewhere", "wkt", "POINT (lon lat)"),
        ("B,,3.1,101,,,POINT (101 3)", "wkt", "stated twice"),
        ("B,,,,,,,more", None, "8 cells, the header 7"),
    ],
)
def test_each_fault_names_row_column_and_repair(row: str, column: str | None, said: str) -> None:
    head = "asset_id,height_mm,start_lat,start_lon,end_lat,end_lon,wkt"
    (fault,) = faults(f"{head}\nOK,600,,,,,\n{row}\n")
    assert fault[:2] == (3, column)
    assert said in fault[2]


def test_a_fault_has_its_kind_for_pages_in_other_languages() -> None:
    found = read("asset_id,height_mm\nA,abc\nA,1\n,2\nB,1,2\n").faults
    said = [(fault.reason, fault.found) for fault in found]
    assert said == [("value", "abc"), ("twice", "2"), ("id", ""), ("cells", "3")]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no rows"),
        ("asset_id\nA\x00\n", "Line 2 .* save the table as CSV"),
        ("asset_id" + "," * 500, "more than 500 columns"),
        ('asset_id,material\n"A,clay\n', "quotation marks"),
        ("asset_id\n" + "A\n" * (MOST_ROWS + 1), f"more than {MOST_ROWS} rows"),
        ("asset_id\nA\n" + "\n" * MOST_ROWS, "empty ones included"),
        ("\r" * (MOST_ROWS + 2), "empty ones included"),
    ],
)
def test_what_is_no_table_of_assets_is_refused(text: str, said: str) -> None:
    with pytest.raises(InvalidTable, match=said):
        read(text)


def test_the_example_of_the_template_is_no_asset() -> None:
    table = read(template())
    assert unused(table) == []
    assert [(fault.row, fault.reason) for fault in table.faults] == [(2, "example")]
    filled = template().replace("EXAMPLE", "CV-01")
    (step,) = steps(read(filled).stated, {})
    assert step.asset.header | {"project": step.asset.project} == {
        name: value
        for name, value in EXAMPLE.items()
        if name in (*ASSET_FIELDS, "project")
    }  # fmt: skip
    assert len(set(TEMPLATE)) == len(TEMPLATE)


def test_lines_of_other_programs() -> None:
    assert line_of("MULTILINESTRING Z ((101 3 5, 102 4 6))") == ((101, 3), (102, 4))
    assert line_of("srid=4326;point(101 -3)") == ((101, -3),)
    assert line_of("LINESTRING EMPTY") == ()
    assert line_of(wkt_of(LINE)) == LINE
    with pytest.raises(InvalidLine, match="several lines"):
        line_of("MULTILINESTRING ((101 3, 102 4), (103 5, 104 6))")


def test_an_inspection_takes_what_its_header_does_not_state() -> None:
    given = {"asset_id": "CV-01", "material": "clay", "operator": "Ali", "year": ""}
    assert completed(given, CULVERT) == {
        "asset_id": "CV-01",
        "material": "clay",
        "operator": "Ali",
        "year": "",
        "shape": "circular",
        "height_mm": 600,
        "known_length_m": 12.5,
        "project": "North",
        "start_lon": 101.6869,
        "start_lat": 3.139,
        "end_lon": 101.687,
        "end_lat": 3.1391,
    }
    assert completed({"asset_id": "X", "year": None}, None) == {"asset_id": "X"}


def test_fields_that_belong_together_are_not_mixed() -> None:
    square = {"shape": "rectangular", "job_ref": "J1", "known_length_m": 11, "start_lat": 1.5}
    found = completed(square, CULVERT)
    assert found.keys() - square.keys() == {"material"}
    none = {"height_mm": None, "project": None, "material": None}
    assert completed(none, CULVERT).keys() == {
        "known_length_m", "start_lat", "start_lon", "end_lat", "end_lon",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("written_as", "expected"),
    [("CV-01", "cv01"), ("cv 01", "cv01"), ("Cülvert/7", "culvert7"), ("--", "--"), ("٣", "٣")],
)
def test_all_ways_of_writing_an_id_have_one_normalised_id(written_as: str, expected: str) -> None:
    assert normalised_id(written_as) == expected


def test_a_spelling_fits_into_its_column_whatever_its_letters_become() -> None:
    assert len(normalised_id(200 * "ﷺ")) == 200
