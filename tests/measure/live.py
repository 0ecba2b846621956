"""How old the live picture is when it is on screen, measured in a real Chromium; not a test.

    python tests/measure live [--seconds 20] [--runs 3]

A rendered culvert with the number of the frame as blocks in its first rows is served as an MJPEG
camera at 30 frames a second, the server records and tracks it, the page shows it.  At each
animation frame, after everything has been drawn, the page reads the number off its own canvas.
Camera, server and browser have one clock, so that the number identifies the time of the camera's
picture.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from builders import BLOCK, blocks
from cameras import MjpegCamera
from numpy.typing import NDArray
from playwright.sync_api import Page
from steps import Server, log_in

from app.lab.simulation.render import render
from app.lab.simulation.sample import SAMPLE
from measure.chromium import chromium

RATE_HZ = 30
LEG_MM = 1500.0
SPEED_MM_S = 120.0
WARM_UP_S = 12.0
CHECKED = 40
"""Number of frames compared with the recording."""

# What is about to be presented: size observers run after all animation callbacks of a frame.
WATCH = """(seconds) => import('/static/core/wall/units.js')
  .then((units) => new Promise((resolve) => {
  const canvas = document.querySelector('.stage__picture');
  const { desk } = document.querySelector('inspection-page');
  const probe = document.createElement('div');
  document.body.append(probe);
  const samples = [];
  const tasks = [];
  const longTasks = new PerformanceObserver((list) => {
    for (const { startTime, duration } of list.getEntries()) tasks.push([startTime, duration]);
  });
  longTasks.observe({ type: 'longtask' });
  const end = performance.now() + 1000 * seconds;
  const read = () => {
    const { data } = canvas.getContext('2d').getImageData(0, 8, 256, 1);
    let drawn = 0;
    for (let bit = 0; bit < 16; bit += 1) if (data[4 * (16 * bit + 8)] > 128) drawn |= 1 << bit;
    const { row } = desk.playhead.value;
    const now = () => document.querySelector('.strip__track').ariaValueNow;
    const text = (selector) => document.querySelector(selector).textContent;
    const isOne = text('.transport__frame').endsWith(` ${row.frame}`)
      && text('.readout__distance span') === units.chainageNumber(row.distance_mm / 1000)
      && now() === (row.distance_mm / 1000).toFixed(2);
    samples.push([performance.timeOrigin + performance.now(), drawn, row.frame, isOne]);
  };
  const observer = new ResizeObserver(read);
  observer.observe(probe);
  const tick = () => {
    probe.style.width = probe.style.width === '1px' ? '2px' : '1px';
    if (performance.now() < end) requestAnimationFrame(tick);
    else {
      [observer, longTasks].forEach((each) => each.disconnect());
      resolve({ samples, tasks });
    }
  };
  requestAnimationFrame(tick);
}))"""

INTERACTIVE = """() => new Promise((resolve) => {
  const look = () => {
    const tag = document.querySelector('.quick__code--plain');
    if (tag && document.querySelector('distance-readout .readout__health')?.textContent) {
      requestAnimationFrame(() => resolve(performance.now()));
    } else requestAnimationFrame(look);
  };
  look();
})"""


class NumberedCamera(MjpegCamera):
    """Drives back and forth in a rendered culvert and knows when it sent each number."""

    def __init__(self, pictures: Sequence[NDArray[np.uint8]], rate_hz: float = RATE_HZ) -> None:
        self.sent_ms: dict[int, float] = {}
        self._pictures = pictures
        height, width = pictures[0].shape
        super().__init__(rate_hz=rate_hz, size_wh=(width, height), picture=self._numbered)

    def _numbered(self, number: int) -> NDArray[np.uint8]:
        self.sent_ms[number] = 1000 * time.time()
        turn = len(self._pictures) - 1
        place = number % (2 * turn)
        picture = self._pictures[place if place < turn else 2 * turn - place].copy()
        picture[:BLOCK, :256] = blocks(number)
        return picture


@dataclass(frozen=True)
class Measured:
    """The figures of one run; times in ms."""

    first_shown: list[float]
    """Age of each picture when it is first on screen."""
    on_screen: list[float]
    """Age of the picture on screen, at each animation frame."""
    gaps: list[float]
    """Time between two pictures on screen."""
    long_tasks: list[float]
    mixed: int
    """Animation frames in which picture, number, pose or read-out came from different frames."""
    interactive: float
    tracked_hz: float
    load: float


def drive() -> list[NDArray[np.uint8]]:
    scenario = replace(
        SAMPLE, name="measure", length_mm=LEG_MM, legs=(1.0,), rest_s=0.0, speed_mm_s=SPEED_MM_S,
        frames_per_s=RATE_HZ, defects=(),
    )  # fmt: skip
    return [frame.image for frame in render(scenario)]


def measure(page: Page, server: Server, camera: NumberedCamera, seconds: float) -> Measured:
    body = {
        "name": "Measured", "source": {"kind": "live", "url": camera.url},
        "rig": SAMPLE.rig.model_dump(mode="json"), "header": {},
    }  # fmt: skip
    made = ask_json(server, "POST", "/api/inspections", body)
    path = f"/api/inspections/{made['id']}"
    page.goto(f"{server.url}/inspections/{made['id']}")
    interactive = page.evaluate(INTERACTIVE)
    page.wait_for_function(
        "() => document.querySelector('inspection-page').desk?.playhead.value.row"
    )
    time.sleep(WARM_UP_S)
    before, begun = ask_json(server, "GET", path), time.monotonic()
    seen: dict[str, Any] = page.evaluate(WATCH, seconds)
    after, load = ask_json(server, "GET", path), os.getloadavg()[0]
    tracked_hz = _tracked(after) - _tracked(before)
    tracked_hz /= time.monotonic() - begun
    server.ask("POST", f"{path}/finish", {"end_condition": "complete"}).close()
    samples = seen["samples"]
    shown_ms = {}
    for at_ms, number, _, _ in samples:
        shown_ms.setdefault(number, at_ms)
    checked = {frame for _, _, frame, _ in samples[:: len(samples) // CHECKED]}
    recorded = _numbers_of_frames(server, path, checked)
    return Measured(
        [at_ms - camera.sent_ms[number] for number, at_ms in shown_ms.items()],
        [at_ms - camera.sent_ms[number] for at_ms, number, _, _ in samples],
        [later - earlier for earlier, later in pairwise(sorted(shown_ms.values()))],
        [duration for _, duration in seen["tasks"]],
        sum(
            not is_one or recorded.get(frame, number) != number
            for _, number, frame, is_one in samples
        ),
        interactive,
        tracked_hz,
        load,
    )


def _numbers_of_frames(server: Server, path: str, frames: set[int]) -> dict[int, int]:
    """Return the numbers shown by some frames of the recording."""
    found = {}
    for frame in frames:
        with server.ask("GET", f"{path}/frames/{frame}.jpg") as answer:
            picture = cv2.imdecode(np.frombuffer(answer.read(), np.uint8), cv2.IMREAD_GRAYSCALE)
        row = picture[BLOCK // 2, BLOCK // 2 : 256 : BLOCK]
        found[frame] = sum(1 << i for i, grey in enumerate(row) if grey > 127)
    return found


def _tracked(inspection: dict[str, Any]) -> int:
    return int(inspection["progress"]["frames_done"]) - int(inspection["live"]["dropped"])


def ask_json(server: Server, method: str, path: str, body: object = None) -> dict[str, Any]:
    with server.ask(method, path, body) as answer:
        return dict(json.load(answer))


def percentile(values: Sequence[float], percent: float) -> float:
    return float(np.percentile(values, percent))


COLUMNS: tuple[tuple[str, Callable[[Measured], str]], ...] = (
    ("first shown p50", lambda m: f"{percentile(m.first_shown, 50):.0f}"),
    ("p95", lambda m: f"{percentile(m.first_shown, 95):.0f}"),
    ("on screen p50", lambda m: f"{percentile(m.on_screen, 50):.0f}"),
    ("p95", lambda m: f"{percentile(m.on_screen, 95):.0f}"),
    ("pictures/s", lambda m: f"{1000 / statistics.mean(m.gaps):.1f}"),
    ("tracked/s", lambda m: f"{m.tracked_hz:.1f}"),
    ("tasks > 100", lambda m: str(sum(ms > 100 for ms in m.long_tasks))),
    ("longest", lambda m: f"{max(m.long_tasks, default=0):.0f}"),
    ("mixed", lambda m: str(m.mixed)),
    ("interactive", lambda m: f"{m.interactive:.0f}"),
    ("load", lambda m: f"{m.load:.1f}"),
)


@contextmanager
def server_and_page() -> Iterator[tuple[Server, Page]]:
    """Run a server that may open cameras of this machine, and a page that is logged in."""
    with (
        tempfile.TemporaryDirectory() as folder,
        Server(Path(folder), camera_networks="127.0.0.0/8") as server,
        chromium() as browser,
    ):
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        log_in(page, server)
        yield server, page


def print_line(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    arguments.add_argument("--seconds", type=float, default=20)
    arguments.add_argument("--runs", type=int, default=3)
    chosen = arguments.parse_args()
    pictures = drive()
    print_line("  ".join(name for name, _ in COLUMNS) + "  (ms)")
    with server_and_page() as (server, page):
        for _ in range(chosen.runs):
            with NumberedCamera(pictures) as camera:
                found = measure(page, server, camera, chosen.seconds)
            cells = [value(found).rjust(len(name)) for name, value in COLUMNS]
            print_line("  ".join(cells))


if __name__ == "__main__":
    main()
