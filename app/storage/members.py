"""The servers of one database: messages between them, who is alive, and which one leads.

A server alone leads at once.  On PostgreSQL each server keeps one connection.  With it, it listens
to the others (LISTEN), holds an advisory lock that shows that it lives, and one of them holds the
lock of the leader; when a server dies, PostgreSQL releases its locks.  A notification holds 8000
bytes at most, so that longer messages lie in a table for a minute, which is not part of a backup.
"""

from __future__ import annotations

import base64
import logging
import queue
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Protocol
from uuid import uuid4

from app.storage.database.dialect import Dialect
from app.storage.database.postgres import WRITING, Postgres
from app.watched import Watched

if TYPE_CHECKING:
    import psycopg

logger = logging.getLogger(__name__)

_CHANNEL = "chainage"
_LEADER = int.from_bytes(b"leader")
"""Key of the leader's advisory lock."""
_LONGEST_NOTE = 7_500
"""Characters of a notification."""
_KEPT_S = 60
"""How long a message lies in the table."""
_TIDY_EVERY_S = 10.0
_LOOK_EVERY_S = 0.5
_RETRY_S = 0.5
_PRECEDENCE_S = 3.0
"""After the database was gone, the leader before has precedence for this time."""
_WAITING_MESSAGES = 5_000
_STOP_TIMEOUT_S = 5.0


@dataclass(frozen=True)
class Hooks:
    """What a server is told, in one thread of its own."""

    receive: Callable[[bytes], None]
    """A message of another server."""
    reset: Callable[[], None]
    """Messages may have been missed: on joining, and after a connection was lost."""
    lead: Callable[[], None]
    """This server leads from now on; called again if it fails."""


class Members(Protocol):
    """The servers of a database, of which this one is one."""

    name: str
    """Name of this server, which no other one has."""
    are_several: bool
    """Whether others may use the same database."""

    @property
    def threads(self) -> Sequence[Watched]:
        """Return the threads that speak with the others."""

    def start(self, hooks: Hooks) -> None:
        """Join the others."""

    def stop(self) -> None:
        """Leave the others."""

    def send(self, message: bytes) -> None:
        """Send a message to the others, in the order of the calls; return at once."""

    def is_leading(self) -> bool:
        """Whether this server leads."""

    def is_alive(self, name: str) -> bool:
        """Whether the server of this name has joined."""


class Alone:
    """The only server of its database."""

    are_several = False
    threads: tuple[Watched, ...] = ()

    def __init__(self) -> None:
        self.name = uuid4().hex

    def start(self, hooks: Hooks) -> None:
        """Lead."""
        hooks.lead()

    def stop(self) -> None:
        """Do nothing."""

    def send(self, message: bytes) -> None:
        """Do nothing: nobody listens."""

    def is_leading(self) -> bool:
        """Return True."""
        return True

    def is_alive(self, name: str) -> bool:
        """Return whether it is this server: another one has ended."""
        return name == self.name


