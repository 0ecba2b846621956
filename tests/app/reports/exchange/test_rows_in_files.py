"""Every field of an observation in every exchange format, or among its losses; their order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from exchange_files import (
    FULL_OBSERVATION,
    READERS,
    assert_comes_back,
    column,
    each,
    each_of_the_standard,
    write,
)
from hypothesis import given
from random_reports import reports
from reports import EVERY_FIELD, HEADER, OBSERVATIONS, codes, measured, report, said

from app.reports.formats import FORMATS
from app.reports.report import Report

REMARK = 'at the mill; "there", joint 6, +/-0.04 m, severity 4'
LETTERS = {
    "I": "7.32", "J": "A7", "A": "BAB", "B": "B", "C": "A", "D": "18.25", "E": "4.5", "G": "9",
    "H": "11", "K": "A", "M": "CUL-0041-001.jpg", "N": "00:01:01", "F": REMARK,
}  # fmt: skip
ROW: Mapping[str, Mapping[str, str]] = {
    "en13508": LETTERS,
    "en13508xml": LETTERS,
    "ribx": {**LETTERS, "G": "09", "N": "CUL-0041_20260914_0942.mp4|00:01:01"},
    "isybau": {
        "Index": "1", "Station": "7.32", "Timecode": "00010100", "InspektionsKode": "BAB",
        "Charakterisierung1": "B", "Charakterisierung2": "A", "Verbindung": "1",
        "Quantifizierung1Numerisch": "18.25", "Quantifizierung2Numerisch": "4.50",
        "Streckenschaden": "A", "StreckenschadenLfdNr": "7", "PositionVon": "09",
        "PositionBis": "11", "Fotodatei": "CUL-0041-001.jpg", "Kommentar": REMARK,
    },
    "m150": {
        "HZ001": "7.3", "HZ002": "BAB", "HZ003": "18.3", "HZ004": "4.5", "HZ005": "A7",
        "HZ006": "09", "HZ007": "11", "HZ008": "00:01:01", "HZ009": "CUL-0041-001.jpg",
        "HZ010": REMARK, "HZ011": "A", "HZ014": "B", "HZ015": "A",
        "HZ999": "station 7.32 m, quantity 1 18.25",
    },
}  # fmt: skip
LOST = {
    "part.raw", "part.basis", "part.to_go", "part.numbers", "part.wall_points", "part.places",
}  # fmt: skip
"""What no row holds."""
COARSE = {
    "part.photo_checksums", "part.rounded_distances", "part.rounded_intervals",
    "part.rounded_times",
}  # fmt: skip


@each
def test_a_row_holds_every_field_or_the_losses_name_it(kind: str) -> None:
    read, losses = write(kind, report(None, [FULL_OBSERVATION]))
    assert read.rows == [ROW[kind]]
    assert codes(losses) >= LOST | COARSE
    half = {**FULL_OBSERVATION, "clock_from": None, "clock_to": 3, "quant1": 0.125}
    live = replace(report().source, kind="live", sha256="")
    read, losses = write(kind, replace(report(None, [half]), source=live))
    assert {"half_sector 1", "no_time 1"} <= codes(losses)
    if kind == "isybau":
        assert read.rows[0]["Quantifizierung1Text"] == "0.125", "finer than a number there"
    made = report(None, [FULL_OBSERVATION])
    _, losses = write(kind, replace(made, entries=tuple(map(measured, made.entries))))
    assert "part.measures" in codes(losses), "a field of a tag without a column"


@each
def test_what_is_not_there_is_not_said_to_be_lost(kind: str) -> None:
    bare = {
        **dict.fromkeys(FULL_OBSERVATION), "distance_m": 7.3, "u95_m": 0.04,
        "time_s": 61.0, "frame": 1830, "at_joint": False, "code": "BAB", "tagged_by": "Olga",
    }  # fmt: skip
    empty = replace(report(None, [bare]), name=HEADER["asset_id"])
    _, losses = write(kind, empty)
    never = {"ascii", "one_line", "part.name", "part.corrections", "part.history", "part.joints"}
    assert not codes(losses) & (never | COARSE | LOST - {"part.numbers"})
    _, losses = write(kind, replace(empty, entries=()))
    assert "part.numbers" not in codes(losses)


@each
def test_a_full_report_comes_back(kind: str, tmp_path: Path) -> None:
    made = report(tmp_path)
    survey = assert_comes_back(kind, made)
    for row, fields in zip(survey.observations, OBSERVATIONS, strict=True):
        stated = row.tag(0).to_json()
        assert row.distance_m == fields["distance_m"]
        for name in ("char1", "char2", "quant1", "clock_from", "clock_to", "severity"):
            assert stated.get(name) == fields.get(name), name
        assert row.at_joint == fields.get("at_joint", False)
        assert row.time_s == int(100 * fields["distance_m"]) // 30
    assert [row.stretch for row in survey.observations][2:5] == ["A1", "C1", "B1"]
    assert [row.photo for row in survey.observations] == [
        f"CUL-0041-{n:03d}.jpg" for n in range(1, len(OBSERVATIONS) + 1)
    ]
    assert survey.header["video_files"] == made.source.filename
    read, _ = write(kind, made)
    first, last = read.rows[0], read.rows[-1]
    if kind in ("isybau", "m150"):
        assert first[column(kind, "char1")] == last[column(kind, "char1")] == "XP"
        assert first[column(kind, "remark")].endswith("coded BCD Z")
    else:
        assert (first["D"], last["D"]) == ("HW-UP", "HW-DN")


@each
@pytest.mark.parametrize("letter", ["x", "\u00f6", "\u94a2", "\U0001f573"])
def test_the_longest_remarks_of_the_api_come_back(kind: str, letter: str) -> None:
    made = report(
        observations=[
            {"distance_m": 3.0, "code": "BDB", "remark": 4000 * letter, "severity": 3},
            {"distance_m": 4.0, "code": "BDC", "char1": "A", "remark": "silt"},
        ],
        header={**HEADER, "remarks": 2000 * letter, "end_condition": "abandoned",
                "abandon_reason": 1000 * letter, "shape": "rectangular", "width_mm": 1500},
    )  # fmt: skip
    assert_comes_back(kind, made)


def test_m150_writes_the_exact_station_beside_the_rounded_one() -> None:
    fine = {"distance_m": 9.75, "code": "BAB", "char1": "B", "char2": "A"}
    _, losses = write("m150", report(observations=[fine]))
    assert any("distances to 100 mm" in sentence for sentence in said(losses))
    assert "station_beside" in codes(losses)
    _, coarse = write("m150", report(observations=[{**fine, "distance_m": 9.7}]))
    assert not {"station_beside", "part.rounded_distances"} & codes(coarse)


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
    assert [row[column(kind, "code")] for row in read.rows] == ["BCD", "BBF", "BAC", "BDC"]
    assert {"before_start 1", "beyond_end 4"} <= codes(losses)


@each
def test_what_cannot_be_a_row_of_its_own_is_reported(kind: str) -> None:
    made = report(
        observations=[
            {"distance_m": 1.0, "code": None, "remark": "look here", "quant1": 18.25},
            {"distance_m": 2.0, "code": "CRK7", "char1": "Q", "quant1": 3.0},
            {"distance_m": -0.3, "code": "BAC", "char1": "A"},
            {"distance_m": None, "code": "BAC", "char1": "A"},
        ]
    )
    read, losses = write(kind, made)
    code, remark = column(kind, "code"), column(kind, "remark")
    first, tag, foreign = read.rows
    assert float(first[column(kind, "distance_m")]) == 0
    assert "at -0.30 m" in first[remark]
    assert (tag[code], foreign[code]) == ("BDB", "BDB")
    assert tag[remark].startswith("look here, tag without a code, 18.25, ")
    assert foreign[remark].startswith("coded CRK7 Q, 3, ")
    assert {
        "no_code 1", "foreign_code 2", "before_zero 3", "untracked 4", "no_start", "no_end",
        "no_place", "field.calibration_id",
    } <= codes(losses)  # fmt: skip


def test_what_changes_along_the_pipe_and_dutch_measurements_are_codes() -> None:
    rows = [
        {"distance_m": 1.0, "code": "AED", "char1": "STZ"},
        {"distance_m": 2.0, "code": "BXA", "char1": "J", "quant1": -1.0},
    ]
    written = {kind: write(kind, report(observations=rows)) for kind in ("en13508", "ribx")}
    for read, losses in written.values():
        assert (read.rows[0]["A"], read.rows[0]["B"]) == ("AED", "STZ")
        assert "foreign_code 1" not in codes(losses)
    ribx, text = written["ribx"][0].rows[1], written["en13508"][0].rows[1]
    assert (ribx["A"], ribx["B"], ribx["D"], text["A"]) == ("BXA", "J", "-1", "BDB")


def test_a_row_without_a_time_is_reported_where_one_must_stand() -> None:
    read, losses = write("isybau", report(None, [{**FULL_OBSERVATION, "time_s": None}]))
    assert read.rows[0]["Timecode"] == "00000000"
    assert "time_is_zero 1" in codes(losses)


@each
def test_the_reason_of_an_abandoned_survey_stands_at_its_end(kind: str) -> None:
    end = {"distance_m": 5.0, "code": "BDC", "char1": "A", "remark": "silt"}
    read, _ = write(kind, report(header=EVERY_FIELD, observations=[end]))
    assert read.rows[-1][column(kind, "remark")].startswith("robot stuck in silt, ")
    if kind == "isybau":
        assert read.rows[-1]["GrundAbbruch"] == "GN"


@given(made=reports())
def test_any_report_makes_files_that_their_readers_take_with_sorted_rows(made: Report) -> None:
    tracked = [entry for entry in made.entries if entry.distance_m is not None]
    left_out = len(made.entries) - len(tracked)
    for kind in READERS:
        read, losses = write(kind, made)
        assert len(read.rows) == len(tracked), kind
        assert sum(loss.key == "untracked" for loss in losses) == left_out, kind
        between = [
            float(row[column(kind, "distance_m")])
            for row in read.rows
            if row[column(kind, "code")] not in ("BCD", "BCE", "BDC")
        ]
        assert between == sorted(between), kind


LETTERS_OF_ALL = "Größe ±5 cm – 45° naïve кирпич 钢 <b> & \x07bell\x00 \ud800half"


@each
def test_letters_are_kept_or_transliterated_and_no_question_mark_stands_for_one(kind: str) -> None:
    row = {"distance_m": 1.0, "code": "BDB", "remark": LETTERS_OF_ALL, "time_s": 61.0}
    read, losses = write(kind, report(observations=[row]))
    remark = read.rows[0][column(kind, "remark")]
    whole = "Größe ±5 cm – 45° naïve кирпич 钢 <b> & bell half, "
    latin = "Groesse +/-5 cm - 45 deg naive kirpich Gang <b> & bell half, "
    assert remark.startswith(latin if kind == "en13508" else whole)
    assert "?" not in remark
    assert ("ascii" in codes(losses)) == (kind == "en13508")


@each_of_the_standard
def test_letters_of_an_import_come_back(kind: str) -> None:
    row = {"distance_m": 1.0, "code": "BDB", "remark": "Größe – 钢", "time_s": 61.0}
    made = report(observations=[row], header={**HEADER, "video_files": "Größe 1.mpg"})
    made = replace(made, source=replace(made.source, kind="import"))
    read, losses = write(kind, made)
    assert read.rows[0]["F"].startswith("Größe – 钢")
    assert read.rows[0]["N"].rpartition("|")[2] == "00:01:01"
    assert read.header["ABS"] == "Größe 1.mpg"
    assert not {"ascii", "film_renamed"} & codes(losses)


def test_a_text_that_is_changed_is_said_so_only_then() -> None:
    for kind in ("en13508", "m150"):
        for remark, is_changed in (("=1\r\n\x07", True), ("plain – 涵洞", False)):
            losses = (
                FORMATS[kind].write(report(None, [{**FULL_OBSERVATION, "remark": remark}])).losses
            )
            assert ("one_line" in codes(losses)) == is_changed, kind
