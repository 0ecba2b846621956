"""GeoJSON: where observations, stretches and the culvert lie, and what it refuses."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from pyproj import Geod
from random_reports import reports
from reports import HEADER, LENGTH_M, codes, report

from app.errors import ExportNotAvailable
from app.reports.exchange import geojson
from app.reports.report import Report
from app.survey.assets.register import Line


def features(made: Report) -> list[dict[str, Any]]:
    content = json.loads(geojson.write(made).content)
    assert content.keys() == {"type", "features"}
    return list(content["features"])


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


def test_geojson_tells_places_apart_that_are_two_millimetres_apart() -> None:
    made = report(observations=[{"distance_m": 5.0 + n / 500, "code": "BAB"} for n in range(5)])
    places = [it["geometry"]["coordinates"][0] for it in features(made)[1:]]
    assert len(set(places)) == 5
    assert max(abs(lon - round(lon, 8)) for lon in places) == 0


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
    assert "road_chainage_of_start" not in codes(geojson.write(report()).losses)


BEND: Line = ((9.0, 51.4525), (9.0, 51.4526), (9.0003541, 51.4526), (9.0003541, 51.4525))
"""North, east and south again: 11.13 m, 24.60 m and 11.13 m."""


@pytest.mark.parametrize("line", [BEND, BEND[::-1]], ids=["as surveyed", "from its other end"])
def test_geojson_follows_the_line_of_the_register(line: Line) -> None:
    written = geojson.write(report(line=line))
    run, *others = json.loads(written.content)["features"]
    assert run["geometry"]["coordinates"] == [list(point) for point in BEND]
    geod = Geod(ellps="WGS84")
    drawn_m = geod.line_length(*zip(*BEND, strict=True))
    (scaled,) = [loss.values["drawn"] for loss in written.losses if loss.key == "scaled_line"]
    assert scaled == f"{drawn_m:.2f}"
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
