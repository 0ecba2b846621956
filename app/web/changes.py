"""Notes for a browser that what it shows of an inspection must be read again."""

from __future__ import annotations

import asyncio

from app.tracking.live import Event

EVERY_S = 1.0
"""Least time between two notes of changes, and between two of people: reading the list of 2000 tags
again takes the server 0.15 s."""


class Changes:
    """Whether something has changed since the last note, however often."""

    def __init__(self, *kinds: type) -> None:
        """Follow events of these kinds."""
        self._kinds = kinds
        self._loop = asyncio.get_running_loop()
        self._are_due = asyncio.Event()

    def listen(self, event: Event) -> None:
        """Receive an event; called from any thread."""
        if isinstance(event, self._kinds):
            self._loop.call_soon_threadsafe(self._are_due.set)

    async def next(self) -> None:
        """Wait for a change."""
        await self._are_due.wait()
        self._are_due.clear()
