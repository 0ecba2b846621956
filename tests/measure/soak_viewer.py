"""An hour of 3D view with two viewers, sped up: does its memory stay flat?  Run by hand.

    python tests/measure soak_viewer [--updates 108000] [--speed 10]

A robot drives 100 m and back with 30 updates a second: pose, path, preview picture, wall pictures
that grow and are replaced, defects that come, change and go, selections, changes of camera.  All
periods of the scene are shortened by `--speed`, so that as much is drawn as in real time.  The two
viewers are processes of their own.  Ends with 1 if memory or scene go on growing.
"""

# ruff: noqa: T201

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

from viewer_client import Client, make_estimate, make_rig, messages_kept, serving
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

import app.viewer.drawing
import app.viewer.scene
import app.viewer.wall
from app.viewer.scene import CulvertScene, Pin, WallLayout, WallPictures, WallTile

RATE_HZ = 30
LENGTH_M = 100.0
TILE_M = 0.5
LAYOUT = WallLayout(-0.47, 0.47, 500, 940)
PICTURE_BYTES = 60_000
ROWS = 20
LATE_JOINERS = 40
"""Clients that join first: each gets the whole scene in one piece, and the allocator keeps that
memory."""
MAX_GROWTH_MB = 10.0
MAX_GROWTH_MESSAGES = 4 * 40 + 120
"""Allowed growth: memory was seen to vary by 5 MB on a busy machine; the path back needs 40 more
chunks; the number of pins and labels varies."""


def watch(port: int) -> None:
    """Be a viewer until the server stops."""
    with connect(
        f"ws://127.0.0.1:{port}/viewer/x",
        subprotocols=["viser-v1.1.1"],  # type: ignore[list-item]
        max_size=None,
        compression=None,
    ) as ws:
        client = Client(ws)
        client.replay()
        client.send_camera()
        try:
            while True:
                ws.recv()
        except ConnectionClosed:
            return


class Drive:
    """The calls of the services to the scene, update by update."""

    def __init__(self, scene: CulvertScene, updates: int) -> None:
        self._scene = scene
        self._updates = updates
        self._revisions: dict[int, int] = {}
        self._pins: dict[str, Pin] = {}

    def update(self, n: int) -> None:
        way = 2 * n / self._updates
        x_m = LENGTH_M * (way if way <= 1 else 2 - way)
        status = "lost" if n % 900 > 870 else "weak" if n % 300 > 280 else "ok"
        self._scene.extend_path([1000 * x_m], [5.0 * (n % 100) / 100], [1.0 + n % 7])
        self._scene.show(pose=make_estimate(1000 * x_m, status=status))
        if n % 2 == 0:
            self._scene.show(preview=os.urandom(20_000))
        if n % RATE_HZ == 0:
            self._show_wall(x_m)
        if n % (4 * RATE_HZ) == 0:
            self._tag(n, x_m)
        if n % (60 * RATE_HZ) == 0:
            self._scene.show(mode=("follow", "overview", "inside")[n // (60 * RATE_HZ) % 3])

    def _show_wall(self, x_m: float) -> None:
        here = int(min(x_m, LENGTH_M - 0.01) / TILE_M)
        self._revisions[here] = self._revisions.get(here, 0) + 1
        tiles = [
            WallTile(index, revision, TILE_M * index, TILE_M * (index + 1))
            for index, revision in self._revisions.items()
        ]
        self._scene.show(wall=WallPictures(tiles, LAYOUT, lambda _: os.urandom(PICTURE_BYTES)))

    def _tag(self, n: int, x_m: float) -> None:
        """Add a defect each time; of more than 60 the oldest is deleted."""
        finish_m = x_m + 0.7 if n % 480 == 0 else None
        self._pins[f"uuid-{n}"] = Pin(
            f"uuid-{n}", x_m, n % 12 + 1, 0.01, n // 120 % 6, "BAB C", finish_m=finish_m
        )
        if len(self._pins) > 60:
            del self._pins[next(iter(self._pins))]
        self._scene.show(pins=list(self._pins.values()))
        self._scene.show(selected=f"uuid-{n}" if n % 240 else None)


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def soak(updates: int, speed: float) -> bool:
    """Return whether nothing keeps growing."""
    app.viewer.scene._TICK_S /= speed
    app.viewer.drawing._PREVIEW_PERIOD_S /= speed
    app.viewer.drawing._PREVIEW_BYTES_PER_S = round(app.viewer.drawing._PREVIEW_BYTES_PER_S * speed)
    app.viewer.wall._PERIOD_S /= speed
    with tempfile.TemporaryDirectory() as folder:
        scene = CulvertScene(make_rig(), Path(folder) / "a.sock")
        with ExitStack() as ending:
            served = ending.enter_context(serving(scene))
            ending.callback(scene.close)
            viewers = [
                subprocess.Popen(
                    [
                        sys.executable,
                        str(Path(__file__).parent),
                        "soak_viewer",
                        "--watch",
                        str(served.port),
                    ]
                )
                for _ in range(2)
            ]
            verdict = drive(scene, updates, speed, viewers)
        for viewer in viewers:
            viewer.wait(10)
        return verdict


def drive(
    scene: CulvertScene, updates: int, speed: float, viewers: list[subprocess.Popen[bytes]]
) -> bool:
    robot, rows = Drive(scene, updates), []
    for n in range(updates // ROWS):
        robot.update(n)
    for _ in range(LATE_JOINERS):
        messages_kept(scene)
    start, cpu = time.monotonic(), time.process_time()
    print(" updates   seconds    RSS MB  messages    CPU %")
    for n in range(updates + 1):
        time.sleep(max(0.0, start + n / RATE_HZ / speed - time.monotonic()))
        robot.update(n)
        if n % (updates // ROWS) == 0:
            kept, seconds = messages_kept(scene), time.monotonic() - start
            rows.append((resident_mb(), kept))
            load = 100 * (time.process_time() - cpu) / max(seconds, 1e-9)
            print(f"{n:8}  {seconds:8.0f}  {rows[-1][0]:8.1f}  {kept:8}  {load:7.1f}", flush=True)
            if not scene.is_open:
                print("The scene has died.")
                return False
            if any(viewer.poll() is not None for viewer in viewers):
                print("A viewer has gone.")
                return False
    # Peaks are messages being sent; a leak would raise the minimum below them.
    quarter = len(rows) // 4
    floors_mb = [
        min(mb for mb, _ in part) for part in (rows[quarter : -2 * quarter], rows[-quarter:])
    ]
    grown_mb, grown = floors_mb[1] - floors_mb[0], rows[-1][1] - rows[len(rows) // 2][1]
    is_flat = grown_mb <= MAX_GROWTH_MB and grown <= MAX_GROWTH_MESSAGES
    print(
        f"{'Flat' if is_flat else 'IT GROWS'}: {grown_mb:+.1f} MB from the second to the last "
        f"quarter, {grown:+} messages in the second half; allowed are {MAX_GROWTH_MB:+.1f} MB and "
        f"{MAX_GROWTH_MESSAGES:+}."
    )
    return is_flat


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--updates", type=int, default=108_000)
    parser.add_argument("--speed", type=float, default=10.0)
    parser.add_argument("--watch", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.watch:
        watch(arguments.watch)
    else:
        sys.exit(0 if soak(arguments.updates, arguments.speed) else 1)
