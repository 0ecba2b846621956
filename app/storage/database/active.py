"""The one active server of a PostgreSQL database; any other one is a standby.

The session that writes holds an advisory lock as long as it lives, so nothing is ever written
without the lock.  PostgreSQL releases it when the server ends.  A server that is frozen or cut off
keeps its session: a standby that sees it silent ends the session and takes the lock.  Before that
time has passed, the silent server has ended itself, so that it deletes no file of the new one.
"""

from __future__ import annotations

import logging
import os
import signal
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from app.errors import Busy, OtherServerActive

if TYPE_CHECKING:
    import psycopg

logger = logging.getLogger(__name__)

BEAT_S = 1.0
"""How often a server without anything to write shows that it is active."""
ANSWER_S = 8
"""Longest time that a statement of the session may take."""
_LIVES_S = 12.0
"""Time without an answer of the database after which an active server ends."""
_AT_ONCE_S = 1e-6
_SILENCE_S = 15.0
"""Silence of the session after which a standby ends it."""
_LOOK_EVERY_S = 0.5
_PATIENCE_S = 3.0
"""Time that the session of a server which has just stopped may take to end."""
LOST_CODE = 75
"""Exit code of a server that is no longer active: EX_TEMPFAIL, to be started again."""
_KEY = int.from_bytes(b"chainage")
SHOW_IT = "SET application_name = 'chainage active'"
"""Shows that the server is active; during its start nothing does, so that it may take its time."""
_END_A_SILENT_ONE = """
SELECT pg_terminate_backend(pid) FROM pg_locks JOIN pg_stat_activity USING (pid)
WHERE locktype = 'advisory' AND granted AND datname = current_database()
  AND database = datid AND (classid::bigint << 32) | objid::bigint = %s
  AND application_name = 'chainage active' AND (state <> 'active' OR wait_event_type = 'Client')
  AND state_change < clock_timestamp() - make_interval(secs => %s)
"""


class ActiveSession:
    """The session that holds the lock; all writing transactions of the server run in it."""

    def __init__(self, connection: psycopg.Connection, *, ends_process: bool) -> None:
        self._connection = connection
        self._ends_process = ends_process

    def connection(self) -> psycopg.Connection:
        """Return the connection; there is never another one.

        Raises:
            Busy: It is lost.
        """
        if self.is_lost:
            raise Busy("This server lost its connection to the database; start it again.")
        return self._connection

    @property
    def is_lost(self) -> bool:
        """Whether another server may be the active one by now."""
        return self._connection.closed

    def answered(self, asked_s: float) -> None:
        """Note an answer of the database to what was asked then, by `time.monotonic`: for a while
        from then on the process may live.

        A standby counts from when the database has answered, which is later, however long the
        answer was on its way.
        """
        if self._ends_process and not self.is_lost:
            left_s = asked_s + _LIVES_S - time.monotonic()
            # By the kernel, whose signal ends the process also when its threads are held up, and
            # reaches a frozen process before these go on.  Zero would stop the timer.
            signal.setitimer(signal.ITIMER_REAL, max(left_s, _AT_ONCE_S))

    def stop(self) -> None:
        """Close the session, so that a standby takes over; the process may go on."""
        if self._ends_process:
            signal.setitimer(signal.ITIMER_REAL, 0)
        self._connection.close()

    def end_if_lost(self) -> None:
        """End the process at once, without another step of its threads, if the session is lost."""
        if self.is_lost and self._ends_process:
            logger.critical(
                "The connection to the database is lost, and another server may be the active one "
                "by now: this one ends. Start it again; it waits as a standby."
            )
            logging.shutdown()
            os._exit(LOST_CODE)


def become_active(
    connection: psycopg.Connection, on_wait: Callable[[], None] | None, *, ends_process: bool
) -> ActiveSession:
    """Take the lock in this session, which commits every statement.

    Args:
        connection: The session.
        on_wait: Called once if another server is active; then this one waits as a standby.
        ends_process: Whether the process ends when the session is lost.
    Raises:
        OtherServerActive: Another server is active, and there is no `on_wait`.
    """
    patience_until_s, has_waited = time.monotonic() + _PATIENCE_S, False
    while not _asked(connection, "SELECT pg_try_advisory_lock(%s)", _KEY):
        if on_wait is not None and not has_waited:
            has_waited = True
            on_wait()
        if on_wait is None and time.monotonic() > patience_until_s:
            raise OtherServerActive(
                "Another server is the active one of this database, and no command finds its "
                "address in this data folder. Use the folder that it uses, or stop it."
            )
        if _asked(connection, _END_A_SILENT_ONE, _KEY, _SILENCE_S):
            logger.warning("The active server was silent for %d s; it is replaced.", _SILENCE_S)
        time.sleep(_LOOK_EVERY_S)
    return ActiveSession(connection, ends_process=ends_process)


def _asked(connection: psycopg.Connection, statement: str, *values: float) -> bool:
    found = connection.execute(statement.encode(), values).fetchone()
    return found is not None and bool(found[0])
