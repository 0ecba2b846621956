"""Two server processes on one PostgreSQL database and one data folder: one is active."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import psycopg
import pytest
from builders import PATIENCE_S, TOKEN, Client, make_clip, tag_until_it_fails, wait_until
from forks import Fork
from postgres import PostgresServer
from processes import Process

from app.storage.database.active import LOST_CODE
from app.storage.database.database import stored_at
from app.storage.folder.address import Address, AddressFile
from app.storage.folder.files import DataFolder, Places

FRAMES, PACE = 150, "0.25"
"""A film that takes 24 s so slowly: enough to lose a server meanwhile."""
_ACTIVE = "FROM pg_stat_activity WHERE application_name = 'chainage active'"


def kill(active: Process, url: str) -> None:
    os.kill(active.pid, signal.SIGKILL)


def cut_off(active: Process, url: str) -> None:
    with psycopg.connect(url, autocommit=True) as other:
        other.execute(f"SELECT pg_terminate_backend(pid) {_ACTIVE}")


def freeze(active: Process, url: str) -> None:
    os.kill(active.pid, signal.SIGSTOP)


@pytest.mark.parametrize(
    ("lose", "code"),
    [(kill, -signal.SIGKILL), (cut_off, LOST_CODE), (freeze, -signal.SIGALRM)],
)
def test_a_standby_takes_over_and_nothing_is_lost_or_there_twice(
    postgres: PostgresServer, tmp_path: Path, lose: Callable[[Process, str], None], code: int
) -> None:
    url, data = postgres.new_database(), tmp_path / "data"
    acknowledged: set[str] = set()
    with ExitStack() as stack:
        active = Process(data, tmp_path / "active.log", DATABASE=url, PACE=PACE)
        stack.callback(active.end)
        client = stack.enter_context(Client(active, TOKEN))  # type: ignore[arg-type]
        standby = Process(data, tmp_path / "standby.log", is_standby=True, DATABASE=url)
        stack.callback(standby.end)
        wait_until(lambda: "standby" in standby.log.read_text())
        run = client.inspect(make_clip(tmp_path / "clip.mp4", FRAMES))
        client.wait(run, "running")
        tagging = threading.Thread(target=tag_until_it_fails, args=(client, run, acknowledged))
        tagging.start()
        wait_until(lambda: len(acknowledged) > 20)

        lose(active, url)
        standby.wait_until_it_serves()
        if lose is freeze:
            os.kill(active.pid, signal.SIGCONT)
        assert active.wait() == code
        tagging.join()

        found = AddressFile(Places(data))
        assert found.is_in_use()
        wait_until(lambda: (address := found.read()) and address.url == standby.url)
        other = stack.enter_context(Client(standby, TOKEN))  # type: ignore[arg-type]
        other.wait(run, "done")
        tags = other.get(f"/api/inspections/{run}/observations").json()["observations"]
        assert acknowledged <= {tag["id"] for tag in tags}
        events = other.get(f"/api/inspections/{run}/events").json()["events"]
        created = [event["observation_id"] for event in events if event["action"] == "created"]
        assert sorted(filter(None, created)) == sorted(tag["id"] for tag in tags)
        track = other.get(f"/api/inspections/{run}/track").text.splitlines()
        rows = [line.partition(",")[0] for line in track if not line.startswith("#")]
        assert rows[1:] == [str(frame) for frame in range(FRAMES)]
        with psycopg.connect(url) as connection:
            runs = connection.execute("SELECT attempt, status FROM inspections").fetchall()
        assert runs == [(2, "done")]  # so it was lost in the middle, and tracked once more


def test_a_standby_that_waits_is_stopped_as_a_server_is(
    postgres: PostgresServer, tmp_path: Path
) -> None:
    url = postgres.new_database()
    active = stored_at(url, tmp_path)
    active.lead(None)
    standby = Process(tmp_path / "data", tmp_path / "log", is_standby=True, DATABASE=url)
    try:
        wait_until(lambda: "standby" in standby.log.read_text())
        assert standby.terminate() == 0
    finally:
        standby.end()
        active.stop()


def test_a_command_finds_the_standby_that_has_just_taken_over(
    postgres: PostgresServer, tmp_path: Path
) -> None:
    url, data, log = postgres.new_database(), tmp_path / "data", tmp_path / "log"
    successor = stored_at(url, data)
    successor.lead(None)  # it leads, and does not hold the folder yet
    command = Fork(
        ["archive", "list", "--data", str(data)],
        os.environ | {"CHAINAGE_DATABASE": url, "CHAINAGE_TOKEN": TOKEN},
        log,
    )
    try:
        wait_until(lambda: waits_for_the_lock(url))
        folder = DataFolder(data, reserve_bytes=0, is_shared=True)
        AddressFile(folder).keep(Address("http://127.0.0.1:1", None))
        assert command.wait(PATIENCE_S) == 1
    finally:
        command.end()
        successor.stop()
    folder.close()
    assert "The server at http://127.0.0.1:1 does not answer" in " ".join(log.read_text().split())


def waits_for_the_lock(url: str) -> bool:
    with psycopg.connect(url) as connection:
        found = connection.execute(
            "SELECT count(*) FROM pg_stat_activity "
            "WHERE application_name = 'chainage' AND datname = current_database()"
        )
        return found.fetchone() == (2,)  # the one that has it, and the one that waits
