"""A film whose burnt-in counter has faults, tracked and read once for all tests that look at it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import counter_drives
import pytest
from builders import Client, serving, wait_until
from counter_drives import CounterDrive
from surveys import Survey, tracked_once

DRIVE = CounterDrive()
"""Its counter counts 2 % too little, stuck once, and was set to 0 once."""
READ_WITHIN_S = 240.0
"""Readings give way to all other work of a busy machine."""


def faulty_drive(temporary: pytest.TempPathFactory) -> Survey:
    """`DRIVE`, with its counter as it was read."""

    def track(data: Path) -> str:
        film = counter_drives.write(DRIVE, temporary.mktemp("drives") / "faulty.mp4")
        with serving(data) as client:
            inspection = inspect(client, film)
            assert settled(client, inspection)["state"] == "read"
        return inspection

    return tracked_once(temporary, "faulty-counter", track)


def inspect(client: Client, film: Path, *, is_present: bool = True) -> str:
    """Start an inspection of a film, with or without a search for its counter; return its id."""
    counter = {"is_present": is_present}
    return client.inspect(film, rig=counter_drives.rig(), counter=counter)


def counter(client: Client, inspection: str) -> dict[str, Any]:
    """Return what is known about its counter."""
    return dict(client.get(f"/api/inspections/{inspection}/counter").json())


def settled(client: Client, inspection: str) -> dict[str, Any]:
    """Wait until it is not being read any more."""

    def look() -> dict[str, Any] | None:
        found = counter(client, inspection)
        return found if found["state"] != "waiting" else None

    return wait_until(look, READ_WITHIN_S)
