"""Checks that acknowledged content survives repeated kill -9; `resilience` runs it.

A real server is under load all the time: uploads in pieces, tags that are put, changed and deleted,
a video that is tracked over and over and a camera that is recorded.  In each round the server or
one of its processes is killed at a random moment; then all is compared with what was acknowledged.
`tests/app/tracking/films/test_faults.py` does some rounds of the same.
"""

from __future__ import annotations

import base64
import json
import os
import random
import shutil
import signal
import sqlite3
import tempfile
import threading
import time
import urllib.error
from contextlib import closing, suppress
from dataclasses import dataclass
from http.client import HTTPException
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import msgspec
from builders import TUS, children_of, clip_rig, make_clip, wait_until
from cameras import MjpegCamera
from steps import Server

from app.jobs.track.messages import KeptCheckpoint

FRAMES, PACE = 300, 8.0
"""Frames of the video and its pace: one and a half seconds without interruption."""
UPLOAD_BYTES, PIECE_BYTES = 2_000_000, 150_000
TAGS = 25
PAUSE_S = 0.05
"""Pause between two requests of the same kind."""
KILL_WITHIN_S = (0.1, 2.0)
ENDS_WITHIN_S = 120.0
_WORKERS = {
    "tracker": "app.jobs.track.tracker",
    "camera": "app.jobs.live.camera",
    "media": "app.jobs.requests.media",
}
_MOST_TRACKER_KILLS = 2
"""Most tracker kills in a row: a third without a checkpoint would rightly count as the video's
fault."""
_GONE = (urllib.error.URLError, HTTPException, ConnectionError, TimeoutError)


@dataclass
class Tally:
    """Counts of the events."""

    rounds: int = 0
    server_kills: int = 0
    tracker_kills: int = 0
    camera_kills: int = 0
    media_kills: int = 0
    acknowledged_tags: int = 0
    acknowledged_pieces: int = 0
    uploads_compared: int = 0
    lost: int = 0
    tracks_compared: int = 0
    tracks_that_differ: int = 0
    resumes: int = 0
    frames_tracked_again: int = 0
    recordings_ended: int = 0
    server_errors: int = 0
    """Answers that asked to try again."""
    orphans: int = 0
    stuck: int = 0
    damaged_databases: int = 0

    @property
    def faults(self) -> int:
        """Number of faults, which must be 0."""
        return (
            self.lost + self.tracks_that_differ + self.orphans + self.stuck + self.damaged_databases
        )


class _Load(threading.Thread):
    """Sends one request after the other; an unanswered one is sent again."""

    def __init__(self, server: Server, tally: Tally, rng: random.Random) -> None:
        super().__init__(daemon=True)
        self.server, self.tally, self.rng = server, tally, rng
        self.lock = threading.Lock()
        self.ended = threading.Event()

    def run(self) -> None:
        while not self.ended.wait(PAUSE_S):
            with self.lock, suppress(*_GONE):
                try:
                    self.step()
                except urllib.error.HTTPError as refusal:
                    self.tally.server_errors += refusal.code >= 500

    def step(self) -> None:
        raise NotImplementedError


class Tagger(_Load):
    """Puts, changes and deletes observations."""

    def __init__(self, server: Server, tally: Tally, rng: random.Random, inspection: str) -> None:
        super().__init__(server, tally, rng)
        self._path = f"/api/inspections/{inspection}/observations"
        self._known: dict[str, str | None] = {}
        """The acknowledged remark by id; None for a deleted observation."""
        self._in_hand: tuple[str, str | None] | None = None
        """The unacknowledged request, whose effect is unknown."""

    def step(self) -> None:
        if self._in_hand is None:
            number = self.rng.randrange(TAGS)
            remark = None if self.rng.random() < 0.2 else f"remark {self.rng.random()}"
            self._in_hand = f"00000000-0000-4000-8000-{number:012d}", remark
        name, remark = self._in_hand
        if remark is None:
            try:
                self.server.ask("DELETE", f"{self._path}/{name}").read()
            except urllib.error.HTTPError as refusal:
                if refusal.code != 404:  # it is not there
                    raise
        else:
            body = {"frame": len(self._known), "remark": remark}
            self.server.ask("PUT", f"{self._path}/{name}", body).read()
        self._known[name], self._in_hand = remark, None
        self.tally.acknowledged_tags += 1

    def check(self) -> None:
        """Compare everything acknowledged with the server's state."""
        with self.lock:
            listed = json.load(self.server.ask("GET", self._path))["observations"]
            found = {each["id"]: each["remark"] for each in listed}
            unsure = self._in_hand[0] if self._in_hand else None
            for name, remark in self._known.items():
                if found.get(name) != remark and name != unsure:
                    self.tally.lost += 1