class Joined:
    """One of several servers of a PostgreSQL database."""

    are_several = True

    def __init__(self, database: Postgres) -> None:
        self.name = uuid4().hex
        self._database = database
        self._stopping = threading.Event()
        self._is_leading = False
        self._alive: frozenset[int] = frozenset()
        self._waiting: queue.Queue[bytes | None] = queue.Queue(_WAITING_MESSAGES)
        self._has_lost = False
        """Whether a message could not be sent."""
        self.threads: tuple[Watched, ...] = ()

    def start(self, hooks: Hooks) -> None:
        """Join the others; wait until their messages arrive and it is known whether this leads."""
        joined = threading.Event()
        listen = partial(self._listen, hooks, joined)
        self.threads = (
            Watched("members", listen, stop_timeout_s=_STOP_TIMEOUT_S),
            Watched("members-send", self._send_all, stop_timeout_s=_STOP_TIMEOUT_S),
        )
        for thread in self.threads:
            thread.start()
        joined.wait(_STOP_TIMEOUT_S)

    def stop(self) -> None:
        """Leave the others; what waits is still sent."""
        self._stopping.set()
        with suppress(queue.Full):
            self._waiting.put_nowait(None)
        for thread in reversed(self.threads):
            thread.stop()

    def send(self, message: bytes) -> None:
        """Send a message to the others; return at once."""
        try:
            self._waiting.put_nowait(message)
        except queue.Full:
            self._has_lost = True

    def is_leading(self) -> bool:
        """Whether this server leads."""
        return self._is_leading

    def is_alive(self, name: str) -> bool:
        """Whether the server of this name has joined, as of half a second ago."""
        return name == self.name or _key(name) in self._alive

    def _listen(self, hooks: Hooks, joined: threading.Event) -> None:
        import psycopg

        has_led, is_first = False, True
        while not self._stopping.is_set():
            try:
                with self._database.session() as connection:
                    self._join(connection)
                    may_lead_s = time.monotonic()
                    if not is_first and not has_led:
                        may_lead_s += _PRECEDENCE_S
                    is_first = False
                    hooks.reset()
                    while not self._stopping.is_set():
                        if not self._is_leading and time.monotonic() >= may_lead_s:
                            self._is_leading = has_led = self._try_to_lead(connection, hooks)
                        self._alive = _alive(connection)
                        joined.set()
                        notes = list(connection.notifies(timeout=_LOOK_EVERY_S, stop_after=1))
                        for note in notes:
                            self._receive(connection, note.payload, hooks)
            except psycopg.Error as error:
                logger.warning("The other servers cannot be heard: %s", _said(error))
            finally:
                self._is_leading = False
            self._stopping.wait(_RETRY_S)

    def _join(self, connection: psycopg.Connection) -> None:
        with connection.transaction():
            connection.execute("SELECT pg_advisory_xact_lock(%s)", (WRITING,))
            connection.execute(
                "CREATE UNLOGGED TABLE IF NOT EXISTS live_messages (id bigserial PRIMARY KEY, "
                "content bytea NOT NULL, sent_at timestamptz NOT NULL DEFAULT now())"
            )
        # Shared, because the lock of a connection that was lost may still be held.
        connection.execute("SELECT pg_advisory_lock_shared(%s)", (_key(self.name),))
        connection.execute(f"LISTEN {_CHANNEL}")

    def _try_to_lead(self, connection: psycopg.Connection, hooks: Hooks) -> bool:
        found = connection.execute("SELECT pg_try_advisory_lock(%s)", (_LEADER,)).fetchone()
        if found is None or not found[0]:
            return False
        try:
            hooks.lead()
        except Exception:
            logger.exception("This server could not take over; it tries again.")
            connection.execute("SELECT pg_advisory_unlock(%s)", (_LEADER,))
            return False
        logger.info("This server leads those of its database.")
        return True

    def _receive(self, connection: psycopg.Connection, note: str, hooks: Hooks) -> None:
        sender, kind, rest = note[:32], note[32:33], note[33:]
        if sender == self.name:
            return
        content: bytes | None = base64.b64decode(rest) if kind == ":" else None
        if kind == "#":
            found = connection.execute(
                "SELECT content FROM live_messages WHERE id = %s", (int(rest),)
            ).fetchone()
            content = None if found is None else bytes(found[0])
        try:
            if content is None:  # the sender, or this server, missed something
                hooks.reset()
            else:
                hooks.receive(content)
        except Exception:
            logger.exception("A message of another server could not be handled.")

    def _send_all(self) -> None:
        import psycopg

        while True:
            try:
                with self._database.session("-c synchronous_commit=off") as connection:
                    if self._send_while_connected(connection):
                        return
            except psycopg.Error as error:
                self._has_lost = True
                logger.warning("The other servers cannot be told: %s", _said(error))
                if self._stopping.wait(_RETRY_S):
                    return

    def _send_while_connected(self, connection: psycopg.Connection) -> bool:
        """Send what waits; return True when this server leaves."""
        tidied_s = -_TIDY_EVERY_S
        while (message := self._waiting.get()) is not None:
            if self._has_lost:
                self._has_lost = False
                _notify(connection, f"{self.name}!")
            text = base64.b64encode(message).decode()
            if len(text) <= _LONGEST_NOTE:
                _notify(connection, f"{self.name}:{text}")
                continue
            with connection.transaction():
                found = connection.execute(
                    "INSERT INTO live_messages (content) VALUES (%s) RETURNING id", (message,)
                ).fetchone()
                assert found is not None  # noqa: S101  (it returns the row it has made)
                _notify(connection, f"{self.name}#{found[0]}")
            if time.monotonic() > tidied_s + _TIDY_EVERY_S:
                tidied_s = time.monotonic()
                connection.execute(
                    "DELETE FROM live_messages WHERE sent_at < now() - make_interval(secs => %s)",
                    (_KEPT_S,),
                )
        return True


def members_of(database: Dialect) -> Members:
    """Return the servers of a database: several may share one of PostgreSQL."""
    return Joined(database) if isinstance(database, Postgres) else Alone()


def _notify(connection: psycopg.Connection, note: str) -> None:
    connection.execute("SELECT pg_notify(%s, %s)", (_CHANNEL, note))


def _alive(connection: psycopg.Connection) -> frozenset[int]:
    """Return the keys of all advisory locks of this database."""
    rows = connection.execute(
        "SELECT (classid::bigint << 32) | objid::bigint FROM pg_locks WHERE locktype = 'advisory' "
        "AND granted "
        "AND database = (SELECT oid FROM pg_database WHERE datname = current_database())"
    )
    return frozenset(row[0] for row in rows)


def _key(name: str) -> int:
    """Return the key of the lock that shows that a server lives: 60 bits of its name."""
    return int(name[:15], 16)


def _said(error: Exception) -> str:
    return str(error).strip().partition("\n")[0]
