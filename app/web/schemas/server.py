"""State of the server and of its connections."""

from __future__ import annotations

from dataclasses import asdict
from typing import Literal

from pydantic import BaseModel

from app.meter_counter.line import Connection


class MeterCounterOut(BaseModel):
    """The connection to the software that uses Chainage as its meter counter."""

    peer: str | None
    """Address of the software; None if none is configured."""
    is_connected: bool
    detail: str | None
    """A sentence that says why there is no connection."""

    @classmethod
    def of(cls, connection: Connection) -> MeterCounterOut:
        """Convert the service's state."""
        return cls(**asdict(connection))


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
