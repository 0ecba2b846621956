"""Failures of requests, and answers other than JSON."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from app.errors import (
    STATUS,
    ChangedMeanwhile,
    FrameNotFound,
    InspectionNotFound,
    MediaFailed,
    MediaTimeout,
    NothingRecorded,
    code_of,
)
from app.web.answers import EVERYWHERE
from vo_core.errors import UnreadableVideo

READING_A_FILM = (FrameNotFound, NothingRecorded, UnreadableVideo, MediaFailed, MediaTimeout)
"""How reading a frame of a film may fail."""


class ErrorOut(BaseModel):
    """The common body of every failure."""

    code: str
    detail: str


class ChangedMeanwhileOut(ErrorOut):
    """The answer to a change whose `If-Match` names another version than the stored one."""

    current: dict[str, Any] | None
    """The stored content; null if it was deleted."""
    yours: dict[str, Any] | None
    """The content that would have been stored; null if it would have been deleted."""


Responses = dict[int | str, dict[str, Any]]

_SCHEMAS = "#/components/schemas/"


def failures(*kinds: type[Exception]) -> Responses:
    """Build `responses=` of a route: how it may refuse, beyond what every route may, and every
    route of an inspection, which may not exist.

    It refers to the bodies, which `describe` adds to the document. For each `model` FastAPI would
    make a validator that nobody uses: more than a thousand, which delayed the first answer of a
    server by half a second.
    """
    codes = {status: list(names) for status, names in EVERYWHERE.items()}
    for status, code in ((STATUS[kind], code_of(kind)) for kind in kinds):
        codes.setdefault(status, []).append(code)
    models = {STATUS[ChangedMeanwhile]: ChangedMeanwhileOut} if ChangedMeanwhile in kinds else {}
    return {
        status: {
            "description": ", ".join(f"`{name}`" for name in names),
            "content": {"application/json": {"schema": {"$ref": f"{_SCHEMAS}{body.__name__}"}}},
        }
        for status, names in codes.items()
        for body in (models.get(status, ErrorOut),)
    }


def describe(app: FastAPI) -> None:
    """Add the bodies of failures to the OpenAPI document of `app`."""
    openapi = app.openapi

    def with_failures() -> dict[str, Any]:
        document = openapi()
        _, schema = models_json_schema(
            [(ErrorOut, "serialization"), (ChangedMeanwhileOut, "serialization")],
            ref_template=f"{_SCHEMAS}{{model}}",
        )
        document["components"]["schemas"] |= schema["$defs"]
        for path, operations in document["paths"].items():
            for operation in operations.values() if "{inspection_id}" in path else ():
                answer = operation["responses"]["404"]
                answer["description"] += f", `{code_of(InspectionNotFound)}`"
        return document

    app.openapi = with_failures  # type: ignore[method-assign]


def content(*media_types: str) -> Responses:
    """Build `responses=` of a route that does not answer with JSON."""
    return {200: {"content": {media_type: {} for media_type in media_types}}}
