"""The rig of a camera that looks along the pipe, stated on a picture of its film."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import counter_drives
import numpy as np
import pytest
from clips import numbered_clip
from counter_drives import CounterDrive
from looks import expect_no_fault
from playwright.sync_api import Page, Request, Route, expect
from steps import Server, log_in

from app.lab.simulation import SCENARIOS, simulate
from vo_core.geometry.grid import grid

CROOKED = replace(SCENARIOS["forward_crooked"], length_mm=20.0)
PITCH_DEG = CROOKED.true_rig.mount.pitch_deg if CROOKED.true_rig else 0.0
PATIENCE_MS = 60_000
FOUND_WITHIN_DEG = 3.0
"""`vo_core.geometry.gaze.SIGMA_RAD`: by one picture the axis is not known better."""
ENDS = """(path) => [...path.getAttribute('d').matchAll(/[ML]([-0-9.]+) ([-0-9.]+)/g)]
  .map((found) => [Number(found[1]), Number(found[2])])"""


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Looks 3 degrees down, 12 mm beside the axis."""
    return simulate(CROOKED, tmp_path_factory.mktemp("crooked")).video


@pytest.fixture
def wizard(page: Page, server: Server, film: Path) -> Page:
    """A first-time visitor with a film and without any rig."""
    log_in(page, server, "/new")
    page.locator("input[type=file]").first.set_input_files(film)
    page.get_by_role("button", name="Set the rig on a picture").click()
    expect(page.locator("rig-wizard").get_by_role("status")).to_contain_text("The camera looks")
    return page


def pitch(page: Page) -> float:
    return float(page.locator("#rig-mount-pitch_deg").input_value() or 0)


def answered(page: Page, act: Callable[[], None]) -> None:
    """Do something, and wait for what the server says to it."""
    with page.expect_response("**/api/aim"):
        act()


def test_a_crooked_camera_is_stated_on_the_picture_of_its_film(
    wizard: Page, server: Server
) -> None:
    _the_axis_is_found_and_states_the_pitch(wizard)
    _the_cross_is_moved_by_key_and_by_hand_and_put_back(wizard)
    _the_wall_of_the_stated_pipe_is_drawn_where_it_is(wizard)
    wizard.get_by_role("button", name="Done").click()
    expect(wizard.get_by_role("button", name="Set the rig on a picture")).to_be_focused()
    make(wizard, server)


def _the_axis_is_found_and_states_the_pitch(wizard: Page) -> None:
    expect(wizard.locator("#rig-mount-view")).to_have_value("forward")
    expect(wizard.locator("#rig-mount-pitch_deg")).to_have_value(re.compile(r"-\d"))
    focal = float(wizard.locator("#rig-camera-fx").input_value())
    # The lens is a guess, and the angle scales with it.
    true = float(np.degrees(np.tan(np.radians(PITCH_DEG)) * 400 / focal))
    assert pitch(wizard) == pytest.approx(true, abs=FOUND_WITHIN_DEG)
    expect(wizard.get_by_text(re.compile(r"The camera looks \d\.\d° down and"))).to_be_visible()
    expect_no_fault(wizard)


def _the_cross_is_moved_by_key_and_by_hand_and_put_back(wizard: Page) -> None:
    cross = wizard.get_by_role("slider", name="Axis of the pipe")
    found, text = pitch(wizard), cross.get_attribute("aria-valuetext")
    focal = float(wizard.locator("#rig-camera-fx").input_value())
    cross.focus()
    answered(wizard, lambda: wizard.keyboard.press("Shift+ArrowDown"))
    nose_up = np.degrees(np.arctan(10 / focal))
    expect(wizard.locator("#rig-mount-pitch_deg")).not_to_have_value(str(found))
    assert pitch(wizard) == pytest.approx(found + nose_up, abs=0.1)  # near the middle of the lens

    picture = wizard.locator(".wizard__drawing")
    picture.evaluate("(drawing) => drawing.scrollIntoView({ block: 'center' })")
    box = picture.bounding_box()
    assert box
    wizard.mouse.move(box["x"] + 20, box["y"] + 20)
    wizard.mouse.down()
    wizard.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, steps=4)
    wizard.mouse.up()
    expect(wizard.get_by_text("The camera looks 0.0° ")).to_be_visible()
    assert abs(pitch(wizard)) < 0.2

    wizard.get_by_role("button", name="Put it back where it was found").click()
    expect(cross).to_have_attribute("aria-valuetext", str(text))
    expect(wizard.locator("#rig-mount-pitch_deg")).to_have_value(str(found))


