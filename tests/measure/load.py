"""Measures whether server, cameras and viewers sustain the stated load; `resilience` runs it.

`four`: four cameras at 15 frames a second, one real page, programs as viewers of the others.
`viewers`: one camera at 30, twenty viewers: a real page, seventeen programs that keep up, one that
takes a second for each message and one that never acknowledges.  The cameras send 640 x 480 of a
rendered culvert with the number of the frame in it; the number says when a picture was taken, so
that the age of what is shown is known whatever the server claims.  Cameras, viewers and Chromium
with its 3D view in software use the same cores as the server.
"""

from __future__ import annotations

import io
import json
import multiprocessing
import os
import statistics
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
from playwright.sync_api import Page
from steps import TOKEN, Server
from watchers import SLOW_S, Seen, Viewer, watch

from app.lab.simulation.sample import SAMPLE
from measure.live import (
    RATE_HZ,
    WARM_UP_S,
    WATCH,
    NumberedCamera,
    ask_json,
    drive,
    percentile,
    server_and_page,
)

NEVER_S = 1e6
_LOOK_EVERY_S = 0.01
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class Load:
    """The load on the server."""

    cameras: int
    rate_hz: int
    pauses_s: tuple[tuple[float, ...], ...]
    """By camera, the pause of each viewer that is a program; the page shows the first camera."""


LOADS = {
    "four": Load(4, 15, ((), (0.0,), (0.0,), (0.0,))),
    "viewers": Load(1, 30, ((0.0,) * 17 + (SLOW_S, NEVER_S),)),
}


@dataclass(frozen=True)
class Recorded:
    """The outcome of one camera's frames."""

    frames: int
    """Frames in the recording."""
    rows: int
    """Rows of the track."""
    left_out: int
    """Frames that the tracker skipped during the measurement: their rows are interpolated."""
    left_out_before: int
    """Frames skipped while page and 3D view were starting."""


@dataclass(frozen=True)
class Held:
    """The figures of one run; ages in ms."""

    recorded: list[Recorded]
    page: list[float]
    """Age of the picture on the page at each of its animation frames."""
    programs: list[float]
    """p95 of each viewer that keeps up."""
    rss_mb: list[float]

    @property
    def growth(self) -> float:
        """Growth of the memory, as a share."""
        third = len(self.rss_mb) // 3
        first, last = map(statistics.median, (self.rss_mb[:third], self.rss_mb[-third:]))
        return last / first - 1


class Census:
    """Memory of the server with its children once a second."""

    def __init__(self, server: Server) -> None:
        self.rss_mb: list[float] = []
        self._server = server
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Stop."""
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(1):
            pids = [self._server.pid, *descendants(self._server.pid)]
            self.rss_mb.append(sum(map(_rss_bytes, pids)) / 2**20)


def descendants(pid: int) -> list[int]:
    """Return the processes that a process has started, and theirs."""
    found: list[int] = []
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(FileNotFoundError, ProcessLookupError):  # the thread has just ended
            for child in path.read_text().split():
                found += [int(child), *descendants(int(child))]
    return found


def _rss_bytes(pid: int) -> int:
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * _PAGE_BYTES
    except (FileNotFoundError, ProcessLookupError):  # it has just ended
        return 0


def measure(page: Page, server: Server, load: Load, cameras: Sequence[NumberedCamera],
            pool: ProcessPoolExecutor, seconds: float) -> Held:  # fmt: skip
    ids = [_started(server, camera) for camera in cameras]
    page.goto(f"{server.url}/inspections/{ids[0]}")
    page.wait_for_function(
        "() => document.querySelector('inspection-page').desk?.playhead.value.row"
    )
    sockets = server.url.replace("http", "ws", 1)
    viewers = [
        Viewer(f"{sockets}/api/inspections/{id_}/live", server.url, TOKEN, pause_s)
        for id_, pauses in zip(ids, load.pauses_s, strict=True)
        for pause_s in pauses
    ]
    until_s = time.time() + WARM_UP_S + seconds
    watching = pool.submit(watch, viewers, until_s)
    time.sleep(WARM_UP_S)
    since_s, before = time.time(), [_dropped(server, id_) for id_ in ids]
    census = Census(server)
    samples = page.evaluate(WATCH, until_s - time.time())["samples"]
    census.end()
    seen = watching.result(60)
    after = [_dropped(server, id_) for id_ in ids]
    recorded = [
        Recorded(*_ended(server, id_), later - earlier, earlier)
        for id_, earlier, later in zip(ids, before, after, strict=True)
    ]
    whose = [
        camera
        for camera, pauses in zip(cameras, load.pauses_s, strict=True)
        for _ in pauses
    ]  # fmt: skip
    return Held(
        recorded=recorded,
        page=[at_ms - cameras[0].sent_ms[number] for at_ms, number, _, _ in samples],
        programs=[
            percentile(ages_ms(got, camera.sent_ms, since_s), 95)
            for viewer, got, camera in zip(viewers, seen, whose, strict=True)
            if not viewer.pause_s
        ],
        rss_mb=census.rss_mb,
    )


def ages_ms(got: Seen, sent_ms: dict[int, float], since_s: float) -> list[float]:
    """Return the ages of the newest pose that a viewer has, sampled every 10 ms."""
    zero_s = statistics.median(sent_ms[number] / 1000 - t_s for t_s, number in got.numbers)
    arrived_s, time_s = np.array(got.arrived_s), np.array(got.time_s)
    looked_s = np.arange(max(since_s, arrived_s[0]), arrived_s[-1], _LOOK_EVERY_S)
    newest = np.searchsorted(arrived_s, looked_s, "right") - 1
    return list(1000 * (looked_s - zero_s - time_s[newest]))


def _started(server: Server, camera: NumberedCamera) -> str:
    body = {
        "name": "Measured", "source": {"kind": "live", "url": camera.url},
        "rig": SAMPLE.rig.model_dump(mode="json"), "header": {},
    }  # fmt: skip
    return str(ask_json(server, "POST", "/api/inspections", body)["id"])


def _dropped(server: Server, inspection_id: str) -> int:
    return int(ask_json(server, "GET", f"/api/inspections/{inspection_id}")["live"]["dropped"])


def _ended(server: Server, inspection_id: str) -> tuple[int, int]:
    """Finish it; return frames of the recording and rows of the track."""
    path = f"/api/inspections/{inspection_id}"
    server.ask("POST", f"{path}/finish", {"end_condition": "complete"}).close()
    while ask_json(server, "GET", path)["status"] == "running":
        time.sleep(0.1)
    with server.ask("GET", f"{path}/video") as answer:
        recording = io.BytesIO(answer.read())
    with av.open(recording) as container:
        frames = sum(packet.size > 0 for packet in container.demux(video=0))
    with server.ask("GET", f"{path}/track?format=json&raw=true") as answer:
        columns = json.load(answer)["columns"]
    return frames, len(columns["frame"])


def holding(loads: Sequence[str], seconds: float) -> Iterator[tuple[str, Held]]:
    """Apply each load to one server; yield the figures."""
    pictures = drive()
    with server_and_page() as (server, page):
        for name in loads:
            load = LOADS[name]
            with ExitStack() as stack:
                spawn = multiprocessing.get_context("spawn")
                pool = stack.enter_context(ProcessPoolExecutor(1, spawn))
                seen = pictures[:: RATE_HZ // load.rate_hz]
                cameras = [
                    stack.enter_context(NumberedCamera(seen, load.rate_hz))
                    for _ in range(load.cameras)
                ]
                held = measure(page, server, load, cameras, pool, seconds)
            yield name, held
