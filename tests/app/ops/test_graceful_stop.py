"""SIGTERM: the server ends soon and cleanly whatever it is doing, and goes on at its next start."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
from builders import PATIENCE_S, Client, make_clip, wait_until
from cameras import MjpegCamera
from processes import process
from surveys import Survey
from websockets.exceptions import ConnectionClosedError


def test_a_server_at_work_ends_soon_and_goes_on_at_its_next_start(
    tmp_path: Path, survey: Survey
) -> None:
    data, done = survey.copied_to(tmp_path / "data"), survey.id
    film = make_clip(tmp_path / "film.mp4", 250)
    with MjpegCamera() as camera:
        settings = {"CAMERA_NETWORKS": "127.0.0.0/8", "PACE": "0.5"}
        with process(data, **settings) as client:
            running = client.inspect(film)
            live = client.record(camera.url)
            wait_until(lambda: all(frames(client, each) > 20 for each in (running, live)))
            tag = client.tag(done).json()["id"]
            pid = client.server.pid  # type: ignore[attr-defined]
            started = descendants(pid)
            assert len(started) >= 3
            with client.socket(f"/api/inspections/{live}/live") as socket:
                socket.recv(PATIENCE_S)
                code = client.server.terminate(PATIENCE_S)  # type: ignore[attr-defined]
                with pytest.raises(ConnectionClosedError, match="1012"):
                    list(socket)  # what was under way comes first
            log = client.server.log.read_text()  # type: ignore[attr-defined]
        assert (code, "Traceback" in log) == (0, False), log
        assert [pid for pid in started if Path(f"/proc/{pid}").exists()] == []
        assert not (data / "chainage.db-wal").exists(), "what was written is in the database"
        with sqlite3.connect(data / "chainage.db") as database:
            assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        with process(data, **settings) as client:
            listed = client.get(f"/api/inspections/{done}/observations").json()["observations"]
            assert [each["id"] for each in listed] == [tag]
            wait_until(lambda: frames(client, running) > 20)
            client.post(f"/api/inspections/{running}/cancel")  # there is one slot
            recovered = client.wait(live)
            assert (recovered["status"], frames(client, live) > 20) == ("done", True)


def frames(client: Client, inspection_id: str) -> int:
    return int(client.inspection(inspection_id)["progress"]["frames_done"])


def descendants(pid: int) -> list[int]:
    return [
        int(child)
        for task in Path(f"/proc/{pid}/task").iterdir()
        for child in (task / "children").read_text().split()
    ]
