"""Revisions of the tables, and the migrations that lead from one to the next.

Alembic is loaded only to migrate: tables of the newest revision need none of it.
"""

from __future__ import annotations

from pathlib import Path

from sqlalchemy import Connection

from app.errors import UnusableDatabase

SCRIPTS = Path(__file__).parent / "migrations"


def newest() -> str:
    """Return the revision of the tables in this version of Chainage."""
    return max(_known())


def of(connection: Connection) -> str | None:
    """Return the revision of the tables of a database; None if it has none."""
    from alembic.migration import MigrationContext

    return MigrationContext.configure(connection).get_current_revision()


def require_known(revision: str, database: str) -> None:
    """Raise UnusableDatabase if a version that this one does not know made the tables."""
    if revision not in _known():
        raise UnusableDatabase(
            f"The database {database} was made by a newer version of Chainage, or by one before "
            f"its first release (its revision is {revision}). Install that version, or restore a "
            "backup of this one."
        )


def upgrade(connection: Connection, revision: str = "head") -> None:
    """Migrate the tables within the transaction that `connection` has begun."""
    import alembic.command
    import alembic.config

    config = alembic.config.Config()
    config.set_main_option("script_location", str(SCRIPTS))
    config.attributes["connection"] = connection
    alembic.command.upgrade(config, revision)


def _known() -> set[str]:
    """Return the revisions that this version knows: the files of the migrations begin with them."""
    return {path.name.partition("_")[0] for path in (SCRIPTS / "versions").glob("[0-9]*.py")}
