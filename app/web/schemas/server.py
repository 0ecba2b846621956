"""How the server and what is connected to it do."""

from __future__ import annotations

from dataclasses import asdict
from typing import Literal

from pydantic import BaseModel

from app.meter_counter.line import Connection


class MeterCounterOut(BaseModel):
    """How it is with the software that takes Chainage for its meter counter."""

    peer: str | None
    """Its address; None where none is configured."""
    is_connected: bool
    detail: str | None
    """Why not, in a sentence."""

    @classmethod
    def of(cls, connection: Connection) -> MeterCounterOut:
        """From the service's."""
        return cls(**asdict(connection))


class CheckOut(BaseModel):
    """One part of the server."""

    name: str
    ok: bool
    detail: str


class ReadyOut(BaseModel):
    """The server takes work."""

    status: Literal["ready"]
    checks: list[CheckOut]


class AliveOut(BaseModel):
    """The server runs."""

    status: Literal["alive"]
