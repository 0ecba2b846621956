"""What a meter counter says and hears, as bytes; garbage never hurts."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.meter_counter.protocol import (
    ChangeRequest,
    Heard,
    Listener,
    Other,
    changed,
    choose_version,
    refused,
    status,
)

EXAMPLE = [
    {"header": {"messageId": 1, "messageType": "SETUP", "messageName": "CHOOSE_API_VERSION"},
     "payload": {"value": 2}},
    {"header": {"messageId": 2, "messageType": "MONITORING",
                "messageName": "METER_COUNTER_STATUS_IND"},
     "payload": {"value": 3.2, "unit": "meter", "isLateral": False}},
    {"header": {"messageId": 20, "messageType": "CONTROL",
                "messageName": "CHANGE_METER_COUNTER_VALUE_RESP"},
     "payload": {"status": True, "errorCode": 0, "error": ""}},
]  # fmt: skip
"""As the public simulator of the protocol has them."""


def change(
    message_id: Any = 20, name: str = "CHANGE_METER_COUNTER_VALUE_REQ", **payload: Any
) -> bytes:
    header = {"messageId": message_id, "messageType": "CONTROL", "messageName": name}
    return json.dumps({"header": header, "payload": payload}, separators=(",", ":")).encode()


def hear(*pieces: bytes) -> list[Heard]:
    listener = Listener()
    return [message for piece in pieces for message in listener.hear(piece)]


def test_what_is_said_has_the_form_of_the_protocol() -> None:
    said = [choose_version(1), status(2, 3.2), changed(20)]
    assert [json.loads(message) for message in said] == EXAMPLE
    assert all(message.count(b"\n") == 1 and message.endswith(b"}\n") for message in said)
    answer = json.loads(refused("a-7", "No live inspection runs."))
    assert answer["header"]["messageId"] == "a-7"
    assert answer["payload"] == {
        "status": False, "errorCode": 1, "error": "No live inspection runs.",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("payload", "value_m"),
    [
        ({"value": 0.0, "unit": "m"}, 0.0),
        ({"value": 12, "unit": "meter"}, 12.0),
        ({"value": 10, "unit": "ft"}, 3.048),
        ({"value": -1.5, "unit": "feet"}, -0.4572),
        ({"value": 1.5}, 1.5),
        ({"value": "1.5", "unit": "m"}, None),
        ({"value": True, "unit": "m"}, None),
        ({"value": float("nan"), "unit": "m"}, None),
        ({"value": float("inf"), "unit": "m"}, None),
        ({"value": 10**400, "unit": "m"}, None),
        ({"value": 1, "unit": "yard"}, None),
        ({"value": 1, "unit": ["m"]}, None),
        ({}, None),
    ],
)
def test_a_value_is_a_length_or_none(payload: dict[str, Any], value_m: float | None) -> None:
    (heard,) = hear(change(7, **payload) + b"\n")
    assert isinstance(heard, ChangeRequest)
    assert heard.message_id == 7
    assert heard.value_m == (None if value_m is None else pytest.approx(value_m))


def test_messages_count_with_and_without_a_line_feed_and_in_any_pieces() -> None:
    stream = change(1, value=1) + b"\n" + change(2, value=2) + change(3, value=3) + b"\r\n"
    for size in (1, 7, 100, len(stream)):
        pieces = [stream[at : at + size] for at in range(0, len(stream), size)]
        ids = [heard.message_id for heard in hear(*pieces) if isinstance(heard, ChangeRequest)]
        assert ids == [1, 2, 3]


def test_what_needs_no_answer_is_distinguished() -> None:
    stream = b"\n".join(
        (change(1, "START_VIDEO_STREAMING_REQ", port=1), change(None, value=1),
         change(True, value=1), change("x" * 101, value=1), change(2, "x" * 5000))
    )  # fmt: skip
    name = "CHANGE_METER_COUNTER_VALUE_REQ"
    assert hear(stream + b"\n") == [
        Other("START_VIDEO_STREAMING_REQ"), Other(name), Other(name), Other(name), Other("x" * 100),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "garbage",
    [
        b"\xff\xfe\x00", b"GET / HTTP/1.1\r\n\r\n", b"[1, 2]", b"null", b'{"header": 1}', b"{",
        b'{"header": {"messageName": 1}}', b"{}" * 1000, b'{"a":' * 20_000, b"[" * 60_000,
        b'{"header": ' + b"9" * 5000 + b"}", b"x" * 200_000, b'{"a": "' + b"x" * 200_000,
    ],
    ids=lambda garbage: repr(garbage[:16]),
)  # fmt: skip
def test_after_garbage_the_next_line_is_heard(garbage: bytes) -> None:
    pieces = [garbage[at : at + 4096] for at in range(0, len(garbage), 4096)]
    assert hear(*pieces, b"\n", change(5, value=1) + b"\n") == [ChangeRequest(5, 1.0)]


def test_a_message_without_an_end_takes_no_memory() -> None:
    listener = Listener()
    for _ in range(3000):
        listener.hear(b'{"a": "' + 4000 * b"x")
    assert len(listener._rest) < 100_000


@given(st.lists(st.binary(max_size=50) | st.text(max_size=30).map(str.encode), max_size=8))
def test_nothing_that_comes_in_is_a_fault(pieces: list[bytes]) -> None:
    hear(*pieces)
    hear(*(b'{"header":' + piece for piece in pieces))


def test_messages_of_others_are_heard_by_their_name() -> None:
    lines = [json.dumps(message).encode() for message in EXAMPLE]
    assert [heard.name for heard in hear(b"\n".join(lines)) if isinstance(heard, Other)] == [
        message["header"]["messageName"] for message in EXAMPLE
    ]
