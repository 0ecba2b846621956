"""Each exchange format, read back field by field by a reader that knows its rules only."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from exchange_readers import (
    Read,
    read_en13508,
    read_en13508_xml,
    read_isybau,
    read_m150,
    read_ribx,
)
from hypothesis import HealthCheck, given, settings
from pyproj import Geod, Transformer
from random_reports import reports
from reports import ENGLISH, EVERY_FIELD, HEADER, LENGTH_M, OBSERVATIONS, report, said

from app.errors import ExportNotAvailable
from app.reports.exchange import geojson
from app.reports.formats import FORMATS
from app.reports.report import Report, Source, Written
from app.survey.catalogue.header import FIELDS
from app.survey.register import Line

READERS: dict[str, Callable[[bytes], Read]] = {
    "en13508": read_en13508, "en13508xml": read_en13508_xml, "ribx": read_ribx,
    "isybau": read_isybau, "m150": read_m150,
}  # fmt: skip
CODE = {
    "en13508": "A",
    "en13508xml": "A",
    "ribx": "A",
    "isybau": "InspektionsKode",
    "m150": "HZ002",
}
REMARK = {"en13508": "F", "en13508xml": "F", "ribx": "F", "isybau": "Kommentar", "m150": "HZ010"}
DISTANCE = {"en13508": "I", "en13508xml": "I", "ribx": "I", "isybau": "Station", "m150": "HZ001"}
PHOTO = {"en13508": "M", "en13508xml": "M", "ribx": "M", "isybau": "Fotodatei", "m150": "HZ009"}

each = pytest.mark.parametrize("kind", list(READERS))
few = settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow], database=None
)


def write(kind: str, made: Report) -> tuple[Read, list[str]]:
    """What the file says, and the sentences of its losses."""
    written: Written = FORMATS[kind].write(made)
    losses = said(written.losses)
    assert all(loss.endswith(".") for loss in losses)
    return READERS[kind](written.content), losses


def features(made: Report) -> list[dict[str, Any]]:
    content = json.loads(geojson.write(made).content)
    assert content.keys() == {"type", "features"}
    return list(content["features"])


def in_words(number: int) -> str:
    """What our writers put behind the remark of an observation of OBSERVATIONS."""
    fields = OBSERVATIONS[number]
    u95_cm = -(-round(1000 * (0.02 + 0.0025 * fields["distance_m"])) // 10)
    parts = [
        f"joint {fields['joint_no']}" if "joint_no" in fields else "",
        f"+/-{u95_cm / 100:.2f} m",
        f"severity {fields['severity']}" if "severity" in fields else "",
    ]
    return ", ".join(part for part in parts if part)


def test_en13508_holds_every_field_of_every_observation(tmp_path: Path) -> None:
    read, _ = write("en13508", report(tmp_path))
    for number, (row, fields) in enumerate(zip(read.rows, OBSERVATIONS, strict=True)):
        assert float(row["I"]) == fields["distance_m"]
        assert row["A"] == (fields["code"] or "BDB")
        assert row["B"] == fields.get("char1", "")
        assert row["C"] == fields.get("char2", "")
        role = {"start": "A", "change": "C", "finish": "B"}.get(fields.get("cont_role", ""), "")
        assert row["J"] == (f"{role}{fields['cont_id']}" if role else "")
        assert row["G"] == str(fields.get("clock_from", ""))
        assert row["H"] == str(fields.get("clock_to", ""))
        assert row["K"] == ("A" if fields.get("at_joint") else "")
        assert row["M"] == f"CUL-0041-{number + 1:03d}.jpg"
        assert in_words(number) in row["F"]
        seconds = int(100 * fields["distance_m"]) // 30
        assert row["N"] == f"00:{seconds // 60:02d}:{seconds % 60:02d}"
    quantities = {n: row["D"] for n, row in enumerate(read.rows) if row["D"]}
    assert quantities == {0: "HW-UP", 1: "10", 2: "2", 3: "4", 4: "4", 5: "18", 11: "HW-DN"}
    assert read.rows[6]["F"].startswith('dripping; text with "quote", and comma, ')


def test_en13508_has_the_header_of_the_published_example() -> None:
    read, _ = write("en13508", report())
    stated = {name: value for name, value in read.header.items() if value}
    assert stated == {
        "AAA": "CUL-0041", "AAB": "HW-UP", "AAD": "HW-UP", "AAF": "HW-DN", "AAK": "A",
        "AAM": "Road authority", "ABA": "EN 13508-2:2003+A1:2011", "ABC": "A", "ABE": "B",
        "ABF": "2026-09-14", "ABG": "09:42", "ABH": "Operator 1", "ABI": "JOB-77", "ABM": "A",
        "ABQ": "24.6", "ABS": "CUL-0041_20260914_0942.mp4", "ACA": "A", "ACB": "900",
        "ACC": "900", "ACD": "AG", "ACG": "1.5", "AAE": "51.4525000 9.0000000",
        "AAG": "51.4525000 9.0003541", "ACJ": "A", "ACK": "E",
        "ADE": "known length source: tape",
    }  # fmt: skip
    always = {"ACM", "ADA"}  # of the fields that every file has, those that are empty here
    assert read.header.keys() == stated.keys() | always


def test_letters_are_transliterated_and_never_lost_to_a_question_mark() -> None:
    remark = "Größe ±5 cm – 45° naïve кирпич 钢"
    made = report(observations=[{"distance_m": 1.0, "code": "BDB", "remark": remark}])
    for kind in ("en13508", "ribx"):
        read, losses = write(kind, made)
        text = read.rows[0]["F"]
        assert text.startswith("Groesse +/-5 cm - 45 deg naive kirpich Gang")
        assert "?" not in text
        assert any("ASCII" in loss for loss in losses)


@pytest.mark.parametrize("kind", ["isybau", "m150"])
def test_german_formats_keep_every_letter(kind: str) -> None:
    remark = "Größe – 钢筋 <b> & \x07bell\x00 \ud800half"
    made = report(observations=[{"distance_m": 1.0, "code": "BDB", "remark": remark}])
    content = FORMATS[kind].write(made).content
    assert "Größe".encode("latin-1") in content
    assert b"&#8211;" in content
    read, _ = write(kind, made)
    assert read.rows[0][REMARK[kind]].startswith("Größe – 钢筋 <b> & bell half, ")


def test_ribx_holds_every_field_of_every_observation(tmp_path: Path) -> None:
    read, losses = write("ribx", report(tmp_path))
    assert read.header["ABA"] == "EN 13508-2+A1:2011"
    assert read.header["ABG"] == "09:42:00"
    assert read.more["explained"]["ABK"] == "file on disk"
    film = "CUL-0041_20260914_0942.mp4"
    assert read.rows[6] == {
        "A": "BBF", "B": "B", "F": f'dripping; text with "quote", and comma, {in_words(6)}',
        "G": "03", "I": "9.75", "K": "A", "M": "CUL-0041-007.jpg", "N": f"{film}|00:00:32",
    }  # fmt: skip
    assert read.rows[2]["J"] == "A1"
    assert (read.rows[8]["G"], read.rows[8]["H"]) == ("09", "02")
    assert (
        "RIBX requires values that are not known here: "
        "ABJ (Client's reference), ACM (Cleaned before)." in losses
    )


def test_ribx_writes_dutch_ends_in_the_dutch_grid() -> None:
    dutch = {"start_lat": 52.155, "start_lon": 5.387, "end_lat": 52.155, "end_lon": 5.3874}
    read, _ = write("ribx", report(header={**HEADER, **dutch}))
    back = Transformer.from_crs(28992, 4326, always_xy=True)
    lon, lat = back.transform(*read.more["points"]["AAE"])
    assert (lon, lat) == pytest.approx((5.387, 52.155), abs=1e-6)  # 0.1 m
    assert read.more["points"]["AAG"][0] > read.more["points"]["AAE"][0]


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
    read, _ = write("m150", report(observations=[fine]))
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


@each
def test_a_survey_against_the_flow_keeps_the_pipe_and_turns_the_run(kind: str) -> None:
    made = report(header={**HEADER, "direction": "against_flow"})
    read, _ = write(kind, made)
    upstream = {"isybau": "KnotenZulauf", "m150": "HG003"}.get(kind, "AAD")
    direction = {"isybau": "Inspektionsrichtung", "m150": "HI101"}.get(kind, "AAK")
    letter = {"isybau": "U", "m150": "G"}.get(kind, "B")
    assert (read.header[upstream], read.header[direction]) == ("HW-DN", letter)
    if kind in ("en13508", "en13508xml", "ribx"):
        assert read.header["AAB"] == "HW-UP"
    else:
        first, second = map(float, read.more["easting"])
        assert first - second == pytest.approx(LENGTH_M, abs=0.02)


@each
def test_start_and_end_frame_the_survey_whatever_their_distance(kind: str) -> None:
    made = report(
        observations=[
            {"distance_m": 0.1, "code": "BBF", "char1": "A"},
            {"distance_m": 0.2, "code": "BCD", "char1": "Z"},
            {"distance_m": 5.0, "code": "BDC", "char1": "A"},
            {"distance_m": 5.4, "code": "BAC", "char1": "A"},
        ]
    )
    read, losses = write(kind, made)
    assert [row[CODE[kind]] for row in read.rows] == ["BCD", "BBF", "BAC", "BDC"]
    assert "Observation 1 lies before the start, which is written first." in losses
    assert "Observation 4 lies beyond the end, which is written last." in losses


@each
def test_what_cannot_be_a_row_of_its_own_is_reported(kind: str) -> None:
    made = report(
        observations=[
            {"distance_m": 1.0, "code": None, "remark": "look here"},
            {"distance_m": 2.0, "code": "CRK7", "char1": "Q", "quant1": 3.0},
            {"distance_m": -0.3, "code": "BAC", "char1": "A"},
            {"distance_m": None, "code": "BAC", "char1": "A"},
        ]
    )
    read, losses = write(kind, made)
    first, tag, foreign = read.rows
    assert float(first[DISTANCE[kind]]) == 0
    assert "at -0.30 m" in first[REMARK[kind]]
    assert (tag[CODE[kind]], foreign[CODE[kind]]) == ("BDB", "BDB")
    assert tag[REMARK[kind]].startswith("look here, tag without a code, ")
    assert foreign[REMARK[kind]].startswith("coded CRK7 Q, 3, ")
    reported = " ".join(losses)
    for sentence in (
        "Observation 1 has no code", "Observation 2 is coded CRK7",
        "Observation 3 lies before the zero point", "Observation 4 is not tracked",
        "no observation of its start (BCD)", "no observation of its end (BCE",
        "fields: Calibration",
    ):  # fmt: skip
        assert sentence in reported


@pytest.mark.parametrize(("kind", "longest"), [("isybau", 30), ("m150", 16)])
def test_long_names_are_cut_and_stay_apart(kind: str, longest: int) -> None:
    long = "Headwall of Jalan Kampung Baru, "
    made = report(header={**HEADER, "start_node": f"{long}north", "end_node": f"{long}south"})
    read, losses = write(kind, made)
    up, down = ("KnotenZulauf", "KnotenAblauf") if kind == "isybau" else ("HG003", "HG004")
    assert read.header[up] != read.header[down]
    assert len(read.header[up]) <= longest
    assert f"The name {long}north is written as {read.header[up]}." in losses


@each
def test_an_empty_header_and_no_observations_still_make_a_file(kind: str) -> None:
    read, losses = write(kind, report(header={}, observations=[], distance_m=None))
    assert read.rows == []
    assert "The header names no start node; the file says START." in losses
    if kind in ("en13508", "en13508xml", "ribx"):
        assert read.header["AAF"] == "END", "without it a reader sees a lateral"


@each
def test_an_import_without_a_film_names_none(kind: str) -> None:
    made = report(source=Source("import", "old.txt", 10, "ab", {}))
    read, _ = write(kind, made)
    film = {"isybau": "Videoablagereferenz", "m150": "HI116"}.get(kind, "ABS")
    assert not read.header.get(film)
    video = {"isybau": "", "m150": "HZ008"}.get(kind, "N")
    assert not any(row.get(video) for row in read.rows)


@each
@few
@given(made=reports())
def test_any_report_makes_a_file_that_its_reader_takes(kind: str, made: Report) -> None:
    read, losses = write(kind, made)
    tracked = [entry for entry in made.entries if entry.distance_m is not None]
    assert len(read.rows) == len(tracked)
    left_out = [entry.seq for entry in made.entries if entry.distance_m is None]
    for seq in left_out:
        assert any(loss.startswith(f"Observation {seq} is not tracked") for loss in losses)


@each
@few
@given(made=reports())
def test_rows_are_sorted_between_start_and_end(kind: str, made: Report) -> None:
    read, _ = write(kind, made)
    between = [row for row in read.rows if row[CODE[kind]] not in ("BCD", "BCE", "BDC")]
    distances = [float(row[DISTANCE[kind]]) for row in between]
    assert distances == sorted(distances)


def test_every_format_names_the_same_photos(tmp_path: Path) -> None:
    made = report(tmp_path)
    photos = {kind: [row[PHOTO[kind]] for row in write(kind, made)[0].rows] for kind in READERS}
    points = [it["properties"] for it in features(made) if it["properties"]["kind"] != "run"]
    photos["geojson"] = [each["photo_file"] for each in points if "photo_file" in each]
    assert len({tuple(names) for names in photos.values()}) == 1


def test_geojson_lies_on_the_line_between_the_ends() -> None:
    run, *others = features(report())
    assert run["geometry"]["coordinates"] == [[9.0, 51.4525], [9.0003541, 51.4525]]
    assert run["properties"]["distance_class"] == "5 %"
    geod = Geod(ellps="WGS84")
    for feature in others:
        stated = feature["properties"]
        if stated["kind"] == "observation":
            lon, lat = feature["geometry"]["coordinates"]
            *_, along_m = geod.inv(9.0, 51.4525, lon, lat)
            assert along_m == pytest.approx(stated["distance_m"], abs=0.03)
    kinds = [feature["properties"]["kind"] for feature in others]
    assert (kinds.count("observation"), kinds.count("stretch")) == (12, 1)
    stretch = others[-1]
    assert stretch["properties"]["length_m"] == 3.2
    assert len({feature["id"] for feature in [run, *others]}) == 14


def test_geojson_keeps_an_observation_that_is_not_tracked_without_a_place() -> None:
    _, point = features(report(observations=[{"distance_m": None, "code": "BAC"}]))
    assert point["geometry"] is None
    assert point["properties"]["code"] == "BAC"


@pytest.mark.parametrize(
    ("stated", "chainage_m"),
    [("12+340", 12340.0), ("1250.5", 1250.5), ("0+045.25", 45.25), ("near km 12", None)],
)
def test_geojson_states_where_on_the_road_the_culvert_is(
    stated: str, chainage_m: float | None
) -> None:
    made = report(header={**HEADER, "road_chainage": stated})
    assert {it["properties"].get("road_chainage_m") for it in features(made)} == {chainage_m}


def test_road_chainage_runs_from_one_end_to_the_other() -> None:
    road = {"road_chainage": "km 12 + 340", "road_chainage_end": "12+364.6"}
    run, *others = features(report(header={**HEADER, **road}))
    ends = [run["properties"][f"road_chainage_{end}"] for end in ("m", "end_m")]
    assert ends == [12340.0, 12364.6]
    for feature in others[:-1]:
        stated = feature["properties"]
        assert stated["road_chainage_m"] == pytest.approx(12340 + stated["distance_m"])
    stretch = others[-1]["properties"]
    assert [stretch["road_chainage_m"], stretch["road_chainage_end_m"]] == [12343.2, 12346.4]
    assert not any("of the road" in loss for loss in said(geojson.write(report()).losses))


BEND: Line = ((9.0, 51.4525), (9.0, 51.4526), (9.0003541, 51.4526), (9.0003541, 51.4525))
"""North, east and south again: 11.13 m, 24.60 m and 11.13 m."""


@pytest.mark.parametrize("line", [BEND, BEND[::-1]], ids=["as surveyed", "from its other end"])
def test_geojson_follows_the_line_of_the_register(line: Line) -> None:
    written = geojson.write(report(line=line))
    run, *others = json.loads(written.content)["features"]
    assert run["geometry"]["coordinates"] == [list(point) for point in BEND]
    geod = Geod(ellps="WGS84")
    drawn_m = geod.line_length(*zip(*BEND, strict=True))
    assert any(f"{drawn_m:.2f} m long" in loss for loss in said(written.losses))
    for feature in others:
        stated, places = feature["properties"], feature["geometry"]["coordinates"]
        if stated["kind"] == "observation":
            along_m = stated["distance_m"] / LENGTH_M * drawn_m
            before = [point for point, at_m in zip(BEND, (0, 11.13, 35.73), strict=False)
                      if at_m < along_m]  # fmt: skip
            way = [*before, places] if before else [places]
            assert geod.line_length(*zip(*way, strict=True)) == pytest.approx(along_m, abs=0.03)
    assert others[-1]["properties"]["kind"] == "stretch"
    assert BEND[1] in [tuple(point) for point in others[-1]["geometry"]["coordinates"][1:-1]]


def test_a_line_that_is_elsewhere_does_not_count() -> None:
    away = tuple((lon + 1, lat) for lon, lat in BEND)
    assert geojson.write(report(line=away)).content == geojson.write(report()).content


def test_the_line_of_the_register_stands_for_ends_that_are_not_stated() -> None:
    header = {name: value for name, value in HEADER.items() if not name.endswith(("_lat", "_lon"))}
    run, *_ = features(report(header=header, line=BEND))
    assert run["geometry"]["coordinates"] == [list(point) for point in BEND]


@pytest.mark.parametrize(
    ("header", "named"),
    [
        ({"start_lat": None}, "Fill in start_lat of the header"),
        ({"end_lat": "north", "end_lon": ""}, "Fill in end_lat, end_lon of the header"),
        ({"start_lat": 91, "known_length_m": 3}, "Fill in start_lat of the header"),
    ],
)
def test_geojson_without_both_ends_says_which_fields_are_missing(
    header: dict[str, Any], named: str
) -> None:
    with pytest.raises(ExportNotAvailable, match=named):
        geojson.write(report(header={**HEADER, **header}))


def test_geojson_without_a_length_says_so() -> None:
    header = {name: value for name, value in HEADER.items() if name != "known_length_m"}
    with pytest.raises(ExportNotAvailable, match="known_length_m"):
        geojson.write(report(header=header, distance_m=None))


@few
@given(made=reports())
def test_geojson_of_any_report_is_refused_or_within_the_world(made: Report) -> None:
    try:
        found = features(made)
    except ExportNotAvailable:
        return
    for feature in found:
        if feature["geometry"] is None:
            continue
        points = feature["geometry"]["coordinates"]
        for lon, lat in points if feature["geometry"]["type"] == "LineString" else [points]:
            assert -180 <= lon <= 180
            assert -90 <= lat <= 90


WRITTEN_AS = {
    "direction": {"B", "U", "G"}, "shape": {"B", "3", "shape: rectangular"},
    "cleaned": {"A", "1", "J"}, "tether": {"tether: yes"}, "road_chainage": {"12+340"},
    "purpose": {"1", "purpose: first_survey"}, "method": {"A", "1", "method: walk_through"},
    "start_lat": {"51.4525000 9.0000000", "500000.000"}, "time": {"09:42", "09:42:00"},
    "end_lon": {"51.4525000 9.0003541", "500024.6"}, "asset_type": {"asset type: drain"},
    "standard": {"EN 13508-2", "EN13508", "8"}, "end_condition": {"BDC", "survey abandoned"},
    "temperature_c": {"12.5", "13"}, "water_level_pct": {"17", "water level: 17 %"},
}  # fmt: skip
WRITTEN_AS |= {"start_lon": WRITTEN_AS["start_lat"], "end_lat": WRITTEN_AS["end_lon"]}
"""What stands for a field whose value is not written as it is."""


@each
@pytest.mark.parametrize("field", [field.name for field in FIELDS])
def test_a_header_field_is_in_the_file_or_among_the_losses(kind: str, field: str) -> None:
    read, losses = write(kind, report(header=EVERY_FIELD, observations=[]))
    more = (read.more.get(name, []) for name in ("easting", "nodes"))
    texts = [*map(str, read.header.values()), *(str(one) for some in more for one in some)]
    wanted = WRITTEN_AS.get(field, {str(EVERY_FIELD[field])})
    is_written = any(
        text == one or (len(one) > 2 and one in text) for one in wanted for text in texts
    )
    no_place = [loss for loss in losses if "no place for these header fields" in loss]
    named = [name for loss in no_place for name in loss.split(": ")[1][:-1].split(", ")]
    is_lost = ENGLISH.field(field) in named
    if field.endswith(("_lat", "_lon")) and kind == "ribx":
        is_lost = any("Dutch grid" in loss and ENGLISH.field(field) in loss for loss in losses)
    assert is_written != is_lost, (is_written, is_lost)


@pytest.mark.parametrize(
    ("kind", "rounded"),
    [
        ("isybau", "Height 900.4 as 900, Known length 24.605 as 24.61, Temperature 12.5 as 13"),
        ("m150", "Height 900.4 as 900, Water level 17.5 as 18, Temperature 12.25 as 12.3"),
    ],
)
def test_a_header_field_that_a_german_format_rounds_is_among_the_losses(
    kind: str, rounded: str
) -> None:
    finer = {"height_mm": 900.4, "water_level_pct": 17.5}
    finer |= {"known_length_m": 24.605, "temperature_c": 12.5 if kind == "isybau" else 12.25}
    name = {"isybau": "ISYBAU", "m150": "DWA-M 150"}[kind]
    _, losses = write(kind, report(header={**EVERY_FIELD, **finer}))
    assert f"{name} holds these header fields rounded: {rounded}." in losses
    coarse = {"temperature_c": 12}
    _, losses = write(kind, report(header={**EVERY_FIELD, **coarse}))
    assert not any("rounded:" in loss for loss in losses)


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


@pytest.mark.parametrize("kind", ["en13508", "ribx"])
def test_lists_of_the_standard_hold_letters_and_words_stand_beside_them(kind: str) -> None:
    listed = {
        "purpose": "routine", "temperature_c": 12.5, "flow_control": "upstream shut",
        "lining_type": "sprayed", "lining_material": "concrete", "asset_type": "storm",
    }  # fmt: skip
    read, _ = write(kind, report(header={**EVERY_FIELD, **listed}))
    letters = ("ABP", "ADB", "ADC", "ACE", "ACF", "ACJ", "ACK")
    assert [read.header[code] for code in letters] == ["C", "A", "B", "B", "AG", "A", "B"]
    assert "temperature: 12.5" in read.header["ADE"]
    other, _ = write(kind, report(header=EVERY_FIELD))
    assert [other.header[code] for code in ("ABP", "ADC", "ACE")] == ["Z", "Z", "Z"]


@pytest.mark.parametrize("kind", ["en13508", "ribx"])
@pytest.mark.parametrize(
    ("code", "field", "meanings"),
    [
        ("AAK", "direction", {"with_flow": "A", "against_flow": "B", "unknown": "C"}),
        ("ABC", "reference_point", {
            "inner face of the headwall": "A", "crown of the pipe": "B",
            "centre of the manhole": "C", "half way along the channel": "D", "fence": "Z"}),
        ("ABE", "method", {"walk_through": "A", "camera": "B", "from_end_only": "C"}),
        ("ABP", "purpose", {
            "acceptance": "A", "end_of_warranty": "B", "routine": "C", "after_repair": "G",
            "follow_up": "Z"}),
        ("ACD", "material", {"cast iron": "AM", "grey cast iron": "AN", "ductile iron": "AO"}),
        ("ACE", "lining_type", {
            "factory": "A", "sprayed": "B", "cured in place": "C", "segments": "D",
            "discrete pipes": "E", "continuous pipe": "F", "close fit": "G", "spiral": "H"}),
        ("ACK", "asset_type", {
            "foul": "A", "storm": "B", "combined": "C", "culvert": "E", "drain": "Z"}),
        ("ACM", "cleaned", {True: "A", False: "B"}),
        ("ADA", "weather", {"dry": "A", "rain": "B", "snow": "C"}),
        ("ADB", "temperature_c", {12.5: "A", -3: "B"}),
        ("ADC", "flow_control", {"none": "A", "upstream shut": "B", "partly": "C", "x": "Z"}),
    ],
)  # fmt: skip
def test_letters_are_those_of_the_standard(
    kind: str, code: str, field: str, meanings: Mapping[Any, str]
) -> None:
    for value, letter in meanings.items():
        read, _ = write(kind, report(header={**HEADER, field: value}, observations=[]))
        assert read.header[code] == letter, value


@each
def test_the_reason_of_an_abandoned_survey_stands_at_its_end(kind: str) -> None:
    end = {"distance_m": 5.0, "code": "BDC", "char1": "A", "remark": "silt"}
    read, _ = write(kind, report(header=EVERY_FIELD, observations=[end]))
    assert read.rows[-1][REMARK[kind]].startswith("robot stuck in silt, ")
    if kind == "isybau":
        assert read.rows[-1]["GrundAbbruch"] == "GN"


@pytest.mark.parametrize("kind", ["csv", "geojson"])
def test_what_a_table_or_a_map_leaves_out_is_among_the_losses(kind: str) -> None:
    details = " ".join(said(FORMATS[kind].write(report()).losses))
    assert "joints and the corrections are in the XLSX" in details
    assert ("the header" in details) is (kind == "csv")


def test_cover_and_summary_say_that_the_survey_was_abandoned() -> None:
    page = FORMATS["html"].write(report(header=EVERY_FIELD)).content.decode()
    sentence = "The survey was abandoned before the far end: robot stuck in silt"
    assert page.count(sentence) == 2
    assert "abandoned" not in FORMATS["html"].write(report()).content.decode()


@pytest.mark.parametrize("kind", ["en13508", "ribx"])
def test_the_name_of_a_film_is_no_path_in_latin_letters(kind: str) -> None:
    made = report()
    names = [
        write(kind, replace(made, source=replace(made.source, filename=name)))[0].header["ABS"]
        for name in ("Film \u00be.mp4", "DL-Ä41.mp4", "DL-Ö41.mp4", "DL-Ae41.mp4")
    ]
    assert all(re.fullmatch(r"[\w.-]+\.mp4", name, re.ASCII) for name in names)
    assert len(set(names)) == 4


def test_isybau_names_road_year_and_order() -> None:
    read, _ = write("isybau", report(header=EVERY_FIELD))
    names = ("Strassenname", "Baujahr", "Auftragsnummer")
    assert [read.header[name] for name in names] == ["Dorfstrasse", "1987", "ORDER-12"]


def test_en13508_writes_back_what_an_import_kept_of_a_code() -> None:
    read, _ = write("en13508", report(header={**HEADER, "en13508_aaq": "C", "en13508_abe": "D"}))
    assert (read.header["AAQ"], read.header["ABE"]) == ("C", "D")
