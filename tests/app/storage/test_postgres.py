"""Only of PostgreSQL: turns of several servers, time-outs, lost connections, full disks."""

from __future__ import annotations

import sys
import threading
import uuid
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from datetime import UTC, datetime
from pathlib import Path

import psycopg
import pytest
from builders import Client, assert_error, serving, wait_until
from postgres import PostgresServer, postgres_server
from small_disk import small_disk
from sqlalchemy import text
from sqlalchemy.orm import Session
from surveys import Survey, served

from app.errors import Busy, DiskFull, InvalidSettings, UnusableDatabase
from app.settings import Settings
from app.storage.database.database import Database, stored_at
from app.storage.database.tables import LoginSession, Preference


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
    database: Database, url: str
) -> None:
    with psycopg.connect(url, autocommit=True) as other:
        other.execute(f"ALTER DATABASE {other.info.dbname} SET synchronous_commit = off")
    again = Database(database.dialect)
    with closing(again):
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


def test_servers_that_write_take_turns(url: str, tmp_path: Path) -> None:
    """Each adds to what it has read; without turns most additions would be lost."""
    with ExitStack() as stack:
        servers = [stack.enter_context(closing(Database(stored_at(url, tmp_path)))) for _ in "123"]

        def add_one(session: Session) -> None:
            row = session.get(Preference, "count")
            number = 0 if row is None else row.chosen["number"]
            session.merge(Preference(who="count", chosen={"number": number + 1}))

        def add_many(server: Database) -> None:
            for _ in range(20):
                server.write(add_one)

        threads = [threading.Thread(target=add_many, args=(server,)) for server in servers * 2]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        with servers[0].read() as session:
            counted = session.get(Preference, "count")
            assert counted is not None
            assert counted.chosen == {"number": 120}


def test_servers_that_start_together_make_the_tables_once(url: str, tmp_path: Path) -> None:
    opened: list[Database] = []
    threads = [
        threading.Thread(target=lambda: opened.append(Database(stored_at(url, tmp_path))))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(opened) == 4
    for database in opened:
        database.beat()
        database.close()


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
        key = int.from_bytes(b"chainage")
        other.execute("SELECT pg_advisory_lock(%s)", (key,))
        waiting = threading.Thread(target=write)
        waiting.start()
        # A time-out ends it in the same way, after ten seconds.
        cancel = "SELECT pg_cancel_backend(pid) FROM pg_stat_activity WHERE wait_event = 'advisory'"
        wait_until(lambda: other.execute(cancel).fetchone())
        waiting.join()
        assert [str(error)[-1] for error in refused] == ["."]
        other.execute("SELECT pg_advisory_unlock(%s)", (key,))
    database.write(lambda session: add_login(session, "goes on"))
    with database.read() as session:
        assert session.get(LoginSession, "waits") is None
        assert session.get(LoginSession, "goes on") is not None


def test_no_statement_and_no_wait_is_unbounded(database: Database) -> None:
    names = ("statement_timeout", "lock_timeout", "idle_in_transaction_session_timeout")
    with database.read() as session:
        assert "0" not in shown(session, *names)
    assert "0" not in database.write(lambda session: shown(session, *names))


def test_a_lost_connection_is_busy_once_and_the_next_one_works(
    database: Database, url: str
) -> None:
    database.beat()

    def lose(session: Session) -> None:
        add_login(session, "lost")
        session.flush()
        end_others(url)

    with pytest.raises(Busy):
        database.write(lose)
    with database.read() as session:
        session.execute(text("SELECT 1"))
    end_others(url)  # while they are not used
    database.write(lambda session: add_login(session, "kept"))
    with database.read() as session:
        assert session.get(LoginSession, "lost") is None
        assert session.get(LoginSession, "kept") is not None


def end_others(url: str) -> None:
    with psycopg.connect(url, autocommit=True) as other:
        other.execute(
            "SELECT pg_terminate_backend(pid, 5000) FROM pg_stat_activity "
            "WHERE datname = current_database() AND pid <> pg_backend_pid()"
        )


def test_nothing_acknowledged_is_lost_when_the_server_of_the_database_is_killed(
    tmp_path: Path, survey: Survey
) -> None:
    with postgres_server(is_safe=True) as postgres, served(
        survey, tmp_path / "data", postgres.new_database()
    ) as client:  # fmt: skip
        acknowledged: dict[str, int] = {}
        refused: list[str] = []
        is_over = threading.Event()
        tagging = threading.Thread(
            target=tag_until, args=(is_over, client, survey.id, acknowledged, refused)
        )
        tagging.start()
        wait_until(lambda: len(acknowledged) > 20)
        postgres.kill()
        wait_until(lambda: refused)
        assert_error(client.get("/api/inspections"), 503, "busy")
        wait_until(lambda: client.get("/readyz").status_code == 503)
        postgres.start()
        wait_until(lambda: client.get("/readyz").status_code == 200)
        is_over.set()
        tagging.join()
        assert set(refused) == {"busy"}
        listed = client.get(f"/api/inspections/{survey.id}/observations").json()["observations"]
        frames = {tag["id"]: tag["frame"] for tag in listed}
        assert {name: frames.get(name) for name in acknowledged} == acknowledged
        # The history has as many: each tag was made once, also if its answer was lost.
        events = client.get(f"/api/inspections/{survey.id}/events").json()["events"]
        created = [event["observation_id"] for event in events if event["action"] == "created"]
        assert sorted(filter(None, created)) == sorted(frames)


def tag_until(
    is_over: threading.Event,
    client: Client,
    inspection_id: str,
    acknowledged: dict[str, int],
    refused: list[str],
) -> None:
    """Tag like the page: what was refused is sent again under the same id."""
    while not is_over.is_set():
        name, frame = str(uuid.uuid4()), len(acknowledged) % 40
        while (answer := client.tag(inspection_id, name, frame=frame)).status_code != 200:
            refused.append(answer.json()["code"])
            is_over.wait(0.05)
        acknowledged[name] = frame


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
