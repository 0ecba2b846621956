"""Shared steps of the tests of access: an address of every route, a session, a refused socket."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import httpx
import pytest
from builders import PATIENCE_S, TOKEN, Client
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
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


def routes_of(routes: Iterable[BaseRoute]) -> Iterator[tuple[str, str, Callable[..., Any]]]:
    """Method (WS for a web socket), path and endpoint of all that the server answers to, in the
    schema or not; files apart.
    """
    for route in routes:
        if isinstance(route, WebSocketRoute):
            yield "WS", route.path, route.endpoint
        elif isinstance(route, Mount):
            assert route.path == "/static"
        elif isinstance(route, Route):
            for method in sorted(route.methods or ()):
                yield method, route.path_format, route.endpoint
        else:
            yield from routes_of(route.original_router.routes)  # type: ignore[attr-defined]


def bearer(token: str) -> dict[str, str]:
    """The header by which a program shows its token."""
    return {"Authorization": f"Bearer {token}"}


def ask(client: Client, method: str, url: str, headers: dict[str, str]) -> httpx.Response:
    """As a program does; a web socket by the HTTP request that would open it."""
    if method == "WS":
        headers |= {
            "Origin": client.server.url,
            "Connection": "Upgrade",
            "Upgrade": "websocket",
            "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
            "Sec-WebSocket-Version": "13",
        }
    with client.stream("GET" if method == "WS" else method, url, headers=headers) as answer:
        if answer.status_code != 101:
            answer.read()
    return answer


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
