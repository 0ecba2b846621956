"""Export, import, export of every exchange format: the same bytes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from brought_in import reported
from hypothesis import assume, given
from random_reports import STORED_HEADERS, reports
from reports import EVERY_FIELD, HEADER, OBSERVATIONS, codes, report

from app.imports import any_file
from app.imports.survey import ImportedFile, ImportedSurvey
from app.reports.formats import FORMATS
from app.reports.report import Report

KINDS = ("en13508", "en13508xml", "ribx", "isybau", "m150")
each = pytest.mark.parametrize("kind", KINDS)


def survey_in(content: bytes) -> ImportedSurvey:
    file = any_file.read(content)
    assert isinstance(file, ImportedFile)
    (survey,) = file.surveys
    return survey


def assert_comes_back(kind: str, made: Report) -> ImportedSurvey:
    """What is not as it was has a warning, of which the tests below allow none."""
    first = FORMATS[kind].write(made).content
    survey = survey_in(first)
    assert survey.warnings == ()
    again = FORMATS[kind].write(reported(made, survey)).content
    assert again.decode("latin-1").splitlines() == first.decode("latin-1").splitlines()
    return survey


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
    assert [row.photo for row in survey.observations] == [
        f"CUL-0041-{n:03d}.jpg" for n in range(1, len(OBSERVATIONS) + 1)
    ]
    assert survey.header["video_files"] == made.source.filename


DUTCH = {"start_lat": 52.155, "start_lon": 5.387, "end_lat": 52.156, "end_lon": 5.3874}


@each
def test_the_ends_come_back_to_their_places(kind: str) -> None:
    places = DUTCH if kind == "ribx" else {name: HEADER[name] for name in DUTCH}
    for direction in ("with_flow", "against_flow", "unknown"):
        made = report(header={**HEADER, **places, "direction": direction})
        header = assert_comes_back(kind, made).header
        for name, degrees in places.items():
            assert header[name] == pytest.approx(degrees, abs=1e-7), name
        assert header["direction"] == direction


@each
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"shape": "other", "direction": "unknown"},
        {"end_condition": "complete", "material": "", "remarks": "a, year: 1987"},
        {"reference_point": "the old bridge", "material": "bamboo", "weather": "fog"},
        {"method": "walk_through", "shape": "other", "start_lat": None},
        {"start_node": "", "end_node": "", "date": "", "time": ""},
    ],
)  # fmt: skip
def test_a_header_with_every_field_comes_back(kind: str, changes: Mapping[str, Any]) -> None:
    assert_comes_back(kind, report(header={**EVERY_FIELD, **changes}))


@each
def test_fields_without_a_place_in_the_format_are_fields_again(kind: str) -> None:
    header = {**EVERY_FIELD, "video_files": "", "edition": ""}
    found = assert_comes_back(kind, report(header=header)).header
    for name in (
        "reviewer", "operator_certificate", "cleaned_on", "known_length_source", "road_chainage",
        "water_level_pct", "asset_type", "direction", "method", "contractor", "reference_point",
        "weather", "flow_control", "material", "upstream_node",
    ):  # fmt: skip
        assert found.get(name) == EVERY_FIELD[name], name
    assert str(found["remarks"]).startswith("mind the dog")
    assert "Rita" not in str(found["remarks"])


@given(made=reports(), header=STORED_HEADERS)
def test_anything_comes_back(made: Report, header: Mapping[str, Any]) -> None:
    assume(made.distance_m is not None or not made.entries)
    made = replace(made, header=header)
    for kind in KINDS:
        survey = survey_in(FORMATS[kind].write(made).content)
        if not survey.warnings:  # a sign of one letter may take several in ASCII, and be too long
            assert_comes_back(kind, made)


@each
def test_the_longest_remarks_of_the_api_come_back(kind: str) -> None:
    for letter in ("x", "\u00f6", "\u94a2", "\U0001f573"):
        made = report(
            observations=[
                {"distance_m": 3.0, "code": "BDB", "remark": 4000 * letter, "severity": 3},
                {"distance_m": 4.0, "code": "BDC", "char1": "A", "remark": "silt"},
            ],
            header={**HEADER, "remarks": 2000 * letter, "end_condition": "abandoned",
                    "abandon_reason": 1000 * letter, "shape": "rectangular", "width_mm": 1500},
        )  # fmt: skip
        assert_comes_back(kind, made)


@pytest.mark.parametrize(
    ("kind", "kept"),
    [
        ("m150", {"m150_hg304": "BETON", "m150_hi106": "9", "m150_hi103": "7", "m150_hg302": "X"}),
        ("isybau", {"isybau_material": "OB", "isybau_wetter": "9", "isybau_profilart": "8",
                    "isybau_inspektionszweck": "8", "isybau_inspektionsverfahren": "3"}),
    ],
)  # fmt: skip
def test_values_outside_the_lists_of_a_format_come_back(kind: str, kept: dict[str, str]) -> None:
    header = {**HEADER, **kept, "material": "", "shape": "", "asset_type": ""}
    written = FORMATS[kind].write(report(header=header))
    assert not {*kept} & codes(written.losses)
    found = survey_in(written.content).header
    assert {name: found.get(name) for name in kept} == kept
