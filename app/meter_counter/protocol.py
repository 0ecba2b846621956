"""Messages between a meter counter and WinCan ProTouch: JSON objects over TCP.

ProTouch is the server and ends each message with a line feed; its public simulator does not, so an
object counts as soon as it is complete.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

API_VERSION = 2
"""From this version on, a status says whether the camera is in a lateral."""

_M_PER_UNIT: Mapping[object, float] = {"m": 1.0, "meter": 1.0, "ft": 0.3048, "feet": 0.3048}
_CHANGE = "CHANGE_METER_COUNTER_VALUE_REQ"
_LONGEST_BYTES = 64 * 2**10
"""Longest message; anything longer is discarded."""
_LONGEST_SHOWN = 100
"""Characters of a name, or of an id that is text."""

MessageId = int | str


@dataclass(frozen=True)
class ChangeRequest:
    """A request of the operator to set the counter."""

    message_id: MessageId
    """Id that the answer repeats."""
    value_m: float | None
    """None if the value is not a length."""


@dataclass(frozen=True)
class Other:
    """A message that needs no answer."""

    name: str


Heard = ChangeRequest | Other


def choose_version(message_id: int) -> bytes:
    """Build the first message of a connection."""
    return _message(message_id, "SETUP", "CHOOSE_API_VERSION", {"value": API_VERSION})


def status(message_id: int, value_m: float) -> bytes:
    """Build the message that reports a changed distance."""
    payload = {"value": value_m, "unit": "meter", "isLateral": False}
    return _message(message_id, "MONITORING", "METER_COUNTER_STATUS_IND", payload)


def changed(message_id: MessageId) -> bytes:
    """Build the answer that confirms the requested value."""
    return _change_answer(message_id, is_done=True, error="")


def refused(message_id: MessageId, reason: str) -> bytes:
    """Build the answer that refuses the requested value."""
    return _change_answer(message_id, is_done=False, error=reason)


class Listener:
    """Splits received bytes into messages and drops everything else, of any length."""

    def __init__(self) -> None:
        self._rest = b""

    def hear(self, received: bytes) -> list[Heard]:
        """Return the messages that are now complete."""
        *lines, self._rest = (self._rest + received).split(b"\n")
        found = [message for line in lines for message in _objects(line)[0]]
        messages, used = _objects(self._rest)
        self._rest = self._rest[used:]
        if len(self._rest) > _LONGEST_BYTES:
            self._rest = b""
        return [heard for each in (*found, *messages) if (heard := _understood(each)) is not None]


def _objects(line: bytes) -> tuple[list[dict[str, Any]], int]:
    """Return the objects at the beginning of a line, and the number of bytes that they take."""
    try:
        text = line.decode()
    except UnicodeDecodeError:  # incomplete, or garbage
        return [], 0
    found, at = [], 0
    for value, end in _values(text):
        at = end
        if isinstance(value, dict):
            found.append(value)
    return found, len(text[:at].encode())


def _values(text: str) -> Iterator[tuple[object, int]]:
    """Yield consecutive JSON values, each with its end, until one is invalid."""
    decoder, at = json.JSONDecoder(), 0
    while start := text.find("{", at) + 1:
        if text[at : start - 1].strip():
            return
        try:
            value, at = decoder.raw_decode(text, start - 1)
        except (ValueError, RecursionError):
            return
        yield value, at


def _understood(message: Mapping[str, Any]) -> Heard | None:
    """Return the message, or None for JSON that is no message."""
    header, payload = message.get("header"), message.get("payload")
    if not isinstance(header, dict):
        return None
    name, message_id = header.get("messageName"), header.get("messageId")
    if not isinstance(name, str):
        return None
    if name != _CHANGE or not isinstance(message_id, int | str) or isinstance(message_id, bool):
        return Other(name[:_LONGEST_SHOWN])
    if len(str(message_id)) > _LONGEST_SHOWN:
        return Other(name[:_LONGEST_SHOWN])
    fields = payload if isinstance(payload, dict) else {}
    return ChangeRequest(message_id, _metres(fields.get("value"), fields.get("unit", "m")))


def _metres(value: object, unit: object) -> float | None:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not isinstance(unit, str) or unit not in _M_PER_UNIT:
        return None
    try:
        metres = float(value) * _M_PER_UNIT[unit]  # type: ignore[arg-type]
    except OverflowError:
        return None
    return metres if math.isfinite(metres) else None


def _change_answer(message_id: MessageId, *, is_done: bool, error: str) -> bytes:
    payload = {"status": is_done, "errorCode": int(not is_done), "error": error}
    return _message(message_id, "CONTROL", "CHANGE_METER_COUNTER_VALUE_RESP", payload)


def _message(message_id: MessageId, kind: str, name: str, payload: Mapping[str, Any]) -> bytes:
    header = {"messageId": message_id, "messageType": kind, "messageName": name}
    content = {"header": header, "payload": payload}
    return json.dumps(content, separators=(",", ":"), allow_nan=False).encode() + b"\n"
