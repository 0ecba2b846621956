"""Two runs of the same culvert side by side."""

from __future__ import annotations

import json
import re
import uuid
from collections.abc import Iterator, Mapping

import cv2
import numpy as np
import pytest
from clip_surveys import SHORT_FRAMES, ids_of
from looks import expect_no_fault
from playwright.sync_api import Page, expect
from steps import Server, log_in
from surveys import Survey

from vo_core import Rig
from vo_core.mosaic.layout import Layout

# The number that the blocks of a shown picture spell.
DRAWN = """(side) => {
  const canvas = document.querySelectorAll('.compare__stage canvas')[side];
  const { data } = canvas.getContext('2d').getImageData(0, 8, 256, 1);
  let drawn = 0;
  for (let bit = 0; bit < 16; bit += 1) if (data[4 * (16 * bit + 8)] > 128) drawn |= 1 << bit;
  return drawn;
}"""

# The grey of points of the walls, without the edge, and whether it varies, as that of a wall does.
MIDDLE_OF_THE_WALLS = """() => {
  const canvas = document.querySelector('wall-register canvas');
  const [x, y, wide] = [0.2 * canvas.width, 0.3 * canvas.height, 0.6 * canvas.width];
  const { data } = canvas.getContext('2d').getImageData(x, y, wide, 1);
  return JSON.stringify(Array.from({ length: data.length / 4 }, (_, i) => data[4 * i]));
}"""
SHOWS_A_WALL = f"() => new Set(JSON.parse(({MIDDLE_OF_THE_WALLS})())).size > 20"
LIKE = 0.8
"""Correlation of one wall that was painted twice; of two walls it is about 0."""


