"""SQLite with many readers and exactly one writer.

SQLite 3.7.0 to 3.51.2 can corrupt a WAL database when two connections write or checkpoint at once
(repaired in 3.51.3; Debian 12 has 3.40.1).  So one thread holds the only connection that writes,
and every other connection is `query_only`.  With synchronous=FULL a commit is on the disk when it
returns: what was acknowledged survives a power cut (4 ms a commit; NORMAL may lose the last ones).
A full disk refuses the transaction and leaves the file whole; the next one may succeed.
"""

from __future__ import annotations

import logging
import os
import queue
import sqlite3
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import alembic.command
import alembic.config
from alembic.script import ScriptDirectory
from sqlalchemy import Engine, create_engine, event
from sqlalchemy.orm import Session

from app.errors import NO_ROOM, Busy, DiskFull, UnusableDatabase
from app.storage.tables import Heartbeat

logger = logging.getLogger(__name__)

Result = TypeVar("Result")

_WAITING_WRITES = 256
_WRITE_TIMEOUT_S = 30.0
_PROBE_BYTES = 2**16
_PRAGMAS = (
    "PRAGMA journal_mode=WAL",
    "PRAGMA synchronous=FULL",
    "PRAGMA foreign_keys=ON",
    "PRAGMA busy_timeout=5000",
)


class Database:
    """Opens and migrates the file, then serves `read` and `write` from any thread."""

    def __init__(self, path: Path, *, on_write: Callable[[float], None] | None = None) -> None:
        """Open `path`, or create it.

        Args:
            path: The database file.
            on_write: Called in the writer's thread with the duration of each transaction in
            seconds.
        Raises:
            UnusableDatabase: The file is damaged or of a newer version.
        """
        self.path = path
        self._on_write = on_write
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
        """Open a session that sees one consistent state and cannot write."""
        with Session(self._reader_engine, expire_on_commit=False) as session:
            yield session

    def write(self, change: Callable[[Session], Result]) -> Result:
        """Run `change` in a transaction of the writer; return when it is committed and synced.

        Raises:
            Busy: Too many writes are waiting, or the disk accepts none.
            DiskFull: Nothing was written.
        """
        future: Future[Result] = Future()
        try:
            self._jobs.put((change, future), timeout=_WRITE_TIMEOUT_S)
            return future.result(_WRITE_TIMEOUT_S)
        except (queue.Full, TimeoutError) as error:
            future.cancel()
            raise Busy("The database is not keeping up; try again in a moment.") from error

    def beat(self) -> None:
        """Write the heartbeat row; when this returns, the database accepts writes."""
        self.write(lambda session: session.merge(Heartbeat(id=1, at=datetime.now(UTC))))

    def writer_is_alive(self) -> bool:
        """Whether the writing thread runs."""
        return self._writer.is_alive()

    def _write_all(self) -> None:
        while (job := self._jobs.get()) is not None:
            change, future = job
            if not future.set_running_or_notify_cancel():
                continue
            began_s = time.perf_counter()
            try:
                with Session(self._writer_engine, expire_on_commit=False) as session:
                    result = change(session)
                    session.commit()
            except BaseException as error:  # handed to the thread that waits for it
                future.set_exception(DiskFull() if _is_of_full_disk(error, self.path) else error)
            else:
                future.set_result(result)
            if self._on_write is not None:
                self._on_write(time.perf_counter() - began_s)


def _engine(path: Path, *pragmas: str, pool_size: int) -> Engine:
    engine = create_engine(f"sqlite:///{path}", pool_size=pool_size, max_overflow=40)

    @event.listens_for(engine, "connect")
    def configure(connection: sqlite3.Connection, _record: object) -> None:
        for pragma in (*_PRAGMAS, *pragmas):
            connection.execute(pragma)

    return engine


