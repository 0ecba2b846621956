"""SQLite: one file, many readers and exactly one writer.

SQLite 3.7.0 to 3.51.2 can corrupt a WAL database when two connections write or checkpoint at once
(repaired in 3.51.3; Debian 12 has 3.40.1).  So `Database` writes through one connection in one
thread, and every other connection is `query_only`.  With synchronous=FULL a commit is on the disk
when it returns: what was acknowledged survives a power cut (4 ms a commit; NORMAL may lose the last
ones).  A full disk refuses the transaction and leaves the file whole; the next one may succeed.

Even a reader needs room, for the index of the log that all processes share.  A database that is
opened on a full disk keeps that index in memory, and is this process's alone until it is closed.
"""

from __future__ import annotations

import os
import sqlite3
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from sqlalchemy import Connection, Engine, create_engine, event

from app.errors import NO_ROOM, Busy, DiskFull, UnusableBackup, UnusableDatabase
from app.storage.database import revisions
from app.storage.database.active import ActiveSession
from app.storage.folder.files import sync_folder

_PROBE_BYTES = 2**16
_GOOD_VERSION = (3, 51, 3)
_PRAGMAS = (
    "PRAGMA journal_mode=WAL",
    "PRAGMA synchronous=FULL",
    "PRAGMA foreign_keys=ON",
    "PRAGMA busy_timeout=5000",
)


_ALONE = "vfs=unix-excl"
"""What keeps the index of the log in memory, https://sqlite.org/vfs.html."""


class Sqlite:
    """The database in a file; see `Dialect`."""

    kind = "SQLite"
    active: ActiveSession | None = None

    def __init__(self, path: Path) -> None:
        self._path = path
        self._is_alone = False
        """Whether other processes are kept out, as there was no room for what they would share."""
        self.where = str(path)
        self.missing = f"There is no database in the folder {path.parent}; name it with --data."

    def reader(self) -> Engine:
        """Make an engine whose sessions see one consistent state and cannot write."""
        pragmas = (*_PRAGMAS, "PRAGMA query_only=ON")
        return _engine(self._path, *pragmas, pool_size=8, is_alone=self._is_alone)

    def writer(self) -> Engine:
        """Make the engine with the only connection that writes."""
        return _engine(self._path, *_PRAGMAS, pool_size=1, is_alone=self._is_alone)

    def lead(self, on_wait: Callable[[], None] | None, *, ends_process: bool = False) -> None:
        """Do nothing: the lock of the data folder keeps other servers out."""

    def stop(self) -> None:
        """Do nothing."""

    def version(self) -> str:
        """Return the version of the library."""
        return sqlite3.sqlite_version

    def remark(self) -> str:
        """Return what an operator should know of this version."""
        if sqlite3.sqlite_version_info >= _GOOD_VERSION:
            return ""
        return "Before 3.51.3 two writers could corrupt a database, so the server has only one."

    def revision(self) -> str | None:
        """Check the file and return the revision of its tables; None without a file."""
        try:
            return revision_of(self._path)
        except DiskFull:
            self._is_alone = True
            return revision_of(self._path, is_alone=True)

    @contextmanager
    def migrating(self) -> Iterator[Connection]:
        """Begin the one transaction of a migration; commit it when the block ends."""
        self._path.touch(mode=0o600)  # SQLite would let others read it
        with _in_transaction(_engine(self._path, *_PRAGMAS, pool_size=1)) as connection:
            yield connection

    def copy_before(self, revision: str) -> Path:
        """Return the file to which the database is copied before a migration: beside it."""
        return self._path.with_name(f"{self._path.name}.before-{revision}")

    def copy_to(self, target: Path) -> None:
        """Copy the state of one moment, with every earlier commit, into a single file."""
        copy_database(self._path, target)

    def require_empty(self) -> None:
        """Raise UnusableBackup if there is a file already."""
        if self._path.exists():
            raise UnusableBackup(f"There is a database {self.where} already.")

    def take_over(self, copy: Path) -> None:
        """Become a copy, durably."""
        copy.replace(self._path)
        sync_folder(self._path.parent)

    def to_read(self, folder: Path) -> Sqlite:
        """Return a copy, so that one of an older version can be migrated and a writing server does
        not interfere.
        """
        copy = folder / self._path.name
        self.copy_to(copy)
        return Sqlite(copy)

    def translated(self, error: BaseException) -> BaseException:
        """Return DiskFull or Busy for an error of the driver that means this, else the error."""
        if _code_of(error) == sqlite3.SQLITE_BUSY:
            return Busy("It accepts no writes: another program is writing to it; try again later.")
        return DiskFull() if _is_of_full_disk(error, self._path) else error


