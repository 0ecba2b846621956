"""Backups lead from SQLite to PostgreSQL and back, and nothing is lost on the way."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from builders import serving, wait_until
from postgres import PostgresServer
from surveys import Survey, served

from app.errors import UnusableBackup
from app.storage.database.backup import back_up, restore
from app.storage.database.database import stored_at

Command = Callable[..., Any]


def quietly(_done: int, _total: int) -> None:
    """Nobody looks at the progress."""


@pytest.fixture(scope="module")
def tagged(
    survey: Survey, postgres: PostgresServer, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, str]:
    """A data folder and its database at a URL, with a photo and texts of every alphabet, which no
    test changes.
    """
    data, url = tmp_path_factory.mktemp("tagged"), postgres.new_database()
    with served(survey, data, url) as client:
        tag = client.tag(survey.id, code="BAB", remark="Größe: 7 „mm“\n雨水 – 😀").json()["id"]
        labels = {"labels": ["Größe", "雨水"]}
        client.put(f"/api/inspections/{survey.id}/labels", json=labels).raise_for_status()
        path = f"/api/inspections/{survey.id}/observations/{tag}/photo"
        wait_until(lambda: client.get(path).status_code == 200)
    return data, url


def everything(folder: Path, stored_url: str | None, copies: Path) -> list[str]:
    """Every table and row, in the form of SQLite."""
    copy = copies / "everything.db"
    stored_at(stored_url, folder).copy_to(copy)
    with closing(sqlite3.connect(copy)) as database:
        return sorted(database.iterdump())


def test_an_archive_leads_to_sqlite_and_back_to_postgresql(
    tagged: tuple[Path, str],
    survey: Survey,
    postgres: PostgresServer,
    tmp_path: Path,
    chainage: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data, url = tagged
    before = everything(data, url, tmp_path)
    monkeypatch.setenv("CHAINAGE_DATABASE", url)
    made = chainage("backup", tmp_path / "first.zip", "--data", data)
    assert (made.code, "1 inspections, 1 observations" in made.out) == (0, True), made.err
    monkeypatch.delenv("CHAINAGE_DATABASE")
    restore(tmp_path / "first.zip", tmp_path / "plain", quietly)
    assert everything(tmp_path / "plain", None, tmp_path) == before
    back_up(tmp_path / "plain", tmp_path / "second.zip", quietly)
    again = postgres.new_database()
    monkeypatch.setenv("CHAINAGE_DATABASE", again)
    back = chainage("restore", tmp_path / "second.zip", "--data", tmp_path / "again")
    assert (back.code, "1 inspections, 1 observations" in back.out) == (0, True), back.err
    assert everything(tmp_path / "again", again, tmp_path) == before
    assert not list((tmp_path / "again").glob("chainage.db*"))
    with serving(tmp_path / "again", database=again) as client:
        path = f"/api/inspections/{survey.id}"
        (tag,) = client.get(f"{path}/observations").json()["observations"]
        assert tag["remark"] == "Größe: 7 „mm“\n雨水 – 😀"
        assert client.get(f"{path}/observations/{tag['id']}/photo").status_code == 200
        # The numbers of events continue after those that were restored.
        assert client.tag(survey.id).status_code == 200
        actions = [event["action"] for event in client.get(f"{path}/events").json()["events"]]
        assert actions.count("created") == 3


def test_a_report_is_exported_from_postgresql_and_nothing_changes(
    tagged: tuple[Path, str],
    survey: Survey,
    tmp_path: Path,
    chainage: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data, url = tagged
    before = everything(data, url, tmp_path)
    monkeypatch.setenv("CHAINAGE_DATABASE", url)
    out = tmp_path / "report.csv"
    done = chainage("export", survey.id, "--format", "csv", "--out", out, "--data", data)
    assert done.code == 0, done.err
    assert out.read_text("utf-8-sig").count("BAB") == 1
    assert everything(data, url, tmp_path) == before


def test_a_database_with_tables_is_not_restored_into(
    tagged: tuple[Path, str], tmp_path: Path, chainage: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, url = tagged
    back_up(data, tmp_path / "backup.zip", quietly, url)
    before = everything(data, url, tmp_path)
    monkeypatch.setenv("CHAINAGE_DATABASE", url)
    refused = chainage("restore", tmp_path / "backup.zip", "--data", tmp_path / "new")
    assert refused.code == 1
    assert "has tables" in refused.err
    assert not (tmp_path / "new").exists()
    assert everything(data, url, tmp_path) == before


def test_what_postgresql_cannot_hold_is_refused_in_a_sentence_and_leaves_nothing(
    tagged: tuple[Path, str], postgres: PostgresServer, tmp_path: Path
) -> None:
    """No request stores such a text; an older database might hold one."""
    data, url = tagged
    back_up(data, tmp_path / "backup.zip", quietly, url)
    restore(tmp_path / "backup.zip", tmp_path / "plain", quietly)
    with closing(sqlite3.connect(tmp_path / "plain" / "chainage.db")) as database, database:
        database.execute("UPDATE inspections SET name = 'a' || char(0) || 'b'")
    back_up(tmp_path / "plain", tmp_path / "odd.zip", quietly)
    empty = postgres.new_database()
    with pytest.raises(UnusableBackup, match=r"PostgreSQL does not accept .*\.$"):
        restore(tmp_path / "odd.zip", tmp_path / "new", quietly, empty)
    assert not (tmp_path / "new").exists()
    assert stored_at(empty, tmp_path).revision() is None


def test_an_export_without_a_database_says_so(
    postgres: PostgresServer, tmp_path: Path, chainage: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHAINAGE_DATABASE", postgres.new_database())
    refused = chainage("backup", tmp_path / "backup.zip", "--data", tmp_path)
    assert refused.code == 1
    assert "no tables of Chainage" in refused.err
