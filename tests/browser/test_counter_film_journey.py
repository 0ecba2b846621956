"""From the register to the report of a film that the camera cannot measure, in few actions."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit
from uuid import uuid4

import counter_drives
import pytest
from counter_drives import CounterDrive
from desks import expect_frame, expect_saved
from hands import Hands
from looks import expect_no_fault
from playwright.sync_api import Page, expect
from steps import Server, log_in

DRIVE = CounterDrive(60, scale=1.0, stuck=None, reset_at=None, is_snow=True)
"""Nothing but noise, and a counter in metres."""
MOST_ACTIONS = 22
READ_WITHIN_S = 240.0
CRAWLER = {
    "camera": counter_drives.rig()["camera"],
    "mount": {"view": "forward", "height_mm": 150.0, "rotation_deg": 0.0},
    "pipe": {"shape": "circular", "diameter_mm": 300.0},
}
SECTION = {
    "start_node": "S1", "end_node": "S2", "shape": "circular", "height_mm": 300.0,
    "material": "Concrete", "client": "JKR", "asset_type": "culvert",
}  # fmt: skip


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return counter_drives.write(DRIVE, tmp_path_factory.mktemp("film") / "cctv.mp4")


@pytest.fixture
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(tmp_path_factory.mktemp("data")) as running:
        running.ask("PUT", "/api/register/assets/C-001", {"header": SECTION})
        running.ask("PUT", f"/api/rigs/{uuid4()}", {"name": "Crawler A", "rig": CRAWLER})
        yield running


def test_a_film_that_shows_only_its_counter_becomes_a_report(
    page: Page, server: Server, film: Path
) -> None:
    log_in(page, server)
    hands = Hands(page)
    hands.click(page.get_by_role("link", name="Start inspection of C-001"))
    hands.choose(page.get_by_role("button", name="Choose films"), film)
    hands.select(page.locator("#rig-preset"), "Crawler A")
    hands.select(page.get_by_label("Direction"), "With the flow")
    hands.type(page.get_by_label("Operator", exact=False).first, "A. Rahman")
    hands.type(page.get_by_label("Distance is counted from"), "Start manhole")
    hands.click(page.get_by_role("button", name="Start tracking"))

    # The counter is read by itself, and carries what the camera lost.
    health = page.locator(".readout__health")
    expect(health).to_have_text("By the counter", timeout=1000 * READ_WITHIN_S)
    expect_no_fault(page)
    hands.press("End")
    expect_frame(page, DRIVE.frames - 1)
    hands.press("1")
    hands.answer("b", "a", "2.5")
    hands.press("Shift+Digit3")
    expect_saved(page)
    expect(page.locator(".defect")).to_contain_text("by the counter")

    hands.finish()
    expect(page.locator(".defect")).to_have_count(3)
    expect_saved(page)
    rows = hands.export("CSV").decode("utf-8-sig").splitlines()
    assert hands.actions <= MOST_ACTIONS

    crack = next(row for row in csv.DictReader(rows) if row["code"] == "BAB")
    assert crack["distance_source"] == "counter"
    truth_m = DRIVE.counter_mm()[int(crack["frame"])] / 1000
    assert abs(float(crack["distance_m"]) - truth_m) <= float(crack["distance_u95_m"]) < 0.1
    inspection = urlsplit(page.url).path.rsplit("/", 1)[1]
    checks = json.load(server.ask("GET", f"/api/inspections/{inspection}/checks"))["checks"]
    assert [check for check in checks if check["level"] == "block"] == []
