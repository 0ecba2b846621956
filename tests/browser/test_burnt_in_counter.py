"""The burnt-in counter on the desk: beside the odometry, its faults, its length as a correction."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import counter_drives
import pytest
from counter_drives import STEP_MM, CounterDrive
from counter_surveys import DRIVE, READ_WITHIN_S, faulty_drive
from looks import expect_no_fault
from playwright.sync_api import Locator, Page, Route, expect
from steps import Server, log_in
from surveys import Survey

READ_WITHIN_MS = 1000 * READ_WITHIN_S


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rig") / "rig.json"
    path.write_text(json.dumps(counter_drives.rig()))
    return path


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Survey:
    return faulty_drive(tmp_path_factory)


@pytest.fixture(scope="module")
def server(survey: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(survey.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def faulty(survey: Survey) -> str:
    """Its counter counts 2 % too little, stuck once, and was set to 0 once."""
    return survey.id


@pytest.fixture(scope="module")
def unclear(server: Server, rig: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Shows no unit, and a date."""
    drive = CounterDrive(16, unit="", stuck=None, reset_at=None, date="2019/05/17")
    return server.track(
        counter_drives.write(drive, tmp_path_factory.mktemp("film") / "unclear.mp4"),
        rig,
        has_counter=True,
    )


def corrections(page: Page, server: Server, inspection: str) -> Locator:
    log_in(page, server, f"/inspections/{inspection}")
    page.get_by_role("tab", name="Corrections").click()
    return page.locator("counter-section")


def stored(server: Server, inspection: str, part: str) -> Any:
    return json.load(server.ask("GET", f"/api/inspections/{inspection}/{part}"))


def test_the_counter_is_read_its_faults_are_named_and_its_length_is_used(
    page: Page, server: Server, faulty: str
) -> None:
    section = corrections(page, server, faulty)
    expect(section).to_contain_text("From 0.00 m to 0.86 m.")
    rows = section.locator("tbody tr")
    expect(rows.locator("th")).to_have_text(["stuck", "set anew"])
    rows.first.get_by_role("button").click()
    frame = stored(server, faulty, "counter")["comparison"]["faults"][0]["first_frame"]
    expect(page.locator(".transport__frame")).to_contain_text(f"frame {frame}")
    expect_no_fault(page, within="counter-section")

    # The second curve leaves the middle where the counter stuck.
    page.wait_for_function(
        "() => document.querySelector('inspection-page').desk.counter.faults.length > 0"
    )
    # At the end of the stretch in which it stuck it is as much behind as the camera drove.
    ahead_mm = page.evaluate(
        """async () => {
          const { deviations } = await import('/static/core/survey/counter.js');
          const { counter, track } = document.querySelector('inspection-page').desk;
          const found = deviations(
            track.column('distance_mm'), counter.readings.column('counter_m'), counter.faults,
          );
          return [...found];
        }"""
    )
    lost_mm = DRIVE.scale * STEP_MM * 32
    drift_mm = (1 - DRIVE.scale) * STEP_MM
    assert ahead_mm[79] == pytest.approx(-79 * drift_mm, abs=15)
    assert ahead_mm[-1] == pytest.approx(-lost_mm - (DRIVE.frames - 1) * drift_mm, abs=25)
    # Only the stretch in which it stuck is shaded.
    drawn = page.locator("strip-log").evaluate(
        """(log) => {
          const { top, height } = log.arrangement.rows.find(({ lane }) => lane.name === 'counter');
          const context = log.parts.ground.getContext('2d');
          const pixels = devicePixelRatio * log.scale;
          const y = (top + 2) * pixels;
          const at = (mm) =>
            [...context.getImageData(log.plot.toX(mm) * pixels, y, 1, 1).data].join();
          return { stuck: at(1350), free: at(600), after: at(1700) };
        }"""
    )
    assert drawn["stuck"] != drawn["free"] == drawn["after"]

    # Its length becomes the known one, and is taken back.
    before_m = stored(server, faulty, "")["distance_m"]
    expect(section).to_contain_text("scale 0.979")
    section.get_by_role("button", name="Use as a known length").click()
    expect(section).to_contain_text("It is the known length.")
    stated = stored(server, faulty, "corrections")
    assert [length["kind"] for length in stated["stated"]["lengths"]] == ["known"]
    after_m = stored(server, faulty, "")["distance_m"]
    assert after_m == pytest.approx(DRIVE.scale * before_m, rel=0.01)
    page.get_by_role("button", name="Undo", exact=True).first.click()
    expect(section.get_by_role("button", name="Use as a known length")).to_be_visible()
    assert stored(server, faulty, "corrections")["stated"]["lengths"] == []


def test_a_person_takes_the_date_states_the_unit_draws_the_box_and_stops_the_reading(
    page: Page, server: Server, unclear: str
) -> None:
    section = corrections(page, server, unclear)
    page.get_by_role("tab", name="Header").click()
    offer = page.get_by_role("button", name="From the film: 2019-05-17 – use")
    expect(offer).to_be_visible()
    expect_no_fault(page, within="header-panel")
    offer.click()
    expect(offer).to_be_hidden()
    expect(page.locator(".header-panel__state")).to_have_text("Saved")
    assert stored(server, unclear, "")["header"]["date"] == "2019-05-17"

    page.get_by_role("tab", name="Corrections").click()
    section.get_by_role("button", name="m", exact=True).click()
    expect(section).to_contain_text("From 0.00 m to 0.1", timeout=READ_WITHIN_MS)

    section.get_by_role("button", name="There is no counter").click()
    expect(section).to_contain_text("the film shows no counter")
    assert stored(server, unclear, "counter")["state"] == "declined"

    # A picture that comes late moves nothing: the box stays where it was drawn.
    held: list[Route] = []
    page.route("**/frames/*.jpg", lambda route: held.append(route))
    section.get_by_role("button", name="Draw its box").click()
    dialog = page.get_by_role("dialog")
    expect(dialog.get_by_role("button", name="Read the counter in this box")).to_be_disabled()
    drawing = dialog.locator(".counter-box__drawing")
    box = drawing.bounding_box()
    assert box
    across, down = box["width"] / counter_drives.WIDTH, box["height"] / counter_drives.HEIGHT
    page.mouse.move(box["x"] + 4 * across, box["y"] + 212 * down)
    page.mouse.down()
    page.mouse.move(box["x"] + 160 * across, box["y"] + 236 * down, steps=4)
    page.mouse.up()
    for route in held:
        route.continue_()
    page.unroute("**/frames/*.jpg")
    page.wait_for_function(
        "() => document.querySelector('dialog .counter-box__picture img').complete"
    )
    assert drawing.bounding_box() == box
    page.keyboard.press("Shift+Control+ArrowLeft")
    expect_no_fault(page, within="dialog[open]")
    dialog.get_by_role("button", name="Read the counter in this box").click()
    unit = section.get_by_role("button", name="m", exact=True)
    expect(unit).to_be_visible(timeout=READ_WITHIN_MS)
    found = stored(server, unclear, "counter")
    assert found["is_box_drawn"]
    assert found["legible"] > 13

    section.get_by_role("button", name="Read it again").click()
    section.get_by_role("button", name="Stop reading").click()
    expect(section).to_contain_text("Reading was stopped.")
    expect(section.get_by_role("button", name="Read it again")).to_be_visible()
    assert stored(server, unclear, "counter")["state"] == "cancelled"