class Uploader(_Load):
    """Uploads in pieces, continuing at the server's offset."""

    def __init__(self, server: Server, tally: Tally, rng: random.Random, data: Path) -> None:
        super().__init__(server, tally, rng)
        self._folder = data / "uploads"
        self._place: str | None = None
        self._content = b""
        self._acknowledged = 0

    def step(self) -> None:
        if self._place is None:
            self._begin()
            return
        at = self.offset()
        if at < self._acknowledged:
            self.tally.lost += 1
        piece = self._content[at : at + PIECE_BYTES]
        kind = {"Content-Type": "application/offset+octet-stream", "Upload-Offset": str(at)}
        self.server.ask("PATCH", self._place, piece, TUS | kind).read()
        self._acknowledged = at + len(piece)
        self.tally.acknowledged_pieces += 1
        if self._acknowledged == len(self._content):
            self._compare()

    def offset(self) -> int:
        """Return the server's offset."""
        assert self._place is not None
        return int(self.server.ask("HEAD", self._place, headers=TUS).headers["Upload-Offset"])

    def _begin(self) -> None:
        self._content, self._acknowledged = self.rng.randbytes(UPLOAD_BYTES), 0
        name = base64.b64encode(b"any.mp4").decode()
        length = {"Upload-Length": str(UPLOAD_BYTES), "Upload-Metadata": f"filename {name}"}
        place = self.server.ask("POST", "/api/uploads", headers=TUS | length).headers["Location"]
        self._place = urlsplit(place).path

    def _compare(self) -> None:
        assert self._place is not None
        path = self._folder / f"{self._place.rsplit('/', 1)[1]}.bin"
        self.tally.uploads_compared += 1
        if path.read_bytes() != self._content:
            self.tally.lost += 1
        place, self._place = self._place, None
        with suppress(*_GONE):  # it expires some day
            self.server.ask("DELETE", place, headers=TUS).read()

    def check(self) -> None:
        """Compare the acknowledged part of the current upload with the server's state."""
        with self.lock:
            if self._place is None:
                return
            at = self.offset()
            path = self._folder / f"{self._place.rsplit('/', 1)[1]}.bin"
            if at < self._acknowledged or path.read_bytes() != self._content[:at]:
                self.tally.lost += 1


class Tracked:
    """A video that is tracked again whenever it is done, and the expected result."""

    def __init__(self, server: Server, tally: Tally, data: Path, inspection: str) -> None:
        self._server, self._tally, self._id = server, tally, inspection
        self._folder = data / "inspections" / inspection
        self._whole = self._left()
        self._seen = 0
        """Frames tracked at the last check."""
        self.tracker_kills = 0
        self.retry()

    def retry(self) -> None:
        """Track from the first frame."""
        self._server.ask("POST", f"/api/inspections/{self._id}/retry").read()
        self.tracker_kills = 0

    def look(self) -> str:
        """Return its state; compare a finished track and track again."""
        state, self._seen = state_of(self._server, self._id)
        if state in ("done", "failed", "cancelled"):
            self._tally.tracks_compared += 1
            if state != "done" or self._left() != self._whole:
                self._tally.tracks_that_differ += 1
        return state

    def note_kill(self) -> None:
        """Note that tracking was killed, to see from where it continues."""
        with suppress(FileNotFoundError):
            content = (self._folder / "checkpoint").read_bytes()
            frames = msgspec.msgpack.decode(content, type=KeptCheckpoint).checkpoint.frames
            self._tally.resumes += 1
            self._tally.frames_tracked_again += max(self._seen - frames, 0)

    def _left(self) -> dict[str, bytes]:
        """Return the results of tracking: the track, its side files and the wall."""
        names = ("track.csv", "health.csv", "joints.csv")
        texts = {name: (self._folder / name).read_bytes() for name in names}
        tiles = {path.name: path.read_bytes() for path in (self._folder / "wall").glob("*.jpg")}
        return texts | tiles


