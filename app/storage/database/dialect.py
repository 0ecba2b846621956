"""What `Database` needs of a kind of database; `sqlite` and `postgres` provide it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol

from sqlalchemy import Connection, Engine

from app.storage.database.active import ActiveSession


class Dialect(Protocol):
    """One database, and everything in which its kind differs from the other."""

    kind: str
    """SQLite or PostgreSQL."""
    active: ActiveSession | None
    """The session of the active server; None before `lead`, and for SQLite."""
    where: str
    """The database as it is named to people, without a password."""
    missing: str
    """A sentence that says that there is no database here."""

    def lead(self, on_wait: Callable[[], None] | None, *, ends_process: bool = False) -> None:
        """Become the only server that writes.

        Args:
            on_wait: Called once if another server is active; then this one waits as a standby.
            ends_process: Whether the process ends when another server may be active.
        Raises:
            OtherServerActive: Another server is active, and there is no `on_wait`.
            UnusableDatabase: The database cannot be reached.
        """

    def stop(self) -> None:
        """Let another server become the active one."""

    def reader(self) -> Engine:
        """Make an engine whose sessions see one consistent state and cannot write."""

    def writer(self) -> Engine:
        """Return the engine of the only session that writes; call `lead` before, or be refused.

        A commit is on the disk when it returns.
        """

    def version(self) -> str:
        """Return the version of the software.

        Raises:
            UnusableDatabase: The database cannot be reached.
        """

    def remark(self) -> str:
        """Return what an operator should know of this version; empty if there is nothing."""

    def revision(self) -> str | None:
        """Check the database and return the revision of its tables; None if it has none.

        Raises:
            UnusableDatabase: It is damaged, cannot be reached, or a newer version of Chainage made
            it.
            DiskFull: There is no room even for reading.
        """

    def migrating(self) -> AbstractContextManager[Connection]:
        """Begin the one transaction of a migration, alone; commit it when the block ends.

        Raises:
            UnusableDatabase: It is open for reading only.
        """

    def copy_before(self, revision: str) -> Path:
        """Return the file to which the database is copied before it is migrated to `revision`."""

    def copy_to(self, target: Path) -> None:
        """Copy the state of one moment, with every earlier commit, into a new SQLite file.

        Raises:
            DiskFull: There is no room for the copy.
        """

    def require_empty(self) -> None:
        """Raise UnusableBackup if there are tables already."""

    def take_over(self, copy: Path) -> None:
        """Become what `copy_to` copied, durably; `copy` is gone afterwards.

        Raises:
            UnusableBackup: The copy holds what this kind of database does not accept.
        """

    def to_read(self, folder: Path) -> Dialect:
        """Return the present state for reading; writes to it do not change this database.

        Args:
            folder: An empty folder that exists as long as the state is read.
        """

    def translated(self, error: BaseException) -> BaseException:
        """Return DiskFull, Busy or InvalidRequest for an error of the driver that means this, else
        the error itself.
        """
