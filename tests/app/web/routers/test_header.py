"""The header of an inspection over HTTP: its fields, and values that do not fit."""

from builders import Client, assert_error

from app.survey.fields.header import FIELDS


def test_the_fields_are_listed_in_the_order_of_the_form(shared: Client) -> None:
    fields = shared.get("/api/header-fields").json()["fields"]
    assert [field["name"] for field in fields] == [field.name for field in FIELDS]
    by_name = {field["name"]: field for field in fields}
    assert by_name["known_length_m"] == {
        "name": "known_length_m", "group": "more", "kind": "number", "choices": [], "unit": "m",
        "minimum": 0.001, "maximum": 100000,
    }  # fmt: skip
    assert by_name["direction"]["choices"] == ["with_flow", "against_flow", "unknown"]


def test_a_value_that_does_not_fit_its_field_is_refused(shared: Client, own: str) -> None:
    path, header = f"/api/inspections/{own}", {"known_length_m": 2.5, "other_tools_field": "x"}
    shared.patch(path, json={"header": header}).raise_for_status()
    answer = shared.patch(path, json={"header": {"known_length_m": "2.5", "direction": "down"}})
    detail = assert_error(answer, 422, "invalid_request")
    assert "known_length_m must be a number (not text)" in detail
    assert "direction must be one of with_flow, against_flow, unknown (found 'down')" in detail
    assert shared.inspection(own)["header"] == header
