"""The fields of a header: what they may hold, and which a report needs."""

import json
from pathlib import Path

import pytest

from app.survey.fields.header import FIELDS, faults, required_to_issue

WORDS = Path(__file__).parents[3] / "static" / "words"
COMPLETE = {
    "asset_id": "CUL-1", "start_node": "A", "end_node": "B", "direction": "with_flow",
    "date": "2026-03-31", "time": "14:05", "operator": "Ai", "client": "JKR",
    "asset_type": "culvert", "shape": "circular", "height_mm": 300, "material": "Concrete",
    "reference_point": "Headwall", "standard": "EN 13508-2", "end_condition": "complete",
}  # fmt: skip


def test_a_complete_header_misses_nothing():
    assert required_to_issue(COMPLETE) == []
    assert faults(COMPLETE) == []


@pytest.mark.parametrize("name", COMPLETE)
@pytest.mark.parametrize("empty", [None, "", "  "])
def test_each_required_field_is_missed_when_it_is_empty(name, empty):
    assert required_to_issue(COMPLETE | {name: empty}) == [name]


def test_of_an_empty_header_all_are_missed_in_the_order_of_the_form():
    assert required_to_issue({}) == list(COMPLETE)


def test_the_width_is_needed_unless_the_shape_is_circular():
    assert required_to_issue(COMPLETE | {"shape": "egg"}) == ["width_mm"]
    assert required_to_issue(COMPLETE | {"shape": "egg", "width_mm": 200}) == []


def test_an_abandoned_survey_needs_a_reason():
    assert required_to_issue(COMPLETE | {"end_condition": "abandoned"}) == ["abandon_reason"]


@pytest.mark.parametrize(
    ("name", "value", "fault"),
    [
        ("known_length_m", "12.5", "known_length_m must be a number"),
        ("known_length_m", 0, "known_length_m must be a number"),
        ("height_mm", True, "height_mm must be a number"),
        ("water_level_pct", 101, "water_level_pct must be a number (not text) from 0 to 100 %"),
        ("start_lat", -90.1, "start_lat must be a number"),
        ("direction", "with flow", "direction must be one of with_flow, against_flow, unknown"),
        ("date", "31.03.2026", "date must be a date such as 2026-03-31 (found '31.03.2026')"),
        ("date", "2026-02-30", "date must be a date"),
        ("date", "20260331", "date must be a date"),
        ("time", "24:00", "time must be a time of day"),
        ("cleaned", "yes", "cleaned must be true or false"),
        ("asset_id", 41, "asset_id must be text (found 41)"),
    ],
)
def test_a_value_of_another_kind_is_reported(name, value, fault):
    (reported,) = faults({name: value})
    assert reported.startswith(fault)


@pytest.mark.parametrize(
    "header",
    [
        {"known_length_m": 12.5, "height_mm": 300, "start_lon": -180},
        {"known_length_m": "", "direction": None, "date": " "},
        {"time": "23:59:59", "cleaned": False, "cleaned_on": "2024-02-29"},
        {"a_field_of_another_program": "anything", "distance": "12"},
    ],
)
def test_values_that_fit_and_fields_of_other_programs_pass(header):
    assert faults(header) == []


def test_names_stay_distinct():
    names = [field.name for field in FIELDS]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("language", [path.stem for path in WORDS.glob("*.json")])
def test_every_field_and_every_choice_has_a_word(language):
    words = json.loads((WORDS / f"{language}.json").read_text("utf-8"))["header"]
    assert {field.name for field in FIELDS} - words.keys() == set()
    choices = {choice for field in FIELDS for choice in field.choices}
    assert choices - words["choice"].keys() == set()
