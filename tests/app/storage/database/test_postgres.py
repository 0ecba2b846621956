"""Only of PostgreSQL: the active server, time-outs, lost connections, full disks."""

from __future__ import annotations

import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from datetime import UTC, datetime
from pathlib import Path

import psycopg
import pytest
from builders import TOKEN, Client, assert_error, make_clip, serving, tag_until_it_fails, wait_until
from postgres import PostgresServer, postgres_server
from processes import Process, process
from small_disk import small_disk
from sqlalchemy import text
from sqlalchemy.orm import Session

from app.errors import Busy, DiskFull, InvalidSettings, OtherServerActive, UnusableDatabase
from app.settings import Settings
from app.storage.database.active import LOST_CODE, ActiveSession
from app.storage.database.database import Database, stored_at
from app.storage.database.tables import LoginSession


@pytest.fixture
def url(postgres: PostgresServer) -> str:
    return postgres.new_database()


@pytest.fixture
def database(url: str, tmp_path: Path) -> Iterator[Database]:
    with closing(Database(stored_at(url, tmp_path))) as opened:
        yield opened


def shown(session: Session, *names: str) -> tuple[str, ...]:
    return tuple(str(session.scalar(text(f"SHOW {name}"))) for name in names)


def test_commits_are_synced_and_readers_see_one_state_and_cannot_write(
    url: str, tmp_path: Path
) -> None:
    with psycopg.connect(url, autocommit=True) as other:
        other.execute(f"ALTER DATABASE {other.info.dbname} SET synchronous_commit = off")
    with closing(Database(stored_at(url, tmp_path))) as again:
        assert again.write(lambda session: shown(session, "synchronous_commit")) == ("on",)
        with again.read() as session:
            before = session.scalar(text("SELECT count(*) FROM sessions"))
            again.write(lambda writing: add_login(writing, "meanwhile"))
            assert session.scalar(text("SELECT count(*) FROM sessions")) == before
            assert shown(session, "transaction_isolation") == ("repeatable read",)
        with pytest.raises(Busy), again.read() as session:
            session.execute(text("DELETE FROM sessions"))


def add_login(session: Session, digest: str) -> None:
    now = datetime.now(UTC)
    row = LoginSession(digest=digest, token_digest=digest, created_at=now, seen_at=now)
    session.add(row)


def test_one_server_is_active_at_a_time(database: Database, url: str, tmp_path: Path) -> None:
    with pytest.raises(OtherServerActive):
        Database(stored_at(url, tmp_path))
    database.close()
    with closing(Database(stored_at(url, tmp_path))) as other:
        other.beat()


