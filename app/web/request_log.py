"""Outermost layer: each request gets an id, is counted, and is logged if it matters."""

from __future__ import annotations

import logging
import re
import secrets
import time

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.logs import about, request_id
from app.ops.metrics import Metrics

logger = logging.getLogger(__name__)

_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
_METHODS = _SAFE_METHODS | {"POST", "PUT", "PATCH", "DELETE"}
_INSPECTION = re.compile(r"/([0-9a-f]{32})(?:/|$)")
_GONE = 499
"""Status for a client that disconnected before the answer."""


class RequestLog:
    """Logs changes and failures, not every tile and picture."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle an ASGI connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        request_id.set(secrets.token_hex(8))  # each request runs in its own context
        metrics: Metrics = scope["app"].state.services[Metrics]
        with about(_inspection_of(scope["path"])):
            if scope["type"] == "http":
                await self._answer(scope, receive, send, metrics)
            else:
                await self._serve_socket(scope, receive, send, metrics)

    async def _answer(self, scope: Scope, receive: Receive, send: Send, metrics: Metrics) -> None:
        status, began_s = _GONE, time.perf_counter()

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)["X-Request-Id"] = str(request_id.get())
            await send(message)

        try:
            await self._app(scope, receive, send_with_id)
        finally:
            duration_s = time.perf_counter() - began_s
            # All unknown methods share one label, or anybody could create any number of labels.
            method = scope["method"] if scope["method"] in _METHODS else "other"
            route = _route_of(scope)
            metrics.count_request(method, route, status, duration_s)
            if method not in _SAFE_METHODS or status >= 400:
                _log(method, route, status, round(1000 * duration_s, 1))

    async def _serve_socket(
        self, scope: Scope, receive: Receive, send: Send, metrics: Metrics
    ) -> None:
        clients = metrics.websocket_clients(
            "viewer" if scope["path"].startswith("/viewer/") else "live"
        )
        is_open = False

        async def send_and_count(message: Message) -> None:
            nonlocal is_open
            if message["type"] == "websocket.accept":
                is_open = True
                clients.inc()
            await send(message)

        try:
            await self._app(scope, receive, send_and_count)
        finally:
            if is_open:
                clients.dec()


def _log(method: str, route: str, status: int, duration_ms: float) -> None:
    logger.info(
        "%s %s: %d in %.0f ms",
        method,
        route,
        status,
        duration_ms,
        extra={"method": method, "route": route, "status": status, "duration_ms": duration_ms},
    )


def _route_of(scope: Scope) -> str:
    """Return the path with parameter names in place of values."""
    if scope["path"].startswith("/static/"):
        return "/static"
    return getattr(scope.get("route"), "path_format", "none")


def _inspection_of(path: str) -> str | None:
    found = _INSPECTION.search(path) if path.startswith(("/api/inspections/", "/viewer/")) else None
    return found[1] if found else None
