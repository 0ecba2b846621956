"""State of the server and of its connections."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from app.survey.given import Given
from app.web.schemas.out import Out


class MeterCounterOut(Out):
    """The connection to the software that uses Chainage as its meter counter."""

    peer: str | None
    """Address of the software; None if none is configured."""
    is_connected: bool
    detail: str | None
    """A sentence that says why there is no connection."""


class IntendedUseIn(Given):
    """What distances are meant for: the widest half of a 95 % interval; the greater one counts."""

    within_m: Annotated[float, Field(gt=0, le=100)]
    percent: Annotated[float, Field(ge=0, le=100, description="Of the inspected length.")]


class CheckOut(BaseModel):
    """One part of the server."""

    name: str
    ok: bool
    detail: str


class ReadyOut(BaseModel):
    """Readiness of the server."""

    status: Literal["ready"]
    checks: list[CheckOut]


class AliveOut(BaseModel):
    """Liveness of the server."""

    status: Literal["alive"]


class ListedSourceOut(Out):
    """A live source found by the server."""

    url: str
    kind: Literal["usb", "folder", "pipe"]
    name: str


class SourcesOut(Out):
    """Live sources found by the server."""

    sources: list[ListedSourceOut]
