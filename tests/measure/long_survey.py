"""Measures how server and page perform with a long survey: many defects, many frames; not a test.

    python tests/measure long_survey [20x2000 2000x600 ...] [--only server page] [--write]

Each size is defects x frames.  The server is a process of its own over a data folder that
`long_survey` has filled; the page is a real Chromium that shows the film and the 3D view, which
software draws on the same cores.  `--write` puts the table into docs/long_survey.md.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import tempfile
import time
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page
from steps import Server, log_in

from app.lab.markdown_figures import write_figures
from measure.chromium import chromium
from measure.live import INTERACTIVE, print_line
from measure.load import descendants
from measure.long_films import add_long_survey

SIZES = ((20, 2_000), (2_000, 600), (2_000, 2_000), (2_000, 200_000))
PLAYED_S = 8
TAGS = 15
SEEKS = 8
TAG_EVERY_S = 5.0
"""Nobody tags faster; until then the 3D view, where software draws it, shows the tag before."""
QUIET_S = 4.0
PATIENCE_S = 600
_TABLE = Path(__file__).parents[2] / "docs" / "long_survey.md"

Figures = dict[str, float]


@dataclass(frozen=True)
class Budget:
    """Limit of a figure; None where only its growth with the film is limited."""

    name: str
    limit: float | None


BUDGETS = (
    Budget("checks, ms", 300),
    Budget("CSV export, ms", 2_000),
    Budget("list of observations, ms", 200),
    Budget("first tag, ms", 40),
    Budget("last tag, ms", 50),
    Budget("last tag, page with 3D view open, ms", 50),
    Budget("server memory, MB", None),
    Budget("first paint, cold, ms", 1_000),
    Budget("usable, cold, ms", None),
    Budget("requests, cold", 60),
    Budget("opening, warm, ms", None),
    Budget("seeking, ms", None),
    Budget("tagging on the page, ms", None),
    Budget(f"long tasks in {PLAYED_S} s of playing, ms", 500),
    Budget("page memory, MB", None),
)
GROWTH = 2.0
GROWING = (
    "CSV export, ms", "last tag, ms", "opening, warm, ms", "seeking, ms",
    "tagging on the page, ms",
)  # fmt: skip
"""Allowed factor from a hundredth of the frames to all of them."""

LONG_TASKS = """(seconds) => new Promise((resolve) => {
  const { desk } = document.querySelector('inspection-page');
  const tasks = [];
  const observer = new PerformanceObserver((list) => {
    for (const { duration } of list.getEntries()) tasks.push(duration);
  });
  observer.observe({ type: 'longtask' });
  const begun = desk.playhead.value.frame;
  document.querySelector('video-panel').togglePlay();
  setTimeout(() => {
    document.querySelector('video-panel').togglePlay();
    observer.disconnect();
    resolve({ tasks, frames: desk.playhead.value.frame - begun });
  }, 1000 * seconds);
})"""

SHOWN = """() => new Promise((resolve) => {
  const look = () => {
    const desk = document.querySelector('inspection-page')?.desk;
    const isOpen = desk?.playhead.value.row && desk.track.length && desk.observations.value.length;
    if (isOpen) requestAnimationFrame(() => resolve(performance.now()));
    else requestAnimationFrame(look);
  };
  look();
})"""

SEEK = """(frame) => new Promise((resolve) => {
  const { desk } = document.querySelector('inspection-page');
  const begun = performance.now();
  desk.seek(frame);
  const look = () => {
    if (desk.playhead.value.frame === frame) resolve(performance.now() - begun);
    else requestAnimationFrame(look);
  };
  look();
})"""

TAG = """() => new Promise((resolve) => {
  const { desk } = document.querySelector('inspection-page');
  const begun = performance.now();
  const { id } = desk.tagCentre();
  const look = () => {
    if (desk.observations.find(id)?.save !== 'saved') return;
    desk.observations.removeEventListener('change', look);
    resolve(performance.now() - begun);
  };
  desk.observations.addEventListener('change', look);
  look();
})"""

REQUESTS = "() => performance.getEntriesByType('resource').length"


def ask_ms(server: Server, inspection_id: str, what: str, times: int = 3) -> float:
    """Return the median time of an answer; a tag is changed before each."""
    found = []
    for n in range(times):
        put_tag(server, inspection_id, n)
        found.append(timed_ms(lambda: read(server, f"/api/inspections/{inspection_id}/{what}")))
    return statistics.median(found)


def read(server: Server, path: str) -> bytes:
    with server.ask("GET", path, timeout_s=PATIENCE_S) as answer:
        return answer.read()


def timed_ms(act: Callable[[], object]) -> float:
    began_s = time.perf_counter()
    act()
    return 1000 * (time.perf_counter() - began_s)


def tag_ms(server: Server, inspection_id: str, frames: int, pause_s: float = 0.0) -> float:
    """Return the time of one more tag, with a pause before each."""

    put_tag(server, inspection_id, 0)
    found = []
    for n in range(TAGS):
        time.sleep(pause_s)
        frame = n * frames // TAGS
        found.append(timed_ms(lambda frame=frame: put_tag(server, inspection_id, frame)))
    return statistics.median(found)


def put_tag(server: Server, inspection_id: str, frame: int) -> None:
    body = {"frame": frame, "pixel": [300, 240], "code": "BBF", "char1": "B"}
    path = f"/api/inspections/{inspection_id}/observations/{uuid.uuid4()}"
    server.ask("PUT", path, body).close()


def rss_mb(server: Server) -> float:
    """Return the memory of the server with its children."""
    pids = [server.pid, *descendants(server.pid)]
    pages = (Path(f"/proc/{pid}/statm").read_text().split()[1] for pid in pids)
    return sum(map(int, pages)) * os.sysconf("SC_PAGE_SIZE") / 2**20


def measure_server(server: Server, full: str, empty: str, frames: int) -> Figures:
    """Measure the requests of programs; a survey of the same length without defects gets the first
    tag.
    """
    for inspection_id in (full, empty):  # read and adjusted once, as for every page
        read(server, f"/api/inspections/{inspection_id}/corrections")
    return {
        "checks, ms": ask_ms(server, full, "checks"),
        "CSV export, ms": ask_ms(server, full, "exports/csv"),
        "list of observations, ms": ask_ms(server, full, "observations"),
        "first tag, ms": tag_ms(server, empty, frames),
        "last tag, ms": tag_ms(server, full, frames),
        "server memory, MB": rss_mb(server),
    }


def measure_page(browser: Browser, server: Server, inspection_id: str, frames: int) -> Figures:
    """Measure what a person sees: first with a cold cache, then with cached files of the page."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    page.set_default_timeout(1000 * PATIENCE_S)
    address = f"{server.url}/inspections/{inspection_id}"
    requests: list[str] = []
    page.on("request", lambda request: requests.append(request.url))
    log_in(page, server, "/healthz")
    requests.clear()
    page.goto(address, wait_until="commit")
    usable = page.evaluate(INTERACTIVE)
    page.evaluate(SHOWN)
    found = {
        "first paint, cold, ms": page.evaluate(
            "performance.getEntriesByName('first-contentful-paint')[0].startTime"
        ),
        "usable, cold, ms": usable,
        # The 3D view is a page of its own, of viser, and the blob: addresses are pictures of ours.
        "requests, cold": sum(
            url.startswith(server.url) and "/viewer/" not in url for url in requests
        ),
    }
    settle(page)
    opened = []
    for _ in range(3):
        page.goto(address, wait_until="commit")
        opened.append(page.evaluate(SHOWN))
        settle(page)
    found["opening, warm, ms"] = statistics.median(opened)
    places = [frames * n // (SEEKS + 1) for n in range(1, SEEKS + 1)]
    found["seeking, ms"] = statistics.median(page.evaluate(SEEK, frame) for frame in places)
    page.evaluate(SEEK, frames // 4)
    played = page.evaluate(LONG_TASKS, PLAYED_S)
    found[f"long tasks in {PLAYED_S} s of playing, ms"] = sum(played["tasks"])
    settle(page)
    tagged = []
    for _ in range(5):
        tagged.append(page.evaluate(TAG))
        page.wait_for_timeout(1000 * TAG_EVERY_S)
    found["tagging on the page, ms"] = statistics.median(tagged)
    found["last tag, page with 3D view open, ms"] = tag_ms(
        server, inspection_id, frames, TAG_EVERY_S
    )
    found["page memory, MB"] = heap_mb(page)
    context.close()
    return found


def settle(page: Page) -> None:
    """Wait until the page sends no more requests; it never loads all of a long film."""
    before = -1
    while (now := page.evaluate(REQUESTS)) != before:
        before = now
        page.wait_for_timeout(1000 * QUIET_S)


def heap_mb(page: Page) -> float:
    """Return the memory of the page's script after a collection."""
    client = page.context.new_cdp_session(page)
    client.send("HeapProfiler.collectGarbage")
    used: dict[str, Any] = client.send("Runtime.getHeapUsage")
    return float(used["usedSize"]) / 2**20


def measure(browser: Browser, defects: int, frames: int, parts: Sequence[str]) -> Figures:
    """Measure one size, on its own server."""
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder)
        full = add_long_survey(data, defects, frames)
        empty = add_long_survey(data, 0, frames)
        found: Figures = {}
        with Server(data) as server:
            if "server" in parts:
                found |= measure_server(server, full, empty, frames)
            if "page" in parts:
                found |= measure_page(browser, server, full, frames)
        return found


def table(sizes: Sequence[tuple[int, int]], found: Sequence[Figures]) -> str:
    """Format the table in markdown: a row for each budget, a column for each size."""
    heads = ["", "budget", *(f"{defects:,} x {frames:,}" for defects, frames in sizes)]
    rows = [heads, ["---"] + ["---:"] * (len(heads) - 1)]
    for budget in BUDGETS:
        values = [figures.get(budget.name) for figures in found]
        if any(value is not None for value in values):
            limit = "" if budget.limit is None else f"{budget.limit:,.0f}"
            rows.append([budget.name, limit, *(_cell(value, budget.limit) for value in values)])
    for name in GROWING:
        ratio = _growth(name, sizes, found)
        if ratio is not None:
            head = f"{name.removesuffix(', ms')}, 200,000 frames over 2,000"
            rows.append([head, f"{GROWTH:.1f}", *[""] * (len(sizes) - 1), _cell(ratio, GROWTH, 1)])
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _growth(name: str, sizes: Sequence[tuple[int, int]], found: Sequence[Figures]) -> float | None:
    """Return the growth of a figure from 2,000 frames to 200,000, with the same defects."""
    by_size = dict(zip(sizes, found, strict=True))
    short, long = by_size.get((2_000, 2_000), {}), by_size.get((2_000, 200_000), {})
    return long[name] / short[name] if name in short and name in long else None


def _cell(value: float | None, limit: float | None, decimals: int = 0) -> str:
    if value is None:
        return ""
    text = f"{value:,.{decimals}f}"
    return f"**{text}**" if limit is not None and value > limit else text


def _size(text: str) -> tuple[int, int]:
    defects, _, frames = text.partition("x")
    return int(defects), int(frames)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    arguments.add_argument("sizes", nargs="*", type=_size, metavar="DEFECTSxFRAMES")
    arguments.add_argument("--only", nargs="+", choices=("server", "page"), metavar="PART")
    arguments.add_argument("--write", action="store_true", help="into docs/long_survey.md")
    chosen = arguments.parse_args()
    sizes, found = chosen.sizes or list(SIZES), []
    with chromium() as browser:
        for defects, frames in sizes:
            found.append(measure(browser, defects, frames, chosen.only or ("server", "page")))
            print_line(json.dumps({"defects": defects, "frames": frames} | found[-1]))
    text = table(sizes, found)
    print_line(text)
    print_line(
        f"Load of the machine at the end: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores."
    )
    if chosen.write:
        write_figures(_TABLE, "measured", "python tests/measure long_survey --write", text)


if __name__ == "__main__":
    main()