@pytest.fixture
def server(several: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(several.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture
def runs(server: Server) -> tuple[str, str]:
    """The later one is called so, and has a crack that has grown; a test may paint their walls."""
    a, b, other = ids_of(server)
    server.ask("DELETE", f"/api/inspections/{other}")
    server.ask("PATCH", f"/api/inspections/{b}", {"name": "later"})
    _tag(server, a, {"frame": 6, "code": "BAB", "severity": 2})
    _tag(server, b, {"frame": 8, "code": "BAB", "severity": 4})
    _tag(server, a, {"frame": 10, "code": "BBA", "severity": 2})
    _tag(server, b, {"frame": 10, "code": "BBA", "severity": 2})
    _tag(server, b, {"frame": 11, "code": "BBF", "severity": 1})
    return a, b


def test_two_runs_are_chosen_matched_and_driven_along_side_by_side(
    page: Page, server: Server, runs: tuple[str, str]
) -> None:
    a, b = runs
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    log_in(page, server, f"/compare?a={a}")
    run_b, search = page.get_by_label("Run B"), page.get_by_label("Find inspections")
    expect(run_b.locator("option")).to_have_count(3)
    search.fill("nothing has this name")
    expect(run_b.locator("option")).to_have_count(2)  # the chosen run stays
    search.fill("later")
    expect(run_b.locator("option")).to_have_count(3)
    assert not [url for url in asked if url.endswith("/api/inspections")], "the whole list"
    run_b.select_option(b)
    page.wait_for_url(f"**/compare?a={a}&b={b}")

    # Defects are matched, and what has grown is shown.
    rows = page.locator(".pair")
    expect(rows).to_have_count(3)
    expect(rows.nth(0)).to_contain_text("BAB")
    expect(rows.nth(0)).to_contain_text("severity 2 to 4")
    expect(rows.nth(1)).to_contain_text("Unchanged")
    expect(rows.nth(2)).to_contain_text("New")
    expect_no_fault(page)
    for width in (360, 1440):
        page.set_viewport_size({"width": width, "height": 800})
        page.wait_for_function("width => document.documentElement.scrollWidth <= width", arg=width)
    page.get_by_role("button", name="Grown 1").click()
    expect(rows).to_have_count(1)

    # Both pictures go where the defect was tagged, and along the culvert by keys.
    page.locator(".pair__main").first.click()
    _expect_frames(page, 6, 8)
    page.keyboard.press("Home")
    _expect_frames(page, 0, 0)
    for _ in range(2):
        page.keyboard.press("ArrowRight")
    expect(page.locator(".compare__place")).to_have_text("0.02 m")
    _expect_frames(page, *(_frame_at(server, run, 20.0) for run in runs))

    # A run from the other end is turned round.
    page.get_by_label("B was driven from the other end").check()
    page.get_by_label("Length of the culvert").fill("0.1")
    page.keyboard.press("Enter")
    page.get_by_label("Length of the culvert").blur()
    page.keyboard.press("Home")
    expect(page.locator(".compare__run").nth(1)).to_contain_text(f"frame {SHORT_FRAMES - 1}")


def test_the_walls_of_two_runs_lie_one_over_the_other(
    page: Page, server: Server, runs: tuple[str, str]
) -> None:
    for run, shift_mm in zip(runs, (0.0, 40.0), strict=True):
        _paint(server, run, shift_mm)
    a, b = runs
    log_in(page, server, f"/compare?a={a}&b={b}")
    page.get_by_role("button", name="Bring the walls into register").click()
    expect(page.get_by_text("Aligned by what both walls show.")).to_be_visible()
    walls = page.locator("wall-register")
    edge = walls.get_by_role("slider", name="Edge between the runs")
    edge.focus()
    page.keyboard.press("Home")
    page.wait_for_function(SHOWS_A_WALL)
    earlier = page.evaluate(MIDDLE_OF_THE_WALLS)
    page.keyboard.press("End")
    page.wait_for_function(f"before => ({MIDDLE_OF_THE_WALLS})() !== before", arg=earlier)
    # In register they look alike, though the later one begins elsewhere.
    later = page.evaluate(MIDDLE_OF_THE_WALLS)
    assert np.corrcoef(json.loads(earlier), json.loads(later))[0, 1] > LIKE
    walls.get_by_role("button", name="Blink").click()
    expect(walls.get_by_role("button", name="Blink")).to_have_attribute("aria-pressed", "true")
    expect_no_fault(page, within="wall-comparison")


def _paint(server: Server, inspection: str, shift_mm: float) -> None:
    """Give an inspection a wall of its own, as if it had been driven for a metre."""
    folder = server.data / "inspections" / inspection
    layout = Layout.of(Rig.parse(json.loads((folder / "rig.json").read_text())))
    noise = np.random.default_rng(1).standard_normal((layout.height_px, 5 * layout.width_px))
    sigma = 3.0 / layout.mm_per_px
    grey = np.clip(118 + 60 * sigma * cv2.GaussianBlur(noise, (0, 0), sigma), 50, 255)
    first = round(shift_mm / layout.mm_per_px)
    (folder / "wall").mkdir(exist_ok=True)
    for index in range(-1, 3):
        tile = grey[:, first + (index + 1) * layout.width_px :][:, : layout.width_px]
        cv2.imwrite(str(folder / "wall" / f"{index}.jpg"), tile.astype(np.uint8))


def _expect_frames(page: Page, a: int, b: int) -> None:
    """Stated, and drawn."""
    for side, frame in enumerate((a, b)):
        caption = page.locator(".compare__frame").nth(side)
        expect(caption).to_have_text(re.compile(rf"^frame {frame} "))
        assert page.evaluate(DRAWN, side) == frame


def _frame_at(server: Server, inspection: str, distance_mm: float) -> int:
    track = json.load(server.ask("GET", f"/api/inspections/{inspection}/track?format=json"))
    distances: list[float] = track["columns"]["distance_mm"]
    return min(range(len(distances)), key=lambda frame: abs(distances[frame] - distance_mm))


def _tag(server: Server, inspection: str, fields: Mapping[str, object]) -> None:
    path = f"/api/inspections/{inspection}/observations/{uuid.uuid4()}"
    json.load(server.ask("PUT", path, fields))
