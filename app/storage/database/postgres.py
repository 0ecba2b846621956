"""PostgreSQL, by URL, with one active server (`active`).

The stores rely on one writer at a time: all writing transactions run in the session that holds the
lock of the active server.  Readers see one state (REPEATABLE READ) and cannot write.  No statement
and no wait is unbounded: what takes too long, like a connection that is lost, becomes Busy.  A
reader then connects anew; with the session that writes the server has lost its place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import (
    URL,
    Connection,
    Engine,
    create_engine,
    exc,
    func,
    inspect,
    make_url,
    select,
    text,
)
from sqlalchemy.exc import ArgumentError, DataError, DBAPIError
from sqlalchemy.pool import NullPool

from app.errors import (
    Busy,
    DiskFull,
    InvalidRequest,
    InvalidSettings,
    UnusableBackup,
    UnusableDatabase,
)
from app.storage.database import revisions, sqlite
from app.storage.database.active import ANSWER_S, ActiveSession, become_active
from app.storage.database.copying import copy_rows, numbered_columns

SCHEME = "postgresql"
_READERS = 8
_MORE_READERS = 8
_READER_WAIT_S = 10.0
_CONNECT_S = 5
_SILENCE_MS = 15_000
"""Time after which a connection without an acknowledgement is lost."""
_BOUNDS = {
    "statement_timeout": "20s",
    "lock_timeout": "10s",
    "idle_in_transaction_session_timeout": "60s",
    # A server or a role may have another default, which could lose acknowledged commits.
    "synchronous_commit": "on",
}
_WRITING = _BOUNDS | {"statement_timeout": f"{ANSWER_S}s", "lock_timeout": f"{ANSWER_S}s"}
"""Of the session that writes."""
_UNBOUNDED = _BOUNDS | {"statement_timeout": "0", "lock_timeout": "10min"}
"""For a copy of everything."""
_FULL = "53100"
_NOT_NOW = ("08", "25006", "40", "53", "55P03", "57")
"""Beginnings of the SQLSTATEs that mean "try again": the connection, a read-only server, a
conflict, resources, a lock, an operator's intervention or a time-out."""
_NO_TEXT = ("22021", "22P05")
"""Characters that cannot be encoded; NUL is refused by the driver, without a SQLSTATE."""
_BUSY = "The database cannot be reached, or is not keeping up; try again in a moment."