def _is_of_full_disk(error: BaseException, path: Path) -> bool:
    """Return whether a transaction failed because the disk is full.

    SQLite reports ENOSPC as a full disk, but an exceeded quota or a failed sync as an I/O error;
    then a test write shows whether the disk is full.
    """
    cause = getattr(error, "orig", error)  # SQLAlchemy's errors hold the driver's
    if not isinstance(cause, sqlite3.OperationalError):
        return False
    code = cause.sqlite_errorcode & 0xFF  # without the details of the extended codes
    if code not in (sqlite3.SQLITE_IOERR, sqlite3.SQLITE_CANTOPEN):
        return code == sqlite3.SQLITE_FULL
    try:
        with tempfile.TemporaryFile(dir=path.parent, buffering=0) as probe:
            probe.write(bytes(_PROBE_BYTES))
            os.fsync(probe.fileno())
    except OSError as failure:
        return failure.errno in NO_ROOM
    return False


def _migrate(engine: Engine, path: Path) -> None:
    """Migrate the file to the newest revision, after copying the older one beside it."""
    current = revision_of(path)
    config = _alembic()
    newest = ScriptDirectory.from_config(config).get_current_head()
    if current == newest:
        return
    if current is not None:
        copy_database(path, path.with_name(f"{path.name}.before-{newest}"))
    with engine.connect() as connection:
        # Before DDL the driver begins no transaction; without one, a server killed meanwhile would
        # leave half a migration behind.
        connection.exec_driver_sql("BEGIN IMMEDIATE")
        config.attributes["connection"] = connection
        alembic.command.upgrade(config, "head")
        connection.commit()
    logger.info("Database %s is at revision %s (was %s).", path, newest, current or "new")


def _alembic() -> alembic.config.Config:
    config = alembic.config.Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations"))
    return config


def revision_of(path: Path) -> str | None:
    """Return the revision of the tables in a file; None if it has none or does not exist.

    Raises:
        UnusableDatabase: The file is damaged, or a newer version of Chainage made it.
        DiskFull: There is no room even for reading.
    """
    if not path.exists():
        return None
    try:
        with closing(_opened_to_read(path)) as connection:
            _require_sound(connection)
            tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_schema")}
            found = (
                connection.execute("SELECT version_num FROM alembic_version").fetchone()
                if "alembic_version" in tables
                else None
            )
    except sqlite3.DatabaseError as error:
        if _is_of_full_disk(error, path):  # even a reader needs room, for the index of the log
            raise DiskFull from error
        raise UnusableDatabase(
            f"The database {path} cannot be read, it is damaged ({str(error).strip()}). Make a new "
            "data folder of a backup with `chainage restore BACKUP.zip --data NEW-FOLDER`."
        ) from error
    if found is None:
        return None
    revision = str(found[0])
    known = {script.revision for script in ScriptDirectory.from_config(_alembic()).walk_revisions()}
    if revision not in known:
        raise UnusableDatabase(
            f"The database {path} was made by a newer version of Chainage (its revision is "
            f"{revision}). Install that version, or restore a backup of this one."
        )
    return revision


def _require_sound(connection: sqlite3.Connection) -> None:
    """Check for damaged pages, which would otherwise appear only in the middle of the work."""
    (found,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if found != "ok":
        raise sqlite3.DatabaseError(found)


def copy_database(source: Path, target: Path) -> None:
    """Copy a database, also one that a server is writing to, into a single file.

    The copy is the state of one moment and holds every earlier commit.

    Raises:
        DiskFull: There is no room for the copy.
    """
    target.unlink(missing_ok=True)
    try:
        with closing(_opened_to_read(source)) as old, closing(sqlite3.connect(target)) as copy:
            old.backup(copy)
            copy.execute("PRAGMA journal_mode=DELETE")
    except sqlite3.OperationalError as error:
        if _is_of_full_disk(error, target):
            raise DiskFull from error
        raise


def _opened_to_read(path: Path) -> sqlite3.Connection:
    # Only a connection opened this way never checkpoints beside a server whose writer may.
    return sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True, timeout=5.0)
