"""Shares of what belongs to all: nobody waits for everything that one person wants."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from weakref import WeakValueDictionary

from anyio.lowlevel import RunVar

from app.errors import Busy

_Own = WeakValueDictionary[str, asyncio.Semaphore]


class Turns:
    """Lets `most` requests through at a time, and `each` of one person; the others wait."""

    def __init__(self, name: str, *, most: int, each: int) -> None:
        self._most, self._each = most, each
        self._limits: RunVar[tuple[asyncio.Semaphore, _Own]] = RunVar(name)
        """Of the running event loop: all requests, and by person."""

    @asynccontextmanager
    async def turn(self, person: str) -> AsyncIterator[None]:
        """Wait for a turn, and take it until the block ends."""
        try:
            every, of = self._limits.get()
        except LookupError:
            every, of = asyncio.Semaphore(self._most), _Own()
            self._limits.set((every, of))
        own = of.setdefault(person, asyncio.Semaphore(self._each))
        async with own, every:
            yield


class Shares:
    """Counts what is held, and refuses more of it to one holder."""

    def __init__(self, what: str) -> None:
        self._what = what
        self._held: Counter[str] = Counter()

    @contextmanager
    def share(self, most: int, *holders: str) -> Iterator[None]:
        """Hold one until the block ends; each holder has `most`.

        Raises:
            Busy: One of the holders has as many as it may have.
        """
        if any(self._held[holder] >= most for holder in holders):
            raise Busy(
                f"{most} {self._what} are open with this token or from this address, and no "
                "more are allowed; close some."
            )
        self._held.update(holders)
        try:
            yield
        finally:
            self._held.subtract(holders)
            self._held += Counter()  # forgets who holds none
