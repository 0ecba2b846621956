"""Turns errors into HTTP answers.

Every failing answer has the same body, `{"code": "snake_case", "detail": "a sentence for a
person"}`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response
from starlette.websockets import WebSocket, WebSocketState

from app.errors import (
    NO_ROOM,
    STATUS,
    Busy,
    ChangedMeanwhile,
    DiskFull,
    OffsetConflict,
    StoreUnavailable,
    TooManyAttempts,
    Unauthenticated,
    UnsupportedTusVersion,
    code_of,
    shortened,
)
from app.logs import request_id
from app.survey.versions import version_of
from app.web.versions import etag
from vo_core.errors import ChainageError

_HEADERS: Mapping[type[Exception], Mapping[str, str]] = {
    Unauthenticated: {"WWW-Authenticate": "Bearer"},
    TooManyAttempts: {"Retry-After": "60"},
    UnsupportedTusVersion: {"Tus-Version": "1.0.0"},
    Busy: {"Retry-After": "2"},
    StoreUnavailable: {"Retry-After": "5"},
}

EVERYWHERE: dict[int, tuple[str, ...]] = {
    400: ("bad_request", "unknown_host"),
    401: ("unauthenticated",),
    403: ("cross_origin", "forbidden"),
    404: ("not_found",),
    408: ("request_timeout",),
    413: ("body_too_large",),
    422: ("invalid_request",),
    500: ("internal_error",),
    503: ("busy",),
    507: ("disk_full",),
}
"""Failures that any request may have."""

_HTTP_CODES = {
    400: ("bad_request", "The request cannot be understood."),
    404: ("not_found", "There is nothing at this address."),
    405: ("method_not_allowed", "This address does not accept that method."),
    408: ("request_timeout", "The request did not arrive completely in time; send it again."),
    413: ("body_too_large", "The body of the request is too large."),
    416: ("range_not_satisfiable", "The file has no such range."),
}


def body_of(error: Exception) -> tuple[int, dict[str, str]]:
    """Return status and body of the answer to `error`; unexpected errors are a plain 500."""
    if isinstance(error, OSError) and error.errno in NO_ROOM:  # any write may raise it
        error = DiskFull()
    for kind in type(error).__mro__:
        if kind in STATUS:
            return STATUS[kind], {"code": code_of(kind), "detail": shortened(str(error))}
    if isinstance(error, HTTPException):
        code, detail = _HTTP_CODES.get(error.status_code, ("request_refused", str(error.detail)))
        return error.status_code, {"code": code, "detail": detail}
    return 500, {
        "code": "internal_error",
        "detail": "An unexpected error occurred. It is in the server's log"
        + (f" as {found}." if (found := request_id.get()) else "."),
    }


def answer(error: Exception) -> JSONResponse:
    """Return the error response."""
    status, body = body_of(error)
    content: dict[str, Any] = dict(body)
    if isinstance(error, ChangedMeanwhile):
        content |= {"current": error.current, "yours": error.yours}
    headers = dict(_HEADERS.get(type(error), getattr(error, "headers", None) or {}))
    if isinstance(error, OffsetConflict):
        headers["Upload-Offset"] = str(error.offset)
    if isinstance(error, ChangedMeanwhile) and error.current is not None:
        headers["ETag"] = etag(version_of(error.current))
    return JSONResponse(content, status, headers)


_NOT_REPEATED = ("token", "source", "url")
"""Fields that may contain a password."""


def _validation_sentence(faults: Any) -> str:
    parts = []
    for fault in faults:
        if fault["type"] == "json_invalid":
            return f"The body is not JSON: {fault['ctx']['error']}."
        steps = (_legible(str(step)) for step in fault["loc"] if step != "body")
        where = ".".join(steps) or "the body"
        found = None if fault["loc"][-1] in _NOT_REPEATED else fault.get("input")
        shown = f" (found {found!r:.60})" if isinstance(found, str | int | float | bool) else ""
        message = str(fault["msg"]).removeprefix("Value error, ")
        parts.append(f"{where}: {message}{shown}")
    return shortened("; ".join(parts) + ".")


def _legible(name: str) -> str:
    """Make a field's name, which a client may have invented, legible."""
    return name[:60] if name.isprintable() else repr(name[:60])


async def _handle(connection: Request | WebSocket, error: Exception) -> Response:
    response = answer(error)
    if isinstance(connection, WebSocket):
        if connection.application_state is not WebSocketState.CONNECTING:
            raise error
        await connection.send_denial_response(response)
    return response


async def _handle_validation(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)  # noqa: S101  (registered for this class only)
    return JSONResponse(
        {"code": "invalid_request", "detail": _validation_sentence(error.errors())}, 422
    )


def install(app: FastAPI) -> None:
    """Give `app` the common body for every error; `middleware.Envelope` handles the rest."""
    app.add_exception_handler(ChainageError, _handle)
    app.add_exception_handler(HTTPException, _handle)
    app.add_exception_handler(RequestValidationError, _handle_validation)