class Postgres:
    """The database at a URL; see `Dialect`."""

    kind = "PostgreSQL"

    def __init__(self, url: str, copies: Path, *, is_read_only: bool = False) -> None:
        """Store where the database is; nothing is connected yet.

        Args:
            url: As libpq takes it, `postgresql://user:password@host:port/name?parameter=value`.
            copies: Folder for copies of the database before a migration.
            is_read_only: Whether every write fails.
        Raises:
            InvalidSettings: The URL cannot be used, or psycopg is not installed.
        """
        self.active: ActiveSession | None = None
        """The session that writes, once this server is the active one."""
        self._writer: Engine | None = None
        self._given = url
        self._url = _driver_url(url)
        self._copies = copies
        self._is_read_only = is_read_only
        host = self._url.host or self._url.query.get("host", "this machine")
        self.where = f"{self._url.database} on {host}"
        self.missing = (
            f"The database {self.where} has no tables of Chainage; `chainage serve` makes them."
        )

    def reader(self) -> Engine:
        """Make an engine whose sessions see one consistent state and cannot write."""
        return self._engine(
            _BOUNDS,
            pool_size=_READERS,
            max_overflow=_MORE_READERS,
            pool_timeout=_READER_WAIT_S,
            pool_pre_ping=True,
            isolation_level="REPEATABLE READ",
            execution_options={"postgresql_readonly": True},
        )

    def lead(self, on_wait: Callable[[], None] | None, *, ends_process: bool = False) -> None:
        """Become the active server; see `become_active`.

        Raises:
            OtherServerActive: Another server is active, and there is no `on_wait`.
            UnusableDatabase: The database cannot be reached.
        """
        import psycopg

        url = self._url.set(drivername="postgresql").render_as_string(hide_password=False)
        bounds = _connection(_WRITING) | {"tcp_user_timeout": ANSWER_S * 1000}
        try:
            session = psycopg.connect(url, autocommit=True, **bounds)
            self.active = become_active(session, on_wait, ends_process=ends_process)
            session.autocommit = False
        except psycopg.OperationalError as error:
            raise self._unreachable(error) from error

    def writer(self) -> Engine:
        """Return the engine of the session that writes; become the active server before."""
        if self._is_read_only:
            return self.reader()
        if self._writer is None:
            if self.active is None:
                self.lead(None)
            active = self.active
            assert active is not None  # noqa: S101  (since `lead`)
            self._writer = create_engine(
                self._url,
                creator=active.connection,
                pool_size=1,
                max_overflow=0,
                isolation_level="READ COMMITTED",
            )
        return self._writer

    def stop(self) -> None:
        """Let a standby become the active server."""
        if self.active is not None:
            self.active.stop()
        self.active = self._writer = None

    def version(self) -> str:
        """Return the version of the server."""
        with self._connected() as connection:
            return str(connection.scalar(text("SHOW server_version"))).partition(" ")[0]

    def remark(self) -> str:
        """Return nothing: every version that psycopg speaks to will do."""
        return ""

    def revision(self) -> str | None:
        """Check that the database can be used, and return the revision of its tables."""
        with self._connected() as connection:
            encoding = connection.scalar(text("SHOW server_encoding"))
            if encoding != "UTF8":
                raise UnusableDatabase(
                    f"The database {self.where} has the encoding {encoding}, which cannot hold "
                    "every name; make one with the encoding UTF8."
                )
            revision = revisions.of(connection)
        if revision is not None:
            revisions.require_known(revision, self.where)
        return revision

    @contextmanager
    def migrating(self) -> Iterator[Connection]:
        """Begin the one transaction of a migration."""
        if self._is_read_only:
            raise UnusableDatabase(
                f"The database {self.where} was made by an older version of Chainage; start the "
                "server once to migrate it."
            )
        with self.writer().connect() as connection:
            for bound in ("statement_timeout", "idle_in_transaction_session_timeout"):
                connection.exec_driver_sql(f"SET LOCAL {bound} = 0")
            yield connection
            connection.commit()

    def copy_before(self, revision: str) -> Path:
        """Return the file to which the database is copied before a migration."""
        return self._copies / f"chainage.db.before-{revision}"

    def copy_to(self, target: Path) -> None:
        """Copy the state of one moment into a new SQLite file of the same revision."""
        with self._snapshot() as source, sqlite.new_file(target) as copy:
            revision = revisions.of(source)
            if revision is not None:
                revisions.upgrade(copy, revision)
                copy_rows(source, copy)

    def require_empty(self) -> None:
        """Raise UnusableBackup if there are tables already."""
        with self._connected() as connection:
            if inspect(connection).get_table_names():
                raise UnusableBackup(
                    f"The database {self.where} has tables, and a server may be using it; make a "
                    "new one and name it in CHAINAGE_DATABASE."
                )

    def take_over(self, copy: Path) -> None:
        """Take all rows of an SQLite file into new tables of the same revision."""
        try:
            with sqlite.opened_copy(copy) as source, self.migrating() as target:
                revision = revisions.of(source)
                if revision is not None:
                    revisions.upgrade(target, revision)
                    copy_rows(source, target)
                    _continue_numbers(target)
        except DataError as error:
            raise UnusableBackup(
                f"PostgreSQL does not accept a value of the database: {_said(error.orig)}."
            ) from error
        finally:
            self.stop()
        copy.unlink()

    def to_read(self, folder: Path) -> Postgres:
        """Return the same database, every write to which fails."""
        return Postgres(self._given, folder, is_read_only=True)

    def translated(self, error: BaseException) -> BaseException:
        """Return the error that an error of the driver means: DiskFull, Busy, InvalidRequest."""
        if isinstance(error, exc.TimeoutError):  # every connection is in use
            return Busy(_BUSY)
        if not isinstance(error, DBAPIError):
            return error
        state = getattr(error.orig, "sqlstate", None)
        if state == _FULL:
            return DiskFull("The disk of the database is full. Free some space, then continue.")
        if _is_lost(error) or (state is not None and state.startswith(_NOT_NOW)):
            return Busy(_BUSY)
        if isinstance(error, DataError) and (state is None or state in _NO_TEXT):
            return InvalidRequest("It has a character that no stored text can have, such as NUL.")
        return error

    @contextmanager
    def _connected(self, settings: dict[str, str] = _BOUNDS) -> Iterator[Connection]:
        """Connect before the start or for a command; every fault of it is one sentence."""
        engine = self._engine(settings, poolclass=NullPool)
        try:
            with engine.connect() as connection:
                yield connection
        except DBAPIError as error:
            if not isinstance(self.translated(error), Busy):
                raise
            raise self._unreachable(error.orig) from error

    def _unreachable(self, error: BaseException | None) -> UnusableDatabase:
        return UnusableDatabase(
            f"The database {self.where} cannot be reached: {_said(error)}. Check that its "
            "server runs and that CHAINAGE_DATABASE is right."
        )

    @contextmanager
    def _snapshot(self) -> Iterator[Connection]:
        with self._connected(_UNBOUNDED) as connection:
            yield connection.execution_options(
                isolation_level="REPEATABLE READ", postgresql_readonly=True
            )

    def _engine(self, settings: dict[str, str], **options: object) -> Engine:
        return create_engine(self._url, connect_args=_connection(settings), **options)


def _connection(settings: dict[str, str]) -> dict[str, Any]:
    """Return the arguments of a connection with these settings of the server."""
    return {
        "connect_timeout": _CONNECT_S,
        "application_name": "chainage",
        "keepalives_idle": _SILENCE_MS // 1000,
        "tcp_user_timeout": _SILENCE_MS,
        "options": " ".join(f"-c {name}={value}" for name, value in settings.items()),
    }


def _driver_url(url: str) -> URL:
    try:
        import psycopg  # noqa: F401  (an extra; without it SQLite serves)

        parsed = make_url(url)
    except ImportError as error:
        raise InvalidSettings(
            "CHAINAGE_DATABASE needs the driver of PostgreSQL: pip install 'chainage[cluster]'."
        ) from error
    except (ArgumentError, ValueError) as error:
        raise InvalidSettings(
            "CHAINAGE_DATABASE is no address such as postgresql://user:password@host:5432/name."
        ) from error
    return parsed.set(drivername="postgresql+psycopg")


def _continue_numbers(connection: Connection) -> None:
    """Let the numbers that the database assigns continue after those of the copied rows."""
    for column in numbered_columns(connection):
        sequence = func.pg_get_serial_sequence(column.table.name, column.name)
        next_one = select(func.coalesce(func.max(column), 0) + 1).scalar_subquery()
        connection.execute(select(func.setval(sequence, next_one, False)))


def _is_lost(error: DBAPIError) -> bool:
    """Return whether there is no connection: an error without a SQLSTATE is of the client."""
    names = ("OperationalError", "InterfaceError")
    is_of_client = getattr(error.orig, "sqlstate", None) is None
    return error.connection_invalidated or (is_of_client and type(error).__name__ in names)


def _said(error: BaseException | None) -> str:
    """Return the driver's first line, which names no password."""
    return str(error).strip().partition("\n")[0].rstrip(".")