def _the_wall_of_the_stated_pipe_is_drawn_where_it_is(wizard: Page) -> None:
    wizard.get_by_role("button", name="Yes, this is the axis").click()
    diameter = wizard.get_by_label("Pipe, inside")
    expect(diameter).to_be_focused()
    expect(wizard.get_by_text("its focal length is a guess")).to_be_visible()
    expect(wizard.locator(".wizard__line--ring")).to_have_attribute("d", "")
    diameter.fill("300")
    expect(wizard.get_by_label("Lens above the invert")).to_have_value("150")
    expect(wizard.locator("#rig-pipe-diameter_mm")).to_have_value("300")
    expect(wizard.locator(".wizard__line--ring")).not_to_have_attribute("d", "")
    assert wizard.locator("#rig-tolerance-focal_percent").input_value() == "15"

    # With what is true of this camera, the rings are where they are for the core.
    assert CROOKED.true_rig
    mount = CROOKED.true_rig.mount
    wizard.locator("summary", has_text="Expert").click()
    wizard.locator("#rig-mount-lateral_mm").fill(str(mount.lateral_mm))
    wizard.get_by_label("Focal length", exact=True).fill("400")
    answered(wizard, lambda: wizard.get_by_label("Lens above the invert").fill("134"))
    wizard.get_by_role("button", name="Is this the axis?").click()
    answered(
        wizard, lambda: wizard.get_by_role("slider", name="Axis of the pipe").press("ArrowRight")
    )
    wizard.get_by_role("button", name="How wide is the pipe?").click()
    expect(wizard.locator(".wizard__line--ring")).not_to_have_attribute("d", "")
    tilted = mount.model_copy(update={"pitch_deg": pitch(wizard)})
    drawn = np.array(wizard.locator(".wizard__line--ring").evaluate(ENDS))
    expected = np.concatenate(grid(CROOKED.true_rig.model_copy(update={"mount": tilted})).rings_uv)
    # The camera also looks a little aside, which shifts all of the rings alike.
    aside = np.median(drawn[:, 0]) - np.median(expected[:, 0])
    assert np.abs(aside) < 400 * np.tan(np.radians(1.5 + FOUND_WITHIN_DEG))
    assert np.median(drawn[:, 1]) == pytest.approx(np.median(expected[:, 1]), abs=2)
    expect_no_fault(wizard)


def make(page: Page, server: Server) -> Request:
    """Start tracking; return the accepted request. The film is not tracked to its end."""
    with page.expect_response(lambda answer: answer.url.endswith("/api/inspections")) as made:
        page.get_by_role("button", name="Start tracking").click()
    assert made.value.ok
    page.wait_for_url("**/inspections/*")
    path = page.url.removeprefix(server.url)
    leave(page, server)
    server.ask("DELETE", f"/api{path}")
    return made.value.request


def leave(page: Page, server: Server) -> None:
    """A page of what is deleted says so; another site would take a new process of the browser."""
    page.goto(f"{server.url}/healthz")


def test_without_a_film_or_an_axis_the_person_is_told_what_to_do(
    page: Page, server: Server, tmp_path: Path
) -> None:
    log_in(page, server, "/new")
    begin = page.get_by_role("button", name="Set the rig on a picture")
    expect(begin).to_be_disabled()
    expect(page.get_by_text("Choose the film first; its pictures come")).to_be_visible()

    (tmp_path / "story.mp4").write_text("Once upon a time there was a culvert.")
    page.locator("input[type=file]").first.set_input_files(tmp_path / "story.mp4")
    begin.click()
    expect(page.locator("rig-wizard .fault")).to_contain_text("story.mp4")

    clip = numbered_clip(tmp_path / "clip.mp4", "libx264", frames=5)
    page.reload()
    page.locator("input[type=file]").first.set_input_files(clip)
    begin.click()
    expect(page.get_by_text("The axis is not certain in this picture")).to_be_visible()
    again = page.get_by_role("button", name="Put it back where it was found")
    expect(again).to_be_hidden()


