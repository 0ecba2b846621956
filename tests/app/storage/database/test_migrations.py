"""A database of an earlier version is taken over whole; that of a newer one is left alone."""

from __future__ import annotations

import re
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from postgres import ON_BOTH
from sqlalchemy import inspect, text

from app.errors import UnusableDatabase
from app.storage.database import revisions
from app.storage.database.database import Database, require_its_database, stored_at
from app.storage.database.dialect import Dialect
from app.storage.database.sqlite import Sqlite, revision_of
from app.storage.folder.files import Places

Command = Callable[..., Any]

INSPECTION = 32 * "a"
THIS = revisions.newest()
NEW = f"{int(THIS) + 1:04}"
NEXT = """
from alembic import op
from sqlalchemy import Column, Integer

revision, down_revision = "{new}", "{this}"

def upgrade():
    op.add_column("heartbeat", Column("next", Integer))
    op.execute("{statement}")
"""


@pytest.fixture
def next_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Let this be the version after this one, whose migration ends with a statement."""

    def set_up(statement: str) -> None:
        scripts = tmp_path / "migrations"
        shutil.copytree(revisions.SCRIPTS, scripts)
        migration = NEXT.format(new=NEW, this=THIS, statement=statement)
        (scripts / "versions" / f"{NEW}_next.py").write_text(migration)
        monkeypatch.setattr(revisions, "SCRIPTS", scripts)

    return set_up


def of_this_version(stored: Dialect) -> Dialect:
    """Make the tables, with one row."""
    with closing(Database(stored)) as database:
        database.beat()
    return stored


@ON_BOTH
def test_an_older_database_is_migrated_whole_after_a_copy(
    tmp_path: Path, new_url: Callable[[], str | None], next_version: Callable[[str], None]
) -> None:
    stored = of_this_version(stored_at(new_url(), tmp_path))
    before = dump(stored, tmp_path)
    next_version("SELECT 1")
    with closing(Database(stored)) as database, database.read() as session:
        assert session.execute(text("SELECT id, next FROM heartbeat")).all() == [(1, None)]
    copy = tmp_path / f"chainage.db.before-{NEW}"
    assert (revision_of(copy), stored.revision()) == (THIS, NEW)
    assert dump(Sqlite(copy), tmp_path) == before


@ON_BOTH
def test_a_migration_that_fails_leaves_the_database_as_it_was(
    tmp_path: Path, new_url: Callable[[], str | None], next_version: Callable[[str], None]
) -> None:
    stored = of_this_version(stored_at(new_url(), tmp_path))
    before = tables_of(stored)
    next_version("CREATE TABLE code_packs (x INTEGER)")
    with pytest.raises(Exception, match=r"code_packs.* already exists"):
        Database(stored)
    assert stored.revision() == THIS
    assert tables_of(stored) == before


def tables_of(stored: Dialect) -> dict[str, list[str]]:
    """Every column of every table."""
    engine = stored.reader()
    columns = {
        table: [str(column["name"]) for column in inspect(engine).get_columns(table)]
        for table in inspect(engine).get_table_names()
    }
    engine.dispose()
    return columns


def dump(stored: Dialect, folder: Path) -> list[str]:
    """All tables and rows, in the form of SQLite."""
    copy = folder / "dumped.db"
    stored.copy_to(copy)
    with sqlite3.connect(copy) as database:
        return sorted(database.iterdump())


@ON_BOTH
def test_a_database_of_a_newer_version_is_refused_in_a_sentence(
    tmp_path: Path,
    new_url: Callable[[], str | None],
    chainage: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    url = new_url()
    stored = stored_at(url, tmp_path)
    with closing(Database(stored)) as database:
        database.write(
            lambda session: session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
        )
    before = tables_of(stored)
    if url is not None:
        monkeypatch.setenv("CHAINAGE_DATABASE", url)
    with pytest.raises(UnusableDatabase):
        Database(stored)
    for command in (["serve", "--port", "0"], ["backup", tmp_path / "backup.zip"]):
        refused = chainage(*command, "--data", tmp_path)
        assert refused.code == 1
        assert "newer version of Chainage" in refused.err
        assert "Traceback" not in refused.err
    assert tables_of(stored) == before


def test_what_is_no_database_is_refused_in_a_sentence(tmp_path: Path, chainage: Command) -> None:
    (tmp_path / "chainage.db").write_bytes(b"something else" * 1000)
    refused = chainage("serve", "--port", "0", "--data", tmp_path)
    assert refused.code == 1
    assert "cannot be read" in refused.err
    assert "Traceback" not in refused.err


@ON_BOTH
def test_no_new_database_is_made_beside_inspections(
    tmp_path: Path, new_url: Callable[[], str | None]
) -> None:
    places = Places(tmp_path)
    (places.inspections / INSPECTION).mkdir(parents=True)
    with pytest.raises(UnusableDatabase, match=r"missing or empty, but .* holds inspections"):
        require_its_database(stored_at(new_url(), tmp_path), places)


def make_another(file: Path) -> None:
    with closing(sqlite3.connect(file)) as database, database:
        database.execute("CREATE TABLE customers (id)")


@pytest.mark.parametrize(
    ("leave", "said"),
    [(Path.exists, "holds inspections"), (Path.touch, "holds inspections"),
     (make_another, "of another program")],
    ids=["missing", "zero bytes", "another"],
)  # fmt: skip
def test_a_lost_database_is_refused_in_a_sentence(
    tmp_path: Path, chainage: Command, leave: Callable[[Path], object], said: str
) -> None:
    file = tmp_path / "chainage.db"
    (Places(tmp_path).inspections / INSPECTION).mkdir(parents=True)
    leave(file)
    before = file.read_bytes() if file.exists() else None
    refused = chainage("serve", "--port", "0", "--data", tmp_path)
    assert refused.code == 1
    assert said in " ".join(refused.err.split())
    assert "Traceback" not in refused.err
    assert (file.read_bytes() if file.exists() else None) == before


def test_damaged_pages_are_named_in_a_sentence_by_every_command(
    tmp_path: Path, chainage: Command
) -> None:
    path = tmp_path / "chainage.db"
    Database(path).close()
    with path.open("r+b") as file:
        size = file.seek(0, 2)
        file.seek(3 * 4096)
        file.write(b"\xa5" * (size - 3 * 4096))
    export = ["export", "any", "--format", "csv", "--out", tmp_path / "out.csv", "--data", tmp_path]
    for command in (
        ["serve", "--port", "0", "--data", tmp_path],
        ["backup", tmp_path / "backup.zip", "--data", tmp_path],
        export,
    ):
        refused = chainage(*command)
        printed = " ".join(refused.err.split())
        assert refused.code in (1, 2), printed
        assert "Traceback" not in printed
        assert "damaged" in printed
        assert "chainage restore" in printed
        assert "chainage.db" in re.sub(r"[\s│]", "", refused.err)  # a box may break the path
