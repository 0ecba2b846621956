"""Revisions of the tables, and the migrations that lead from one to the next."""

from __future__ import annotations

from pathlib import Path

import alembic.command
import alembic.config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection

from app.errors import UnusableDatabase

SCRIPTS = Path(__file__).parent / "migrations"


def newest() -> str:
    """Return the revision of the tables in this version of Chainage."""
    head = ScriptDirectory.from_config(_config()).get_current_head()
    assert head is not None  # noqa: S101  (there are migrations)
    return head


def of(connection: Connection) -> str | None:
    """Return the revision of the tables of a database; None if it has none."""
    return MigrationContext.configure(connection).get_current_revision()


def require_known(revision: str, database: str) -> None:
    """Raise UnusableDatabase if a newer version of Chainage made the tables of `database`."""
    scripts = ScriptDirectory.from_config(_config())
    if revision not in {script.revision for script in scripts.walk_revisions()}:
        raise UnusableDatabase(
            f"The database {database} was made by a newer version of Chainage (its revision is "
            f"{revision}). Install that version, or restore a backup of this one."
        )


def upgrade(connection: Connection, revision: str = "head") -> None:
    """Migrate the tables within the transaction that `connection` has begun."""
    config = _config()
    config.attributes["connection"] = connection
    alembic.command.upgrade(config, revision)


def _config() -> alembic.config.Config:
    config = alembic.config.Config()
    config.set_main_option("script_location", str(SCRIPTS))
    return config
