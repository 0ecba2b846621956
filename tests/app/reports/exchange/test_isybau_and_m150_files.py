"""ISYBAU XML and DWA-M 150, read back field by field."""

from __future__ import annotations

from pathlib import Path

import pytest
from exchange_files import REMARK, in_words, write
from reports import EVERY_FIELD, HEADER, LENGTH_M, codes, report, said

from app.imports import any_file
from app.reports.formats import FORMATS


@pytest.mark.parametrize("kind", ["isybau", "m150"])
def test_german_formats_keep_every_letter(kind: str) -> None:
    remark = "Größe – 钢筋 <b> & \x07bell\x00 \ud800half"
    made = report(observations=[{"distance_m": 1.0, "code": "BDB", "remark": remark}])
    content = FORMATS[kind].write(made).content
    assert "Größe".encode("latin-1") in content
    assert b"&#8211;" in content
    read, _ = write(kind, made)
    assert read.rows[0][REMARK[kind]].startswith("Größe – 钢筋 <b> & bell half, ")


def test_isybau_holds_every_field_of_every_observation(tmp_path: Path) -> None:
    read, _ = write("isybau", report(tmp_path))
    assert read.more["film"] == ["CUL-0041_20260914_0942.mp4"]
    assert read.more["nodes"] == {"HW-UP", "HW-DN", "CUL-0041"}
    assert float(read.more["easting"][1]) - float(read.more["easting"][0]) == pytest.approx(
        LENGTH_M, abs=0.02
    )
    assert read.header["Inspektionsrichtung"] == "O"
    assert (read.header["Profilhoehe"], read.header["Profilart"]) == ("900", "0")
    assert (read.header["Material"], read.header["Uhrzeit"]) == ("B", "09:42:00")
    assert (read.header["Auftrag"], read.header["Inspektionslaenge"]) == ("JOB-77", "24.60")
    assert read.rows[0]["Charakterisierung1"] == read.rows[-1]["Charakterisierung1"] == "XP"
    assert read.rows[0]["Kommentar"].endswith("coded BCD Z")
    assert read.rows[2] == {
        "Index": "3", "Station": "3.20", "Timecode": "00001000", "InspektionsKode": "BAB",
        "Charakterisierung1": "B", "Charakterisierung2": "A", "Verbindung": "0",
        "Quantifizierung1Numerisch": "2.00", "Streckenschaden": "A", "StreckenschadenLfdNr": "1",
        "PositionVon": "11", "PositionBis": "00", "Fotodatei": "CUL-0041-003.jpg",
        "Kommentar": in_words(2),
    }  # fmt: skip
    assert (read.rows[8]["PositionVon"], read.rows[8]["PositionBis"]) == ("09", "02")


def test_m150_writes_the_exact_station_and_quantity_beside_the_rounded_ones() -> None:
    fine = {"distance_m": 9.75, "code": "BAB", "char1": "B", "char2": "A", "quant1": 0.45}
    read, losses = write("m150", report(observations=[fine]))
    assert any("distances to 100 mm" in sentence for sentence in said(losses))
    assert "station_beside" in codes(losses)
    _, coarse = write("m150", report(observations=[{**fine, "distance_m": 9.7}]))
    assert not {"station_beside", "part.rounded_distances"} & codes(coarse)
    (row,) = read.rows
    assert (row["HZ001"], row["HZ003"]) == ("9.8", "0.5")
    assert row["HZ999"] == "station 9.75 m, quantity 1 0.45"


def test_m150_holds_every_field_of_every_observation(tmp_path: Path) -> None:
    read, _ = write("m150", report(tmp_path))
    assert (read.header["HG001"], read.header["HG003"]) == ("CUL-0041", "HW-UP")
    assert (read.header["HI101"], read.header["HI005"]) == ("I", "EN13508")
    assert (read.header["HI112"], read.header["HG305"]) == ("Operator 1", "0")
    assert read.rows[0]["HZ014"] == "XP"
    assert read.rows[2] == {
        "HZ001": "3.2", "HZ002": "BAB", "HZ003": "2.0", "HZ005": "A1", "HZ006": "11",
        "HZ008": "00:00:10", "HZ009": "CUL-0041-003.jpg", "HZ010": in_words(2), "HZ014": "B",
        "HZ015": "A", "HZ999": "station 3.20 m",
    }  # fmt: skip
    assert [row.get("HZ011") for row in read.rows].count("A") == 2


