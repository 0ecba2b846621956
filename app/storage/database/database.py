"""The database: sessions that read, and one thread through which everything is written.

One thread holds the only connection of this server that writes, so that a change may rely on what
it has read.  `sqlite` and `postgres` have what differs between the kinds of databases.
"""

from __future__ import annotations

import logging
import queue
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from sqlalchemy import event
from sqlalchemy.orm import Session

from app.errors import Busy, UnusableDatabase
from app.storage.database import limits, revisions
from app.storage.database.active import BEAT_S, SHOW_IT
from app.storage.database.dialect import Dialect
from app.storage.database.postgres import Postgres
from app.storage.database.sqlite import Sqlite
from app.storage.database.tables import Heartbeat
from app.storage.folder.files import Places
from app.watched import Watched

logger = logging.getLogger(__name__)

Result = TypeVar("Result")

FILE = "chainage.db"
"""Name of an SQLite database in its data folder."""
_WAITING_WRITES = 256
_WRITE_TIMEOUT_S = 30.0
_IDS_OF_QUERY = 1_000

_Job = tuple[Callable[[Session], Any], dict[str, Any], Future[Any]]
"""A change, the `info` of its session, and what becomes of it."""


def stored_at(url: str | None, data: Path) -> Dialect:
    """Return the database of a data folder: at a URL, or a file in the folder itself.

    Raises:
        InvalidSettings: The URL cannot be used, or its driver is not installed.
    """
    return Sqlite(data / FILE) if url is None else Postgres(url, data)


def require_its_database(dialect: Dialect, places: Places) -> None:
    """Raise UnusableDatabase if a database is new, while there are inspections in the data folder:
    theirs is lost.
    """
    if dialect.revision() is None and any(path.is_dir() for path in places.inspections.iterdir()):
        raise UnusableDatabase(
            f"The database {dialect.where} is missing or empty, but {places.inspections} holds "
            "inspections. Put their database back, or make a new data folder of a backup with "
            "`chainage restore BACKUP.zip --data NEW-FOLDER`. To begin anew, name an empty folder "
            "with --data."
        )


def batches(ids: Iterable[str]) -> Iterator[list[str]]:
    """Yield ids, as many at a time as one query takes: its parameters are limited."""
    every = list(ids)
    for start in range(0, len(every), _IDS_OF_QUERY):
        yield every[start : start + _IDS_OF_QUERY]


@contextmanager
def _translating(dialect: Dialect) -> Iterator[None]:
    """Raise what an error of the driver means in the block."""
    try:
        yield
    except Exception as error:
        meant = dialect.translated(error)
        if meant is error:
            raise
        raise meant from error


class Database:
    """Opens and migrates the database, then serves `read` and `write` from any thread."""

    def __init__(
        self, where: Path | Dialect, *, on_write: Callable[[float], None] | None = None
    ) -> None:
        """Open the database, or make its tables.

        Args:
            where: The database; a path is the file of an SQLite database.
            on_write: Called in the writer's thread with the duration of each transaction in
            seconds.
        Raises:
            UnusableDatabase: It is damaged, cannot be reached, or is of a newer version.
        """
        self.dialect: Dialect = Sqlite(where) if isinstance(where, Path) else where
        self._on_write = on_write
        self._jobs: queue.Queue[_Job | None] = queue.Queue(_WAITING_WRITES)
        migrate(self.dialect)
        self._writer_engine = self.dialect.writer()
        self._reader_engine = self.dialect.reader()
        self.writer = Watched("database-writer", self._write_all, stop_timeout_s=_WRITE_TIMEOUT_S)
        self.writer.start()

    def close(self) -> None:
        """Finish the waiting writes and close; the last connection to close checkpoints."""
        self._jobs.put(None, timeout=_WRITE_TIMEOUT_S)
        self.writer.stop()
        self._reader_engine.dispose()
        self._writer_engine.dispose()
        self.dialect.stop()

    @contextmanager
    def read(self) -> Iterator[Session]:
        """Open a session that sees one consistent state and cannot write.

        Raises:
            Busy: The database cannot be reached.
        """
        with (
            _translating(self.dialect),
            Session(self._reader_engine, expire_on_commit=False, info=limits.info()) as session,
        ):
            yield session

    def write(self, change: Callable[[Session], Result]) -> Result:
        """Run `change` in a transaction of the writer; return when it is committed and synced.

        Raises:
            Busy: Too many writes are waiting, or the database accepts none. After a lost connection
            or a time-out it may have been committed nevertheless.
            DiskFull: Nothing was written.
        """
        future: Future[Result] = Future()
        try:
            self._jobs.put((change, limits.info(), future), timeout=_WRITE_TIMEOUT_S)
            return future.result(_WRITE_TIMEOUT_S)
        except (queue.Full, TimeoutError) as error:
            future.cancel()
            raise Busy("The database is not keeping up; try again in a moment.") from error

    def beat(self) -> None:
        """Write the heartbeat row; when this returns, the database accepts writes."""
        self.write(lambda session: session.merge(Heartbeat(id=1, at=datetime.now(UTC))))

    def _write_all(self) -> None:
        active = self.dialect.active
        if active is not None:
            asked_s = 0.0

            def ask(*_: object) -> None:
                nonlocal asked_s
                asked_s = time.monotonic()

            event.listen(self._writer_engine, "before_cursor_execute", ask)
            event.listen(
                self._writer_engine, "after_cursor_execute", lambda *_: active.answered(asked_s)
            )
            self._show_that_it_is_active()
        while self._write_next():
            pass

    def _write_next(self) -> bool:
        """Wait for a change and make it; return False at the end.

        A function of its own, so that what a change has held is free before the next one comes.
        """
        try:
            job = self._jobs.get(timeout=None if self.dialect.active is None else BEAT_S)
        except queue.Empty:
            self._show_that_it_is_active()
            return True
        if job is None:
            return False
        change, info, future = job
        if not future.set_running_or_notify_cancel():
            return True
        began_s = time.perf_counter()
        try:
            with Session(self._writer_engine, expire_on_commit=False, info=info) as session:
                result = change(session)
                session.commit()
        except BaseException as error:  # handed to the thread that waits for it
            if self.dialect.active is not None:
                self.dialect.active.end_if_lost()
            future.set_exception(self.dialect.translated(error))
        else:
            future.set_result(result)
        if self._on_write is not None:
            self._on_write(time.perf_counter() - began_s)
        return True

    def _show_that_it_is_active(self) -> None:
        active = self.dialect.active
        if active is None or active.is_lost:
            return
        try:
            with self._writer_engine.connect() as connection:
                connection.exec_driver_sql(SHOW_IT)
                connection.commit()
        except Exception as error:
            logger.warning("The database does not answer: %s", self.dialect.translated(error))
            active.end_if_lost()


def migrate(dialect: Dialect) -> None:
    """Migrate the tables to the newest revision, after copying those of an older one.

    Raises:
        UnusableDatabase: It is damaged, cannot be reached, or is of a newer version.
        DiskFull: There is no room for new tables; those of the newest revision need none.
    """
    newest = revisions.newest()
    if dialect.revision() == newest:
        return
    with _translating(dialect), dialect.migrating() as connection:
        current = revisions.of(connection)
        if current is not None:
            dialect.copy_to(dialect.copy_before(newest))
        revisions.upgrade(connection)
    logger.info("Database %s is at revision %s (was %s).", dialect.where, newest, current or "new")
