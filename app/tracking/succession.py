"""What a server that has died leaves behind is taken over by the leader of the others."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Sequence
from typing import Protocol

from app.errors import Busy, DiskFull
from app.storage.members import Members
from app.storage.records.runs import RunStore
from app.tracking.worker import Worker

logger = logging.getLogger(__name__)

_LOOK_EVERY_S = 1.0
_GRACE_S = 4.0
"""A server that lost the database for less than this keeps its runs."""
_STOP_TIMEOUT_S = 5.0


class Service(Protocol):
    """A service that one server runs for all."""

    def start(self) -> None:
        """Start."""

    def stop(self) -> None:
        """Stop."""


class Heir(Protocol):
    """A service that each server runs, and that can do the work which another has left behind."""

    def take_over(self) -> None:
        """Do what a server that has ended left."""


class Duties:
    """What the leader does for all servers."""

    def __init__(self, *, of_the_leader: Sequence[Service], left_behind: Sequence[Heir]) -> None:
        self._services = of_the_leader
        self._heirs = left_behind
        self._lock = threading.Lock()
        """Guards the next fields."""
        self._started: list[Service] = []
        self._is_over = False

    def lead(self) -> None:
        """Begin, or begin again, to lead."""
        with self._lock:
            if self._is_over:
                return
            self.take_over()
            for service in self._services[len(self._started) :]:
                service.start()
                self._started.append(service)

    def take_over(self) -> None:
        """Do what servers that have ended left behind."""
        for heir in self._heirs:
            heir.take_over()

    def stop(self) -> None:
        """Stop what was started, for good."""
        with self._lock:
            self._is_over = True
            for service in reversed(self._started):
                service.stop()


class Succession(Worker):
    """A thread that looks for runs whose server is gone."""

    def __init__(
        self,
        members: Members,
        store: RunStore,
        released: Callable[[str], None],
        take_over: Callable[[], None],
    ) -> None:
        """Store what is needed.

        Args:
            members: The servers of the database.
            store: Their claims.
            released: Called with each inspection that is queued again.
            take_over: Does the rest that a server leaves behind.
        """
        super().__init__("succession", stop_timeout_s=_STOP_TIMEOUT_S)
        self._members = members
        self._store = store
        self._released = released
        self._take_over = take_over
        self._missing_s: dict[str, float] = {}
        """Since when the server of each name is gone."""

    def start(self) -> None:
        """Look, where there may be other servers."""
        if self._members.are_several:
            super().start()

    def _step(self) -> None:
        """Part of `_work`."""

    def _work(self) -> None:
        while not self._pause(_LOOK_EVERY_S):
            if not self._members.is_leading():
                self._missing_s.clear()
                continue
            try:
                self._look()
            except (Busy, DiskFull) as fault:
                logger.warning("The runs of other servers cannot be looked at: %s", fault)

    def _look(self) -> None:
        now_s = time.monotonic()
        gone = {name for name in self._store.owners() if not self._members.is_alive(name)}
        self._missing_s = {name: self._missing_s.get(name, now_s) for name in gone}
        dead = [name for name, since_s in self._missing_s.items() if now_s - since_s >= _GRACE_S]
        for name in dead:
            queued = self._store.release(name)
            logger.warning("A server is gone; %d of its inspections are queued again.", len(queued))
            for inspection_id in queued:
                self._released(inspection_id)
        if dead:
            self._take_over()
