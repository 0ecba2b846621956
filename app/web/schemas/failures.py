"""How requests fail, and what else than JSON they answer with."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from app.errors import ChangedMeanwhile, code_of
from app.web.answers import EVERYWHERE, STATUS


class ErrorOut(BaseModel):
    """The one body of every failure."""

    code: str
    detail: str


class ChangedMeanwhileOut(ErrorOut):
    """Of a change whose `If-Match` names another version than the one that is stored."""

    current: dict[str, Any] | None
    """What is stored; null if it was deleted."""
    yours: dict[str, Any]
    """What would have been stored."""


Responses = dict[int | str, dict[str, Any]]


def failures(*kinds: type[Exception]) -> Responses:
    """For `responses=` of a route: how it may refuse, besides what is refused everywhere."""
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
    """For `responses=` of a route that does not answer with JSON."""
    return {200: {"content": {media_type: {} for media_type in media_types}}}