def test_an_active_server_lives_from_its_question_on_and_not_from_the_answer(
    url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("signal.setitimer", lambda _, left_s: lives.append(left_s))
    lives: list[float] = []
    with psycopg.connect(url) as connection:
        active = ActiveSession(connection, ends_process=True)
        for waited_s in (5.0, 60.0):
            active.answered(time.monotonic() - waited_s)
    assert 0 < lives[0] < 7.1
    assert 0 < lives[1] < 0.1


def test_a_write_that_waits_too_long_is_busy_and_leaves_nothing(
    database: Database, url: str
) -> None:
    refused: list[BaseException] = []

    def write() -> None:
        try:
            database.write(lambda session: add_login(session, "waits"))
        except Busy as error:
            refused.append(error)

    with psycopg.connect(url, autocommit=True) as other:
        other.execute("BEGIN")
        other.execute("LOCK TABLE sessions")
        waiting = threading.Thread(target=write)
        waiting.start()
        # A time-out ends it in the same way, after some seconds.
        cancel = "SELECT pg_cancel_backend(pid) FROM pg_stat_activity WHERE wait_event = 'relation'"
        wait_until(lambda: other.execute(cancel).fetchone())
        waiting.join()
        assert [str(error)[-1] for error in refused] == ["."]
        other.execute("COMMIT")
    database.write(lambda session: add_login(session, "goes on"))
    with database.read() as session:
        assert session.get(LoginSession, "waits") is None
        assert session.get(LoginSession, "goes on") is not None


def test_no_statement_and_no_wait_is_unbounded(database: Database) -> None:
    names = ("statement_timeout", "lock_timeout", "idle_in_transaction_session_timeout")
    with database.read() as session:
        assert "0" not in shown(session, *names)
    assert "0" not in database.write(lambda session: shown(session, *names))


def test_without_the_session_that_writes_nothing_is_written_and_reading_goes_on(
    database: Database, url: str
) -> None:
    def lose(session: Session) -> None:
        add_login(session, "lost")
        session.flush()
        end_others(url)

    for change in (lose, lambda session: add_login(session, "later")):
        with pytest.raises(Busy):
            database.write(change)
    with database.read() as session:
        assert session.scalar(text("SELECT count(*) FROM sessions")) == 0


def end_others(url: str) -> None:
    with psycopg.connect(url, autocommit=True) as other:
        other.execute(
            "SELECT pg_terminate_backend(pid, 5000) FROM pg_stat_activity "
            "WHERE datname = current_database() AND pid <> pg_backend_pid()"
        )


def test_nothing_acknowledged_is_lost_when_the_server_of_the_database_is_killed(
    tmp_path: Path,
) -> None:
    """The server ends with its database; what starts it again does so until that is back."""
    with postgres_server(is_safe=True) as postgres, ExitStack() as stack:
        url, data = postgres.new_database(), tmp_path / "data"
        active = Process(data, tmp_path / "log", DATABASE=url)
        stack.callback(active.end)
        client = stack.enter_context(Client(active, TOKEN))  # type: ignore[arg-type]
        run = client.inspect(make_clip(tmp_path / "clip.mp4", 40))
        client.wait(run, "done")
        acknowledged: set[str] = set()
        tagging = threading.Thread(target=tag_until_it_fails, args=(client, run, acknowledged))
        tagging.start()
        wait_until(lambda: len(acknowledged) > 20)
        postgres.kill()
        assert active.wait() == LOST_CODE
        tagging.join()
        assert "Start it again" in active.log.read_text()

        postgres.start()
        with process(data, DATABASE=url) as again:
            tags = again.get(f"/api/inspections/{run}/observations").json()["observations"]
            assert acknowledged <= {tag["id"] for tag in tags}
            # The history has as many: each tag was made once, also if its answer was lost.
            events = again.get(f"/api/inspections/{run}/events").json()["events"]
            created = [event["observation_id"] for event in events if event["action"] == "created"]
            assert sorted(filter(None, created)) == sorted(tag["id"] for tag in tags)


def test_a_full_disk_refuses_what_it_cannot_hold_and_goes_on_when_there_is_room(
    postgres: PostgresServer, tmp_path: Path
) -> None:
    with small_disk(postgres.folder / "disk", 16) as disk:
        url = postgres.new_database(folder=disk.place)
        try:
            with closing(Database(stored_at(url, tmp_path))) as database:
                disk.fill()
                with pytest.raises(DiskFull, match="disk of the database"):
                    database.write(add_much)
                disk.make_room()
                database.write(lambda session: add_login(session, "fits"))
                with database.read() as session:
                    assert session.scalar(text("SELECT count(*) FROM sessions")) == 1
        finally:
            postgres.drop(url)


def add_much(session: Session) -> None:
    for _ in range(2000):
        add_login(session, uuid.uuid4().hex)
    session.flush()


def test_a_database_that_cannot_be_reached_is_named_without_its_password(
    tmp_path: Path, chainage: Callable[..., object], monkeypatch: pytest.MonkeyPatch
) -> None:
    url = "postgresql://chainage:hidden-word@127.0.0.1:1/nowhere"
    with pytest.raises(UnusableDatabase, match=r"nowhere on 127\.0\.0\.1 cannot be reached"):
        stored_at(url, tmp_path).revision()
    monkeypatch.setenv("CHAINAGE_DATABASE", url)
    refused = chainage("serve", "--port", "0", "--data", tmp_path)
    assert refused.code == 1
    assert "cannot be reached" in refused.err
    assert "hidden-word" not in refused.err + repr(Settings.load())
    assert "Traceback" not in refused.err


@pytest.mark.parametrize("url", ["mysql://here/name", "chainage.db", "postgresql+asyncpg://h/n"])
def test_another_kind_of_address_is_refused_without_repeating_it(url: str) -> None:
    with pytest.raises(InvalidSettings, match="CHAINAGE_DATABASE") as refusal:
        Settings.load(database=url)
    assert url not in str(refusal.value)


def test_without_the_driver_the_command_that_installs_it_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "psycopg", None)
    with pytest.raises(InvalidSettings, match=r"pip install 'chainage\[cluster\]'"):
        stored_at("postgresql://here/name", tmp_path)


def test_health_and_metrics_name_the_kind_and_the_version_and_nul_is_refused(
    url: str, tmp_path: Path
) -> None:
    with serving(tmp_path / "data", database=url) as client, psycopg.connect(url) as connection:
        version = str(connection.info.server_version // 10_000)
        checks = {check["name"]: check for check in client.get("/readyz").json()["checks"]}
        assert checks["postgresql"]["detail"].startswith(f"Version {version}.")
        assert f'database="PostgreSQL {version}.' in client.get("/metrics").text
        assert not (tmp_path / "data" / "chainage.db").exists()
        # PostgreSQL cannot compare such a text with anything.
        answer = client.get("/api/archive/defects", params={"project": "a\0b"})
        assert_error(answer, 422, "invalid_request")


def test_a_database_that_cannot_hold_every_name_is_refused(
    postgres: PostgresServer, tmp_path: Path
) -> None:
    url = postgres.new_database(options="ENCODING 'LATIN1' LOCALE 'C'")
    with pytest.raises(UnusableDatabase, match="UTF8"):
        stored_at(url, tmp_path).revision()
