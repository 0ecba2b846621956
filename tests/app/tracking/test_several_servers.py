"""Two server processes on one PostgreSQL database and one data folder."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import psycopg
import pytest
from builders import TOKEN, Client, make_clip, wait_until
from postgres import PostgresServer
from processes import Process
from websockets.sync.client import ClientConnection

FRAMES, PACE = 150, "0.25"
"""A film that takes 24 s so slowly: enough to kill a server meanwhile."""


class Fleet:
    """Servers that share everything."""

    def __init__(self, folder: Path, url: str, stack: ExitStack) -> None:
        self.url = url
        self._folder, self._stack = folder, stack
        self._processes: dict[Client, Process] = {}

    def add(self, **settings: str) -> Client:
        """Start another server."""
        log = self._folder / f"server{len(self._processes)}.log"
        process = Process(self._folder / "data", log, DATABASE=self.url, **settings)
        self._stack.callback(process.end)
        client = self._stack.enter_context(Client(process, TOKEN))  # type: ignore[arg-type]
        client.data = self._folder / "data"
        self._processes[client] = process
        return client

    def kill(self, client: Client) -> None:
        """Kill a server and its children at once."""
        os.kill(self._processes[client].pid, signal.SIGKILL)


@pytest.fixture
def fleet(postgres: PostgresServer, tmp_path: Path) -> Iterator[Fleet]:
    with ExitStack() as stack:
        yield Fleet(tmp_path, postgres.new_database(), stack)


def updates(socket: ClientConnection) -> Iterator[dict[str, Any]]:
    """The headers of the live messages, each acknowledged."""
    while True:
        message = socket.recv(60)
        if isinstance(message, bytes):
            length = int.from_bytes(message[:4], "big")
            header = json.loads(message[4 : 4 + length])
            header["has_picture"] = len(message) > 4 + length
            socket.send(json.dumps({"type": "ack", "seq": header["seq"]}))
            yield header


def until(socket: ClientConnection, fits: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    return next(update for update in updates(socket) if fits(update))


def test_servers_show_what_happens_on_another_and_end_the_run_of_one_that_is_killed(
    fleet: Fleet, tmp_path: Path
) -> None:
    one = fleet.add(PACE=PACE)
    film = make_clip(tmp_path / "clip.mp4", FRAMES)
    run = one.inspect(film)
    one.wait(run, "running")
    other = fleet.add()  # it joins while the film is tracked
    with other.socket(f"/api/inspections/{run}/live") as socket:
        running = until(socket, lambda update: update["has_picture"] and update["frame"] > 8)
        assert running["state"] == "running"
        # The whole track is there, not only what came after it joined.
        frames = rows_of(other, run)
        assert frames[:3] == ["0", "1", "2"]
        assert len(frames) >= running["frame"] + 1
        tag = one.tag(run, frame=5, code="BAB").json()
        assert [t["id"] for t in tags_of(other, run)] == [tag["id"]]
        zero = {"zero": {"frame": 0, "offset_m": 7.0}}
        stated = other.get(f"/api/inspections/{run}/corrections").json()["stated"] | zero
        one.put(f"/api/inspections/{run}/corrections", json=stated).raise_for_status()
        # At once: also the one that has derived distances before derives them anew.
        assert tags_of(other, run)[0]["distance_m"] > 7.0
        assert tags_of(other, run)[0]["distance_m"] == tags_of(one, run)[0]["distance_m"]
        # Asked to stop on the other one, it ends and keeps its track so far.
        ended = other.post(f"/api/inspections/{run}/cancel").json()
        assert ended["status"] == "cancelled"
        assert until(socket, lambda update: update["state"] != "running")["state"] == "cancelled"
    assert rows_of(one, run) == rows_of(other, run)
    assert len(rows_of(one, run)) == ended["progress"]["frames_done"] > 0

    run = one.inspect(film)
    with other.socket(f"/api/inspections/{run}/live") as socket:
        until(socket, lambda update: update["has_picture"])
        tag = one.tag(run, frame=FRAMES - 1, code="BAB").json()["id"]  # tracked by nobody yet
        fleet.kill(one)
        done = until(socket, lambda update: update["state"] not in ("running", "queued"))
    assert done["state"] == "done"
    with psycopg.connect(fleet.url) as connection:
        claims = connection.execute(
            "SELECT attempt, status FROM inspections WHERE id = %s", (run,)
        ).fetchall()
    assert claims == [(2, "done")]  # so it was killed in the middle, and claimed once more
    inspection = other.inspection(run)
    assert (inspection["status"], inspection["progress"]["frames_done"]) == ("done", FRAMES)
    assert rows_of(other, run) == [str(frame) for frame in range(FRAMES)]
    assert other.get("/readyz").status_code == 200
    # A photo that the dead one left is made, and the duties of the leader are done.
    photo = f"/api/inspections/{run}/observations/{tag}/photo"
    wait_until(lambda: other.get(photo).status_code == 200)
    wait_until(lambda: tag in other.get("/api/archive/defects").text)


def rows_of(client: Client, inspection_id: str) -> list[str]:
    """The numbers of the tracked frames."""
    text = client.get(f"/api/inspections/{inspection_id}/track").text
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return [line.partition(",")[0] for line in lines[1:]]


def tags_of(client: Client, inspection_id: str) -> list[dict[str, Any]]:
    path = f"/api/inspections/{inspection_id}/observations"
    return list(client.get(path).json()["observations"])