@contextmanager
def new_file(path: Path) -> Iterator[Connection]:
    """Make a database of a single file in one transaction, which ends with the block.

    Raises:
        DiskFull: There is no room for it; then there is no file.
    """
    path.unlink(missing_ok=True)
    try:
        with _in_transaction(_engine(path, pool_size=1)) as connection:
            yield connection
    except BaseException as error:
        path.unlink(missing_ok=True)
        if _is_of_full_disk(error, path):
            raise DiskFull from error
        raise


@contextmanager
def opened_copy(path: Path) -> Iterator[Connection]:
    """Open a database of a single file, which nobody else uses, to read it."""
    engine = _engine(path, pool_size=1)
    try:
        with engine.connect() as connection:
            yield connection
    finally:
        engine.dispose()


def _engine(path: Path, *pragmas: str, pool_size: int, is_alone: bool = False) -> Engine:
    url = (
        f"sqlite:///{path.absolute().as_uri()}?{_ALONE}&uri=true"
        if is_alone
        else f"sqlite:///{path}"
    )
    engine = create_engine(url, pool_size=pool_size, max_overflow=40)

    @event.listens_for(engine, "connect")
    def configure(connection: sqlite3.Connection, _record: object) -> None:
        for pragma in pragmas:
            connection.execute(pragma)

    return engine


@contextmanager
def _in_transaction(engine: Engine) -> Iterator[Connection]:
    try:
        with engine.connect() as connection:
            # Before DDL the driver begins no transaction; without one, a server killed meanwhile
            # would leave half a migration behind.
            connection.exec_driver_sql("BEGIN IMMEDIATE")
            yield connection
            connection.commit()
    finally:
        engine.dispose()


def _code_of(error: BaseException) -> int | None:
    """Return what SQLite reports, without the details of the extended codes; None of others."""
    cause = getattr(error, "orig", error)  # SQLAlchemy's errors hold the driver's
    return cause.sqlite_errorcode & 0xFF if isinstance(cause, sqlite3.OperationalError) else None


def _is_of_full_disk(error: BaseException, path: Path) -> bool:
    """Return whether a transaction failed because the disk is full.

    SQLite reports ENOSPC as a full disk, but an exceeded quota or a failed sync as an I/O error;
    then a test write shows whether the disk is full.
    """
    code = _code_of(error)
    if code not in (sqlite3.SQLITE_IOERR, sqlite3.SQLITE_CANTOPEN):
        return code == sqlite3.SQLITE_FULL
    try:
        with tempfile.TemporaryFile(dir=path.parent, buffering=0) as probe:
            probe.write(bytes(_PROBE_BYTES))
            os.fsync(probe.fileno())
    except OSError as failure:
        return failure.errno in NO_ROOM
    return False


def revision_of(path: Path, *, is_alone: bool = False) -> str | None:
    """Return the revision of the tables in a file; None if it has none or does not exist.

    Args:
        path: The file.
        is_alone: Whether no other process may open it meanwhile, which takes no room.
    Raises:
        UnusableDatabase: The file is damaged, or a newer version of Chainage made it.
        Busy: Another program keeps it.
        DiskFull: There is no room for what processes that read it share.
    """
    if not path.exists():
        return None
    try:
        with closing(_opened_to_read(path, is_alone=is_alone)) as connection:
            _require_sound(connection)
            tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_schema")}
            found = (
                connection.execute("SELECT version_num FROM alembic_version").fetchone()
                if "alembic_version" in tables
                else None
            )
    except sqlite3.DatabaseError as error:
        if _code_of(error) == sqlite3.SQLITE_BUSY:
            raise Busy(
                f"The database {path} is kept by another program: by a server that was started on "
                "a full disk, until it is started again."
            ) from error
        if _is_of_full_disk(error, path):
            raise DiskFull from error
        raise UnusableDatabase(
            f"The database {path} cannot be read, it is damaged ({str(error).strip()}). Make a new "
            "data folder of a backup with `chainage restore BACKUP.zip --data NEW-FOLDER`."
        ) from error
    if found is None:
        if tables:
            raise UnusableDatabase(f"The file {path} is a database of another program.")
        return None
    revision = str(found[0])
    revisions.require_known(revision, str(path))
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


def _opened_to_read(path: Path, *, is_alone: bool = False) -> sqlite3.Connection:
    # Only a connection that cannot write never checkpoints beside a server whose writer may.
    how = _ALONE if is_alone else "mode=ro"
    return sqlite3.connect(f"{path.resolve().as_uri()}?{how}", uri=True, timeout=5.0)
