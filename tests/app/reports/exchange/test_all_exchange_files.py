"""What every exchange format keeps: the order of rows, names, losses, each header field."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from exchange_files import CODE, DISTANCE, PHOTO, READERS, REMARK, each, write
from hypothesis import given
from random_reports import reports
from reports import EVERY_FIELD, HEADER, LENGTH_M, codes, report

from app.reports.exchange import geojson
from app.reports.formats import FORMATS
from app.reports.report import Report, Source
from app.survey.fields.header import FIELDS


def features(made: Report) -> list[dict[str, Any]]:
    content = json.loads(geojson.write(made).content)
    assert content.keys() == {"type", "features"}
    return list(content["features"])


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
    assert {"before_start 1", "beyond_end 4"} <= codes(losses)


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
    assert {
        "no_code 1", "foreign_code 2", "before_zero 3", "untracked 4", "no_start", "no_end",
        "no_place", "field.calibration_id",
    } <= codes(losses)  # fmt: skip


@each
def test_an_empty_header_and_no_observations_still_make_a_file(kind: str) -> None:
    read, losses = write(kind, report(header={}, observations=[], distance_m=None))
    assert read.rows == []
    (nameless,) = [loss for loss in losses if loss.key == "no_start_node"]
    assert nameless.values == {"written": "START"}
    if kind in ("en13508", "en13508xml", "ribx"):
        assert read.header["AAF"] == "END", "without it a reader sees a lateral"


@each
def test_an_import_without_a_film_names_none_and_keeps_its_times(kind: str) -> None:
    made = report(source=Source("import", "old.txt", 10, "ab", {}))
    read, _ = write(kind, made)
    film = {"isybau": "Videoablagereferenz", "m150": "HI116"}.get(kind, "ABS")
    assert not read.header.get(film)
    video = {"isybau": "Timecode", "m150": "HZ008"}.get(kind, "N")
    last = {"isybau": "00012200"}.get(kind, "00:01:22")
    assert read.rows[-1][video] == last


@given(made=reports())
def test_any_report_makes_files_that_their_readers_take_with_sorted_rows(made: Report) -> None:
    tracked = [entry for entry in made.entries if entry.distance_m is not None]
    left_out = {f"untracked {entry.seq}" for entry in made.entries if entry.distance_m is None}
    for kind in READERS:
        read, losses = write(kind, made)
        assert len(read.rows) == len(tracked), kind
        assert left_out <= codes(losses), kind
        between = [row for row in read.rows if row[CODE[kind]] not in ("BCD", "BCE", "BDC")]
        distances = [float(row[DISTANCE[kind]]) for row in between]
        assert distances == sorted(distances), kind


def test_every_format_names_the_same_photos(tmp_path: Path) -> None:
    made = report(tmp_path)
    photos = {kind: [row[PHOTO[kind]] for row in write(kind, made)[0].rows] for kind in READERS}
    points = [it["properties"] for it in features(made) if it["properties"]["kind"] != "run"]
    photos["geojson"] = [each["photo_file"] for each in points if "photo_file" in each]
    assert len({tuple(names) for names in photos.values()}) == 1


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
def test_a_header_field_is_in_the_file_or_among_the_losses(kind: str) -> None:
    read, losses = write(kind, report(header=EVERY_FIELD, observations=[]))
    lost = codes(loss for loss in losses if loss.key in ("no_place", "dutch_grid"))
    more = (read.more.get(name, []) for name in ("easting", "nodes"))
    texts = [*map(str, read.header.values()), *(str(one) for some in more for one in some)]

    def is_written(field: str) -> bool:
        wanted = WRITTEN_AS.get(field, {str(EVERY_FIELD[field])})
        return any(
            text == one or (len(one) > 2 and one in text) for one in wanted for text in texts
        )

    both_or_neither = [
        field.name for field in FIELDS if is_written(field.name) == (f"field.{field.name}" in lost)
    ]
    assert not both_or_neither


@each
def test_the_reason_of_an_abandoned_survey_stands_at_its_end(kind: str) -> None:
    end = {"distance_m": 5.0, "code": "BDC", "char1": "A", "remark": "silt"}
    read, _ = write(kind, report(header=EVERY_FIELD, observations=[end]))
    assert read.rows[-1][REMARK[kind]].startswith("robot stuck in silt, ")
    if kind == "isybau":
        assert read.rows[-1]["GrundAbbruch"] == "GN"


def test_what_a_table_or_a_map_leaves_out_is_among_the_losses() -> None:
    for kind, left_out in (("csv", "table_only"), ("geojson", "only_observations")):
        assert left_out in codes(FORMATS[kind].write(report()).losses)
