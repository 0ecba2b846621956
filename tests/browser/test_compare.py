"""Two runs of the same culvert side by side."""

from __future__ import annotations

import json
import re
import uuid
from collections.abc import Iterator, Mapping

import pytest
from clip_surveys import SHORT_FRAMES, ids_of
from looks import expect_no_fault
from playwright.sync_api import Page, expect
from steps import Server, log_in
from surveys import Survey

# The number that the blocks of a shown picture spell.
DRAWN = """(side) => {
  const canvas = document.querySelectorAll('.compare__stage canvas')[side];
  const { data } = canvas.getContext('2d').getImageData(0, 8, 256, 1);
  let drawn = 0;
  for (let bit = 0; bit < 16; bit += 1) if (data[4 * (16 * bit + 8)] > 128) drawn |= 1 << bit;
  return drawn;
}"""


@pytest.fixture(scope="module")
def server(several: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(several.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def runs(server: Server) -> tuple[str, str]:
    """The later one is called so, and has a crack that has grown."""
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