class Storm:
    """The server, its load, and the processes to kill."""

    def __init__(self, data: Path, seed: int) -> None:
        self.tally = Tally()
        self._kills, self._rng = (
            random.Random(f"{seed} {use}")  # noqa: S311
            for use in ("kills", "load")
        )
        self._data = data
        self._server = Server(
            data,
            pace=str(PACE),
            max_jobs="2",
            disk_reserve_bytes="0",
            camera_networks="127.0.0.0/8",
        )
        self._camera = MjpegCamera(rate_hz=10)
        self._recorded: list[str] = []
        """Live inspections whose end has not been seen."""

    def run(self, rounds: int) -> Tally:
        """Run all rounds."""
        with self._server, self._camera, tempfile.TemporaryDirectory() as folder:
            video, rig = make_clip(Path(folder) / "clip.mp4", FRAMES), Path(folder) / "rig.json"
            rig.write_text(json.dumps(clip_rig()))
            inspection = self._server.track(video, rig)
            self._tracked = Tracked(self._server, self.tally, self._data, inspection)
            seeds = [random.Random(self._rng.random()) for _ in range(2)]  # noqa: S311
            self._tagger = Tagger(self._server, self.tally, seeds[0], inspection)
            self._uploader = Uploader(self._server, self.tally, seeds[1], self._data)
            loads: list[_Load] = [self._tagger, self._uploader]
            for load in loads:
                load.start()
            for _ in range(rounds):
                self._round()
            for load in loads:
                load.ended.set()
                load.join()
            self._settle()
        return self.tally

    def _round(self) -> None:
        self.tally.rounds += 1
        if not self._recorded:
            self._record()
        end = time.monotonic() + self._kills.uniform(*KILL_WITHIN_S)
        while (left_s := end - time.monotonic()) > 0:
            if self._tracked.look() in ("done", "failed", "cancelled"):
                self._tracked.retry()
            time.sleep(min(left_s, 0.1))
        victim = self._kills.choice(["server", "server", *_WORKERS])
        if victim == "server":
            self._kill_server()
        else:
            self._kill_worker(victim)
        self._tagger.check()
        self._uploader.check()
        self._look_at_recordings()

    def _kill_server(self) -> None:
        before = children_of(self._server.pid)
        self._server.kill()
        self.tally.server_kills += 1
        self._tracked.note_kill()
        self._tracked.tracker_kills = 0
        self._check_database()
        self._server.start()
        with suppress(AssertionError):  # counted
            wait_until(lambda: not any(is_running(pid, name) for pid, name in before.items()))
            return
        self.tally.orphans += 1

    def _kill_worker(self, name: str) -> None:
        if name == "tracker" and self._tracked.tracker_kills == _MOST_TRACKER_KILLS:
            return
        workers = children_of(self._server.pid)
        pid = next((pid for pid, module in workers.items() if module == _WORKERS[name]), None)
        if pid is None:
            return
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
            counter = f"{name}_kills"
            setattr(self.tally, counter, getattr(self.tally, counter) + 1)
            if name == "tracker":
                self._tracked.note_kill()
                self._tracked.tracker_kills += 1

    def _check_database(self) -> None:
        """Check a copy: opening the file itself would repair it."""
        with tempfile.TemporaryDirectory() as folder:
            for path in self._data.glob("chainage.db*"):
                shutil.copy(path, folder)
            with closing(sqlite3.connect(Path(folder) / "chainage.db")) as database:
                if database.execute("PRAGMA integrity_check").fetchall() != [("ok",)]:
                    self.tally.damaged_databases += 1

    def _record(self) -> None:
        source = {"kind": "live", "url": self._camera.url}
        wanted = {"name": "Culvert 7", "source": source, "rig": clip_rig(), "header": {}}
        made = json.load(self._server.ask("POST", "/api/inspections", wanted))
        self._recorded.append(made["id"])

    def _look_at_recordings(self) -> None:
        """Wait for the end of recordings that a server left behind; end the present one."""
        for inspection in list(self._recorded):
            path = f"/api/inspections/{inspection}"
            if state_of(self._server, inspection)[0] in ("done", "failed"):
                self._server.ask("DELETE", path).read()
                self._recorded.remove(inspection)
                self.tally.recordings_ended += 1
            elif self._rng.random() < 0.3:
                self._server.ask("POST", f"{path}/finish", {"end_condition": "complete"}).read()

    def _settle(self) -> None:
        """Wait, without further kills, until everything has ended."""
        deadline = time.monotonic() + ENDS_WITHIN_S
        while self._recorded or self._tracked.look() not in ("done", "failed"):
            self._look_at_recordings()
            if time.monotonic() > deadline:
                self.tally.stuck += 1
                return
            time.sleep(0.1)


def state_of(server: Server, inspection: str) -> tuple[str, int]:
    """Return the status of an inspection, and the number of tracked frames."""
    found: dict[str, Any] = json.load(server.ask("GET", f"/api/inspections/{inspection}"))
    return found["status"], found["progress"]["frames_done"]


def is_running(pid: int, module: str) -> bool:
    """Return whether this process still runs this module."""
    with suppress(FileNotFoundError, ProcessLookupError):
        return module in Path(f"/proc/{pid}/cmdline").read_text().split("\0")
    return False
