"""What the scripts that watch a live camera share: a camera that numbers its pictures, and a page.

A rendered culvert with the number of the frame as blocks in its first rows is served as an MJPEG
camera.  At each animation frame, after everything has been drawn, the page reads the number off its
own canvas.  Camera, server and browser have one clock, so that the number identifies the time of
the camera's picture.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

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


def drive() -> list[NDArray[np.uint8]]:
    scenario = replace(
        SAMPLE, name="measure", length_mm=LEG_MM, legs=(1.0,), rest_s=0.0, speed_mm_s=SPEED_MM_S,
        frames_per_s=RATE_HZ, defects=(),
    )  # fmt: skip
    return [frame.image for frame in render(scenario)]


def ask_json(server: Server, method: str, path: str, body: object = None) -> dict[str, Any]:
    with server.ask(method, path, body) as answer:
        return dict(json.load(answer))


def percentile(values: Sequence[float], percent: float) -> float:
    return float(np.percentile(values, percent))


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
