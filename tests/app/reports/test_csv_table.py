"""The CSV, read back with the standard library."""

import csv
import io
from dataclasses import replace

import pytest
from reports import measured, report

from app.reports.report import Extras
from app.reports.tables.table import COLUMNS, write


def rows_of(made):
    return list(csv.DictReader(io.StringIO(write(made).content.decode("utf-8-sig"), newline="")))


def test_no_number_becomes_text_and_no_text_a_formula():
    texts = ("=1", "+1", "-1", "@a", "\tx", "\rx", "ok", "a=b")
    fields = [{"distance_m": -1.25, "quant1": -2.5, "remark": text} for text in texts]
    rows = rows_of(report(observations=fields))
    assert [row["remark"] for row in rows] == [
        "'=1", "'+1", "'-1", "'@a", "'\tx", "'\rx", "ok", "a=b",
    ]  # fmt: skip
    assert {(row["distance_m"], row["quant1"]) for row in rows} == {("-1.250", "-2.5")}


@pytest.mark.parametrize("remark", ["two\nlines", 'a "quote", a comma; a semicolon', "钢筋 ظاهر"])
def test_any_text_comes_back(remark):
    (row,) = rows_of(report(observations=[{"distance_m": 1.0, "remark": remark}]))
    assert row["remark"] == remark


def test_sizes_stand_with_their_intervals():
    made = report(observations=[{"distance_m": 1.0}])
    (row,) = rows_of(replace(made, entries=tuple(map(measured, made.entries))))
    assert row["measured"] == "width 23 ± 2 mm; depth 42 ± 4 mm (14.0 ± 1.0 %)"


def test_what_cannot_be_encoded_is_replaced():
    (row,) = rows_of(report(observations=[{"distance_m": 1.0, "remark": "a\ud800b"}]))
    assert row["remark"] == "a\ufffdb"


def test_german_excel_gets_semicolons_and_decimal_commas():
    entries = report().entries
    tag = entries[2].tag.model_copy(
        update={"remark": "=1;2", "quant1": 2.5, "recommendation": "seal", "cost": 1250.5}
    )
    made = report(
        entries=(replace(entries[2], tag=tag, lat=51.4525),), extras=Extras(csv_style="german")
    )
    content = write(made).content
    assert content.startswith(b"\xef\xbb\xbfreport_id;asset_id;seq;")
    text = content.decode("utf-8-sig")
    (row,) = csv.DictReader(io.StringIO(text, newline=""), delimiter=";")
    assert tuple(row) == COLUMNS
    expected = {
        "distance_m": "3,200", "quant1": "2,5", "lat": "51,4525", "cost": "1250,5", "seq": "3",
        "remark": "'=1;2", "recommendation": "seal", "tagged_at": "2026-09-14T09:42:03+00:00",
    }  # fmt: skip
    assert {name: row[name] for name in expected} == expected