def test_a_quantity_that_isybau_cannot_hold_as_a_number_is_written_as_text() -> None:
    made = report(observations=[{"distance_m": 1.0, "code": "BAA", "char1": "A", "quant1": 0.125}])
    read, _ = write("isybau", made)
    assert read.rows[0]["Quantifizierung1Text"] == "0.125"


@pytest.mark.parametrize(("kind", "longest"), [("isybau", 30), ("m150", 16)])
def test_long_names_are_cut_and_stay_apart(kind: str, longest: int) -> None:
    long = "Headwall of Jalan Kampung Baru, "
    made = report(header={**HEADER, "start_node": f"{long}north", "end_node": f"{long}south"})
    read, losses = write(kind, made)
    up, down = ("KnotenZulauf", "KnotenAblauf") if kind == "isybau" else ("HG003", "HG004")
    assert read.header[up] != read.header[down]
    assert len(read.header[up]) <= longest
    renamed = [loss.values for loss in losses if loss.key == "renamed"]
    assert {"name": f"{long}north", "written": read.header[up]} in renamed


@pytest.mark.parametrize(
    ("kind", "rounded"),
    [
        ("isybau", ["900.4 as 900", "24.605 as 24.61", "12.5 as 13"]),
        ("m150", ["900.4 as 900", "12.25 as 12.3", "17.5 as 18"]),
    ],
)
def test_a_header_field_that_a_german_format_rounds_is_among_the_losses(
    kind: str, rounded: list[str]
) -> None:
    finer = {"height_mm": 900.4, "water_level_pct": 17.5}
    finer |= {"known_length_m": 24.605, "temperature_c": 12.5 if kind == "isybau" else 12.25}
    _, losses = write(kind, report(header={**EVERY_FIELD, **finer}))
    (fields,) = [loss.values["fields"] for loss in losses if loss.key == "rounded_fields"]
    assert [f"{one.values['stated']} as {one.values['written']}" for one in fields] == rounded
    coarse = {"temperature_c": 12}
    _, losses = write(kind, report(header={**EVERY_FIELD, **coarse}))
    assert "rounded_fields" not in codes(losses)


def test_m150_has_the_width_first_and_the_unit_length_last() -> None:
    read, _ = write("m150", report(header=EVERY_FIELD))
    assert (read.header["HG306"], read.header["HG307"]) == ("1500", "900")
    assert (read.header["HG310"], read.header["HG314"]) == ("24.600", "2.440")
    assert {name: read.header[name] for name in ("HI002", "HI006", "HI108", "HG102", "HG303")} == {
        "HI002": "JOB-77", "HI006": "Eyeball, 6 mm", "HI108": "12.5", "HG102": "Dorfstrasse",
        "HG303": "1987",
    }  # fmt: skip
    assert (read.header["HG308"], read.header["HG309"]) == ("tiles", "granite sets")
    assert read.header["HI999"].startswith("mind the dog, ")


def test_isybau_names_road_year_and_order() -> None:
    read, _ = write("isybau", report(header=EVERY_FIELD))
    names = ("Strassenname", "Baujahr", "Auftragsnummer")
    assert [read.header[name] for name in names] == ["Dorfstrasse", "1987", "ORDER-12"]


def test_isybau_of_2024_differs_in_its_version_alone_and_comes_back() -> None:
    made = report(header=EVERY_FIELD)
    old, new = (FORMATS[kind].write(made).content for kind in ("isybau", "isybau2024"))
    version = (b"<Version>2017-07<", b"<Version>2024-06<")
    assert new == old.replace(*version).replace(b"<Regelwerk>6<", b"<Regelwerk>7<") != old
    before, after = (any_file.read(content).surveys for content in (old, new))
    assert before == after
