"""Who has an inspection open, and which observation each of them is editing.

Only pages that say so are listed: a second window of a desk or a program that reads the live socket
is nobody.  All of this runs on the event loop.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from app.access.access import Principal

MOST_NAMED = 50
"""Most others in one message."""


@dataclass(frozen=True)
class Person:
    """Somebody with a page of the inspection."""

    name: str
    """That of the token."""
    editing: str | None
    """The observation whose form is open there."""


class Seat:
    """One page of an inspection."""

    def __init__(self, principal: Principal, seats: set[Seat]) -> None:
        """Take the seats of the same inspection, in which this one is kept by the caller."""
        self._principal = principal
        self._seats = seats
        self._person: Person | None = None
        self._has_news = asyncio.Event()

    def state(self, editing: str | None) -> None:
        """List the page, with the observation that is edited there; the others learn of it."""
        person = Person(self._principal.name, editing)
        if person == self._person:
            return
        is_new, self._person = self._person is None, person
        self.announce()
        if is_new:
            self._has_news.set()

    def announce(self) -> None:
        """Wake the other pages."""
        for seat in self._seats:
            if seat is not self:
                seat._has_news.set()

    async def news(self) -> list[Person]:
        """Wait until the others may have changed; return them sorted, without the own browser."""
        await self._has_news.wait()
        self._has_news.clear()
        others = [
            seat._person
            for seat in self._seats
            if seat._person is not None and not self._is_same_browser(seat)
        ]
        return sorted(others, key=lambda one: (one.name, one.editing or ""))[:MOST_NAMED]

    def _is_same_browser(self, other: Seat) -> bool:
        return other._principal.credential == self._principal.credential


class Presence:
    """The seats of all inspections that are open."""

    def __init__(self) -> None:
        self._seats: dict[str, set[Seat]] = {}
        self._on_first: Callable[[], None] | None = None

    def on_first(self, run: Callable[[], None]) -> None:
        """Call this once when the first page is opened; a running server may be told so."""
        self._on_first = run

    @contextmanager
    def seat(self, inspection_id: str, principal: Principal) -> Iterator[Seat]:
        """Provide a seat until the block ends; the others learn when it is left."""
        seats = self._seats.setdefault(inspection_id, set())
        seat = Seat(principal, seats)
        seats.add(seat)
        first, self._on_first = self._on_first, None
        if first is not None:
            first()
        try:
            yield seat
        finally:
            seats.discard(seat)
            seat.announce()
            if not seats:
                self._seats.pop(inspection_id, None)
