"""Measures the map of assets: the answer of the server, and the frames of the page; not a test.

    python tests/measure map [--assets 10000] [--inspections 3]

Stores assets at random places of which half are registered, with so many inspections each, and
opens the map in a headless Chromium. Prints size and time of the answer, and for zooming and
dragging the time between frames and the time of painting one.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from mapped_assets import MADE_AT, Inspected, Registered, inspection_row, registered_row
from playwright.sync_api import Page
from sqlalchemy import insert
from steps import Server, log_in

from app.storage.database.database import Database
from app.storage.database.tables import IndexedInspection, Inspection, RegisteredAsset
from app.storage.index.defect_index import INDEX_VERSION
from app.survey.folding import folded, normalised_id
from measure.chromium import chromium

FRAMES = 120
ROUNDS = 5
MOVE = """async ([kind, frames]) => {
  const map = document.querySelector('map-canvas');
  const sheet = map.querySelector('.map__sheet');
  const { left, top } = sheet.getBoundingClientRect();
  const at = (x, y) => ({ clientX: left + x, clientY: top + y, bubbles: true, cancelable: true });
  const pointer = (type, x, y) => sheet.dispatchEvent(
    new PointerEvent(type, { ...at(x, y), pointerId: 7, button: 0, buttons: 1 }));
  sheet.setPointerCapture = () => {};  // no such pointer exists
  const next = () => new Promise((resolve) => requestAnimationFrame(resolve));
  const [between, painting] = [[], []];
  if (kind === 'drag') pointer('pointerdown', 300, 300);
  await next();
  let last = performance.now();
  for (let i = 0; i < frames; i += 1) {
    const deltaY = i < frames / 2 ? -40 : 40;
    if (kind === 'drag') pointer('pointermove', 300 + 3 * (i % 60), 300 + i);
    else sheet.dispatchEvent(new WheelEvent('wheel', { ...at(300, 200), deltaY }));
    await next();
    const now = performance.now();
    between.push(now - last);
    painting.push(map.paintMs);
    last = now;
  }
  if (kind === 'drag') pointer('pointerup', 300, 300);
  return [between, painting];
}"""
"""Zooms by the wheel, in and out again, or drags, a step before each frame."""


def write(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def fill(database: Database, assets: int, inspections: int) -> None:
    """Store assets and their inspections, indexed already."""
    chance = np.random.default_rng(16)
    registered, inspected, indexed = [], [], []
    for number in range(assets):
        name, project = f"CUL-{number:05d}", f"Road {number % 20}"
        lon, lat = (float(part) for part in chance.uniform((101, 3), (103, 5)))
        if number % 2 == 0:
            line = [[lon, lat], [lon + 0.0003, lat + 0.0002]]
            registered.append(registered_row(Registered(name, line, project)))
        for year in range(inspections):
            survey = Inspected(name, f"{2020 + year}-01-01", (), project)
            inspected.append(inspection_row(len(inspected), survey))
            indexed.append(
                {
                    "inspection_id": inspected[-1]["id"], "index_version": INDEX_VERSION,
                    "revision": 0, "finished_at": MADE_AT, "newest_event": None, "name": name,
                    "project": project, "asset": name, "asset_normalised_id": normalised_id(name),
                    "surveyed_on": date(2020 + year, 1, 1), "folded": folded(name, project),
                    "start_lat": lat, "start_lon": lon, "end_lat": lat + 0.0002,
                    "end_lon": lon + 0.0003, "distance_m": 30.0, "distance_u95_m": 0.1,
                    "defects": 3, "worst_severity": int(chance.integers(6)),
                }
            )  # fmt: skip

    def store(session: Any) -> None:
        session.execute(insert(RegisteredAsset), registered)
        session.execute(insert(Inspection), inspected)
        session.execute(insert(IndexedInspection), indexed)

    database.write(store)


def write_answer(server: Server) -> None:
    """Print size and time of the answer."""
    times_ms = []
    for _ in range(ROUNDS):
        began_s = time.perf_counter()
        content = server.ask("GET", "/api/map").read()
        times_ms.append(1000 * (time.perf_counter() - began_s))
    shown = len(json.loads(content)["assets"])
    write(f"{shown} assets: {len(content) / 1e6:.2f} MB in {np.median(times_ms):.0f} ms (median)")


def write_frames(page: Page) -> None:
    """Print the times of frames."""
    write("\n| ms | median | 95 % | largest |\n|---|---|---|---|")
    for kind in ("zoom", "drag"):
        for what, times_ms in zip(
            ("between frames", "painting"), page.evaluate(MOVE, [kind, FRAMES]), strict=True
        ):
            figures = np.percentile(times_ms, (50, 95, 100))
            write(f"| {kind}, {what} | " + " | ".join(f"{ms:.1f}" for ms in figures) + " |")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--assets", type=int, default=10_000)
    parser.add_argument("--inspections", type=int, default=3, help="of each asset")
    stated = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        database = Database(Path(folder) / "chainage.db")
        fill(database, stated.assets, stated.inspections)
        database.close()
        with Server(Path(folder)) as server, chromium() as browser:
            write_answer(server)
            page = browser.new_page(viewport={"width": 1440, "height": 900})
            log_in(page, server, "/assets/map")
            page.wait_for_selector(".map-list__row")
            write_frames(page)


if __name__ == "__main__":
    main()
