"""SQLite with many readers and exactly one writer.

SQLite 3.7.0 to 3.51.2 can corrupt a WAL database when two connections write or checkpoint at once
(repaired in 3.51.3; Debian 12 has 3.40.1).  So one thread holds the only connection that writes,
and every other connection is `query_only`.  With synchronous=FULL a commit is on the disk when it
returns: what was acknowledged survives a power cut (4 ms a commit; NORMAL may lose the last ones).
"""

from __future__ import annotations

import logging
import queue
import sqlite3
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import alembic.command
import alembic.config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Engine, create_engine, event
from sqlalchemy.orm import Session

from app.errors import Busy
from app.storage.tables import Heartbeat

logger = logging.getLogger(__name__)

Result = TypeVar("Result")

_WAITING_WRITES = 256
_WRITE_TIMEOUT_S = 30.0
_PRAGMAS = (
    "PRAGMA journal_mode=WAL",
    "PRAGMA synchronous=FULL",
    "PRAGMA foreign_keys=ON",
    "PRAGMA busy_timeout=5000",
)


class Database:
    """Opens and migrates the file, then serves `read` and `write` from any thread."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._writer_engine = _engine(path, pool_size=1)
        self._reader_engine = _engine(path, "PRAGMA query_only=ON", pool_size=8)
        self._jobs: queue.Queue[tuple[Callable[[Session], Any], Future[Any]] | None] = queue.Queue(
            _WAITING_WRITES
        )
        _migrate(self._writer_engine, path)
        self._writer = threading.Thread(target=self._write_all, name="database-writer", daemon=True)
        self._writer.start()

    def close(self) -> None:
        """Finish the waiting writes and close; the last connection to close checkpoints."""
        self._jobs.put(None, timeout=_WRITE_TIMEOUT_S)
        self._writer.join(_WRITE_TIMEOUT_S)
        self._reader_engine.dispose()
        self._writer_engine.dispose()

    @contextmanager
    def read(self) -> Iterator[Session]:
        """A session that sees one consistent state and cannot write."""
        with Session(self._reader_engine, expire_on_commit=False) as session:
            yield session

    def write(self, change: Callable[[Session], Result]) -> Result:
        """Run `change` in a transaction of the writer; returns when it is committed and synced.

        Raises:
            Busy: Too many writes are waiting, or the disk takes none.
        """
        future: Future[Result] = Future()
        try:
            self._jobs.put((change, future), timeout=_WRITE_TIMEOUT_S)
            return future.result(_WRITE_TIMEOUT_S)
        except (queue.Full, TimeoutError) as error:
            future.cancel()
            raise Busy("The database is not keeping up; try again in a moment.") from error

    def beat(self) -> None:
        """Write the heartbeat row: when this returns, the database takes writes."""
        self.write(lambda session: session.merge(Heartbeat(id=1, at=datetime.now(UTC))))

    def writer_is_alive(self) -> bool:
        """Whether the writing thread runs."""
        return self._writer.is_alive()

    def _write_all(self) -> None:
        while (job := self._jobs.get()) is not None:
            change, future = job
            if not future.set_running_or_notify_cancel():
                continue
            try:
                with Session(self._writer_engine, expire_on_commit=False) as session:
                    result = change(session)
                    session.commit()
            except BaseException as error:  # handed to the thread that waits for it
                future.set_exception(error)
            else:
                future.set_result(result)


def _engine(path: Path, *pragmas: str, pool_size: int) -> Engine:
    engine = create_engine(f"sqlite:///{path}", pool_size=pool_size, max_overflow=40)

    @event.listens_for(engine, "connect")
    def configure(connection: sqlite3.Connection, _record: object) -> None:
        for pragma in (*_PRAGMAS, *pragmas):
            connection.execute(pragma)

    return engine


def _migrate(engine: Engine, path: Path) -> None:
    """Bring the file to the newest revision, with a copy of the older one kept beside it."""
    config = alembic.config.Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations"))
    with engine.connect() as connection:
        current = MigrationContext.configure(connection).get_current_revision()
        connection.rollback()
        newest = ScriptDirectory.from_config(config).get_current_head()
        if current == newest:
            return
        if current is not None:
            _back_up(path, path.with_name(f"{path.name}.before-{newest}"))
        config.attributes["connection"] = connection
        alembic.command.upgrade(config, "head")
        connection.commit()
    logger.info("Database %s is at revision %s (was %s).", path, newest, current or "new")


def _back_up(source: Path, target: Path) -> None:
    with closing(sqlite3.connect(source)) as old, closing(sqlite3.connect(target)) as copy:
        old.backup(copy)
