"""Failures of requests, and answers other than JSON."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from app.errors import (
    ChangedMeanwhile,
    FrameNotFound,
    MediaFailed,
    MediaTimeout,
    NothingRecorded,
    code_of,
)
from app.web.answers import EVERYWHERE, STATUS
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


def failures(*kinds: type[Exception]) -> Responses:
    """Build `responses=` of a route: how it may refuse, beyond what every route may."""
    codes = {status: list(names) for status, names in EVERYWHERE.items()}
    for status, code in ((STATUS[kind], code_of(kind)) for kind in kinds):
        codes.setdefault(status, []).append(code)
    models = {STATUS[ChangedMeanwhile]: ChangedMeanwhileOut} if ChangedMeanwhile in kinds else {}
    return {
        status: {
            "model": models.get(status, ErrorOut),
            "description": ", ".join(f"`{name}`" for name in names),
        }
        for status, names in codes.items()
    }


def content(*media_types: str) -> Responses:
    """Build `responses=` of a route that does not answer with JSON."""
    return {200: {"content": {media_type: {} for media_type in media_types}}}
