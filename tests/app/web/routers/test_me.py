"""Who is logged in, and what he has chosen."""

from typing import Any

import pytest
from builders import Client, assert_error

CRACK = {
    "code": "BAB",
    "char1": "C",
    "char2": "A",
    "severity": 3,
    "quant1": 2.0,
    "quant2": None,
    "clock_from": 12,
    "clock_to": None,
}
CHOSEN: dict[str, Any] = {
    "language": "ms",
    "units": "ft",
    "quick_codes": [CRACK],
    "templates": [CRACK | {"clock_from": 10, "clock_to": 2}],
    "single_keys": False,
    "pack": None,
}


def test_before_the_first_choice_there_are_defaults(server: Client) -> None:
    me = server.get("/api/me").json()
    assert (me["name"], me["role"]) == ("server", "admin")
    chosen = me["preferences"]
    assert (chosen["language"], chosen["units"], chosen["pack"]) == (None, "m", None)
    assert [quick["code"] for quick in chosen["quick_codes"]] == [
        "BAB", "BAC", "BAF", "BAJ", "BBA", "BBB", "BBC", "BBF", "BDD",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "change",
    [
        {"language": "xx"},
        {"units": "furlong"},
        {"units": None},
        {"quick_codes": [{"code": "BAB", "char1": None, "char2": None}] * 10},
        {"quick_codes": [{"code": "<b>", "char1": None, "char2": None}]},
        {"quick_codes": ["BAB"]},
        {"templates": [{"code": "BAB", "char1": None, "char2": None}] * 27},
        {"pack": "../x"},
        {"theme": "pink"},
    ],
)
def test_a_choice_out_of_bounds_is_refused(shared: Client, change: dict[str, Any]) -> None:
    answer = shared.put("/api/me/preferences", json=CHOSEN | change)
    assert_error(answer, 422, "invalid_request")


def test_a_pack_that_is_not_there_cannot_be_chosen(shared: Client) -> None:
    answer = shared.put("/api/me/preferences", json=CHOSEN | {"pack": "0" * 32})
    assert_error(answer, 404, "pack_not_found")


def test_nobody_has_preferences_without_logging_in(shared: Client) -> None:
    assert_error(shared.anonymous().get("/api/me"), 401, "unauthenticated")