def test_after_tracking_the_film_itself_shows_what_is_wrong_and_the_axis_repairs_it(
    page: Page, server: Server, film: Path, tmp_path: Path
) -> None:
    """The rig says that the camera looks down."""
    rig = CROOKED.rig.model_dump(mode="json")
    rig["mount"]["view"] = "down"
    (tmp_path / "rig.json").write_text(json.dumps(rig))
    path = f"/api/inspections/{server.track(film, tmp_path / 'rig.json')}"
    server.ask("PUT", "/api/intended-use", {"within_m": 0.001, "percent": 0})
    log_in(page, server, path.removeprefix("/api"))
    expect(page.locator(".chip--useless")).to_contain_text("Done ±")
    notice = page.locator("distance-notice")
    expect(notice).to_contain_text("pictures look along the pipe, but the rig says")
    notice.get_by_role("button", name="Show the axis on a picture").click()
    dialog = page.get_by_role("dialog", name="Edit rig and track again")
    expect(dialog.get_by_text(re.compile(r"The axis is certain in \d+ of \d+"))).to_be_visible()
    expect(dialog.locator("#rig-mount-view")).to_have_value("forward")
    expect(dialog.get_by_role("button", name="Is there a counter?")).to_be_hidden()
    shown = dialog.locator(".wizard__picture img").get_attribute("src")
    dialog.get_by_label("Another picture").fill("0")
    expect(dialog.locator(".wizard__picture img")).not_to_have_attribute("src", str(shown))
    expect_no_fault(page)
    with page.expect_navigation():  # the page begins anew
        dialog.get_by_role("button", name="Track again").click()
    assert json.load(server.ask("GET", path))["rig"]["mount"]["view"] == "forward"
    leave(page, server)
    server.ask("PUT", "/api/intended-use", {"within_m": 0.3, "percent": 2})
    server.ask("DELETE", path)


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Shows a counter at its bottom, to the left."""
    film = tmp_path_factory.mktemp("drive") / "drive.mp4"
    return counter_drives.write(CounterDrive(60, stuck=None, reset_at=None), film)


@pytest.fixture(scope="module")
def search() -> Callable[[Route], None]:
    """Lets the server search the film for its counter once, which takes seconds of CPU; the page
    is told that it shows no unit.
    """
    found: list[Any] = []

    def answer(route: Route) -> None:
        if not found:
            found.append(route.fetch(timeout=PATIENCE_MS).json() | {"unit": ""})
        route.fulfill(json=found[0])

    return answer


@pytest.fixture
def counter_step(page: Page, server: Server, drive: Path, search: Callable[[Route], None]) -> Page:
    """The third picture of a film that shows a counter."""
    page.route("**/api/uploads/*/counter", search)
    log_in(page, server, "/new")
    page.locator("input[type=file]").first.set_input_files(drive)
    page.get_by_role("button", name="Set the rig on a picture").click()
    page.get_by_role("button", name="How wide is the pipe?").click()
    page.get_by_label("Pipe, inside").fill("300")
    page.get_by_role("button", name="Next: is there a counter?").click()
    expect(page.get_by_text("The distance counter was found here")).to_be_visible()
    return page


def made_with(page: Page, server: Server) -> Any:
    """Start tracking; return what is stated about the counter."""
    page.get_by_role("button", name="Done").click()
    return make(page, server).post_data_json.get("counter")


def test_the_counter_is_found_denied_and_taken_back(counter_step: Page, server: Server) -> None:
    edge = counter_step.locator(".counter-box__edge")
    left, top, width, height = (
        float(edge.get_attribute(name) or "nan") for name in ("x", "y", "width", "height")
    )
    assert left < 20
    assert top > 195
    assert left + width < 150
    assert top + height <= counter_drives.HEIGHT
    expect_no_fault(counter_step)
    none = counter_step.get_by_role("button", name="There is no counter")
    none.click()
    expect(none).to_have_attribute("aria-pressed", "true")
    expect(counter_step.get_by_text("so none is read")).to_be_visible()
    counter_step.get_by_role("button", name="Back to the one that was found").click()
    expect(none).to_have_attribute("aria-pressed", "false")
    assert made_with(counter_step, server) is None


def test_another_box_is_drawn_and_a_unit_is_stated(counter_step: Page, server: Server) -> None:
    feet = counter_step.get_by_role("button", name="ft", exact=True)
    feet.click()
    expect(feet).to_have_attribute("aria-pressed", "true")
    drawing = counter_step.locator(".counter-box__drawing")
    drawing.evaluate("(drawing) => drawing.scrollIntoView({ block: 'center' })")
    box = drawing.bounding_box()
    assert box
    scale = box["width"] / counter_drives.WIDTH
    counter_step.mouse.move(box["x"] + 40 * scale, box["y"] + 20 * scale)
    counter_step.mouse.down()
    counter_step.mouse.move(box["x"] + 140 * scale, box["y"] + 60 * scale, steps=4)
    counter_step.mouse.up()
    expect(counter_step.get_by_text("The counter is read in this box")).to_be_visible()
    counter_step.keyboard.press("Shift+ArrowRight")
    counter_step.keyboard.press("Control+ArrowDown")
    stated = made_with(counter_step, server)
    assert (stated["is_present"], stated["unit"]) == (True, "ft")
    assert stated["box"] == pytest.approx([50, 20, 150, 61], abs=1)


def test_that_there_is_no_counter_is_stated(counter_step: Page, server: Server) -> None:
    counter_step.get_by_role("button", name="There is no counter").click()
    assert made_with(counter_step, server) == {"is_present": False}
