"""Shared steps of the tests of access: an address of every route, a session, a refused socket."""

from __future__ import annotations

import json

import pytest
from builders import PATIENCE_S, TOKEN, Client
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect


def example(parameter: str) -> str:
    """Return a value for a parameter of a path; nothing has this id."""
    return {
        "frame": "0",
        "kind": "csv",
        "observation_id": "00000000-0000-4000-8000-000000000000",
        "finding_id": "00000000-0000-4000-8000-000000000000",
    }.get(parameter, "0" * 32)


def log_in(client: Client, token: str = TOKEN) -> Client:
    """Return a browser with a session."""
    browser = client.anonymous()
    browser.headers["Origin"] = client.server.url
    assert browser.post("/api/login", json={"token": token}).status_code == 204
    return browser


def refusal(url: str, origin: str | None, headers: dict[str, str]) -> int:
    """Return the status with which a WebSocket is refused; check the body."""
    with (
        pytest.raises(InvalidStatus) as caught,
        connect(url, origin=origin, additional_headers=headers, open_timeout=PATIENCE_S),
    ):
        pass
    body = json.loads(caught.value.response.body)
    assert body.keys() == {"code", "detail"}
    return int(caught.value.response.status_code)
