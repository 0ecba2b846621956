"""Where things lie: nothing that is clicked moves under the hand, and every text can be read."""

from __future__ import annotations

import json

import pytest
from playwright.sync_api import Page, Route, ViewportSize, expect
from steps import Server, log_in

SIZES: tuple[ViewportSize, ...] = (
    {"width": 1366, "height": 768},
    {"width": 1024, "height": 768},
    {"width": 390, "height": 844},
)
CLICKED = (
    ".stage", ".transport button", ".transport__time", ".quick__code", ".strip__bar button",
    ".strip__track", ".wall__track", ".tabs__tab", ".viewer__cameras button", ".defect__main",
    ".desk-bar button", ".desk-bar summary",
)  # fmt: skip
PLACES = """(clicked) => clicked.flatMap((selector) =>
  [...document.querySelectorAll(selector)].filter((one) => one.checkVisibility()).map((one) => {
    const { x, y, width, height } = one.getBoundingClientRect();
    return [selector, x + scrollX, y + scrollY, width, height].join(' ');
  }))"""
NOTICES = """() => {
  const { desk } = document.querySelector('inspection-page');
  const { corrections, inspection } = desk;
  const params = { turned_deg: 2.5, tolerance_deg: 1, seen_deg: 2.5 };
  const notices = [{ code: 'looks_ahead', params }];
  corrections.set({ ...corrections.value, result: { ...corrections.value.result, notices } });
  const warning = 'The film ends early: the last 40 of its frames cannot be decoded.';
  inspection.set({ ...inspection.value, warning });
}"""
COVERED = """() => {
  const over = document.querySelector('.desk__notices').getBoundingClientRect();
  const head = document.querySelector('.viewer__head').getBoundingClientRect();
  return over.top < head.bottom;
}"""
CONTRAST = """(element) => {
  const light = (colour) => {
    const parts = colour.match(/[\\d.]+/g).slice(0, 3).map((part) => {
      const share = Number(part) / 255;
      return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2];
  };
  const { color, backgroundColor } = getComputedStyle(element);
  if (!backgroundColor.startsWith('rgb(')) return 0;
  const [less, more] = [light(color), light(backgroundColor)].toSorted((a, b) => a - b);
  return (more + 0.05) / (less + 0.05);
}"""


@pytest.fixture(scope="module")
def server(narrow_server: Server) -> Server:
    return narrow_server


@pytest.fixture(autouse=True)
def _tag(server: Server, inspection: str) -> None:
    tag = f"/api/inspections/{inspection}/observations/7d444840-9dc0-4d2a-8a6a-000000000001"
    server.ask("PUT", tag, {"frame": 0, "code": "BAC", "pixel": [160, 120]})


def test_nothing_that_is_clicked_moves_when_a_notice_comes_or_goes(
    page: Page, server: Server, inspection: str
) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    act_now = page.get_by_role("region", name="Act now")
    for size in SIZES:
        page.set_viewport_size(size)
        page.reload()
        page.locator(".defect__main").click()
        expect(page.locator(".chip")).to_contain_text("Done")
        page.wait_for_function("() => document.querySelector('inspection-page').desk.checks.value")
        page.keyboard.press("Shift+Digit4")
        expect(page.locator(".save")).to_have_text("Saved")
        before = page.evaluate(PLACES, CLICKED)
        page.keyboard.press("Shift+Digit5")
        page.evaluate(NOTICES)
        expect(act_now).to_be_visible()
        expect(page.get_by_text("Picture and rig disagree").first).to_be_visible()
        assert page.evaluate(PLACES, CLICKED) == before, size
        if size["width"] >= 1100:
            assert not page.evaluate(COVERED), size
        page.keyboard.press("Shift+Digit4")
        expect(act_now).to_be_hidden()
        assert page.evaluate(PLACES, CLICKED) == before, size


def test_the_text_on_an_empty_wall_can_be_read(page: Page, server: Server, inspection: str) -> None:
    def without_tiles(route: Route) -> None:
        layout = json.load(server.ask("GET", f"/api/inspections/{inspection}/unrolled"))
        route.fulfill(json=layout | {"tiles": []})

    page.route("**/unrolled", without_tiles)
    log_in(page, server, f"/inspections/{inspection}")
    text = page.locator(".wall__empty")
    expect(text).to_be_visible()
    for scheme in ("dark", "light"):
        page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
        assert text.evaluate(CONTRAST) >= 4.5, scheme


def test_a_failed_run_does_not_deny_the_picture_that_is_seen(
    page: Page, server: Server, inspection: str
) -> None:
    def failed(route: Route) -> None:
        shown = json.load(server.ask("GET", f"/api/inspections/{inspection}"))
        error = {"code": "tracking_failed", "detail": "It has failed."}
        route.fulfill(json=shown | {"status": "failed", "error": error})

    page.route(f"**/api/inspections/{inspection}", failed)
    path = f"/api/inspections/{inspection}/track?format=columns"
    no_rows = server.ask("GET", f"{path}&since=1000000").read()
    page.route(
        "**/track?format=columns*",
        lambda route: route.fulfill(body=no_rows, content_type="application/octet-stream"),
    )
    log_in(page, server, f"/inspections/{inspection}")
    note = page.locator(".stage__note")
    expect(note).to_have_text("Tracking has failed: there is no distance to show.")
