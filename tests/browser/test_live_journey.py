"""From a live camera that drops out to a finished, corrected and exported inspection."""

from __future__ import annotations

import csv
import io
import json
import re
import threading
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from builders import BLOCK, blocks, frame_number, half_size
from cameras import MjpegCamera, Picture
from desks import DRAWN_AND_STATED, observations
from playwright.sync_api import Locator, Page, expect
from steps import Server, export, log_in

from app.lab.simulation import SCENARIOS, render
from vo_core.rig import Rig

RATE_HZ = 5
SPEED_MM_S = 100.0
"""6 m/min; so few pictures a second are read in time by a busy machine, too."""
LENGTH_MM = 1500.0
WRONG_HEIGHT = 0.985
TOLERANCE_M = 0.01
ROLLED = 2
"""Pictures that nobody sees while the robot rolls on, 40 mm."""
HEADER = {
    "asset_id": "CUL-0041",
    "start_node": "HW1",
    "end_node": "HW2",
    "operator": "A. Rahman",
    "client": "JKR",
    "material": "Concrete",
    "reference_point": "Inner face of the headwall at the start",
}
CHOICES = {"direction": "with_flow", "asset_type": "culvert"}
REASON = "Taped from headwall to headwall"


@dataclass(frozen=True)
class Culvert:
    """What the camera sees on its way, each picture with its number; the rig as it is stated."""

    pictures: list[Picture]
    distances_m: list[float]
    """True, of each picture."""
    rig: Path


class Robot:
    """Drives while its camera is watched: the next picture that is sent is of the next place."""

    def __init__(self, culvert: Culvert) -> None:
        self._culvert = culvert
        self._moved = threading.Condition()
        self._goal = 0
        self.place = 0

    def look(self, _number: int) -> Picture:
        with self._moved:
            if self.place < self._goal:
                self.place += 1
                self._moved.notify_all()
            return self._culvert.pictures[self.place]

    def go(self, goal: int) -> None:
        """Start to drive there."""
        with self._moved:
            self._goal = goal

    def wait_at(self, place: int) -> None:
        """Until the robot is there or beyond."""
        with self._moved:
            assert self._moved.wait_for(lambda: self.place >= place, timeout=60), self.place

    def roll_on(self, count: int) -> None:
        """Without being watched."""
        with self._moved:
            self.place += count


@pytest.fixture(scope="module")
def culvert(tmp_path_factory: pytest.TempPathFactory) -> Culvert:
    """1.5 m of units of 300 mm, and a rig file whose camera is 1.5 % too low."""
    nominal = SCENARIOS["nominal"]
    fields = half_size(nominal.rig)
    fields["pipe"]["segment_length_mm"] = 300.0
    scenario = replace(
        nominal,
        rig=Rig.parse(fields),
        length_mm=LENGTH_MM,
        first_joint_mm=120.0,
        speed_mm_s=SPEED_MM_S,
        acceleration_mm_s2=2 * SPEED_MM_S,
        frames_per_s=RATE_HZ,
    )
    frames = list(render(scenario))
    for frame in frames:
        frame.image[:BLOCK, : 16 * BLOCK] = blocks(frame.index)
    fields["mount"]["height_mm"] *= WRONG_HEIGHT
    rig = tmp_path_factory.mktemp("culvert") / "rig.json"
    rig.write_text(json.dumps(fields))
    return Culvert([frame.image for frame in frames], [frame.x_mm / 1000 for frame in frames], rig)


@pytest.fixture
def live_server(tmp_path: Path) -> Iterator[Server]:
    with Server(tmp_path / "data", camera_networks="127.0.0.0/8") as running:
        yield running


def test_a_live_camera_becomes_a_corrected_and_exported_inspection(
    page: Page, live_server: Server, culvert: Culvert
) -> None:
    robot = Robot(culvert)
    with MjpegCamera(rate_hz=RATE_HZ, size_wh=(320, 240), picture=robot.look) as camera:
        inspection = _start(page, live_server, camera, culvert.rig)
        _drive(page, robot, camera, last=len(culvert.pictures) - 1)
        _finish(page)
    expect(page.locator(".chip")).to_contain_text("Done")
    _expect_every_step_to_be_the_next_frame(page)
    _complete(page)

    frames_m = _Truth(live_server, inspection, culvert)
    uncorrected_m = _distances_m(live_server, inspection)
    assert max(abs(m - frames_m[frame]) for frame, m in uncorrected_m.items()) > TOLERANCE_M
    _correct(page)
    made = observations(live_server, inspection)
    for item in made:
        true_m = frames_m[item["frame"]]
        assert item["distance_m"] == pytest.approx(true_m, abs=TOLERANCE_M), item
        assert abs(item["distance_m"] - true_m) <= item["distance_u95_m"] + 0.001, item

    page.get_by_role("tab", name="Defects").click()
    shown = [float(text.split()[0]) for text in page.locator(".defect__where").all_text_contents()]
    assert sorted(shown) == pytest.approx(sorted(item["distance_m"] for item in made), abs=0.00501)
    page.get_by_role("tab", name="Checks").click()
    expect(page.locator("checks-panel")).to_contain_text(re.compile("thing|Nothing"))
    expect(page.locator("checks-panel")).not_to_contain_text("blocks a report")
    page.get_by_role("tab", name="History").click()
    expect(page.locator(".event").first).to_contain_text(REASON)

    # What is taken home says the same as the page, corrected and as measured.
    rows = list(csv.DictReader(io.StringIO(export(page, "CSV").decode("utf-8-sig"))))
    report = json.loads(export(page, "JSON"))
    by_frame = {item["frame"]: item for item in made}
    assert len(rows) == len(report["observations"]) == len(made) == 6
    for row in [*rows, *report["observations"]]:
        item = by_frame[int(row["frame"])]
        assert float(row["distance_m"]) == pytest.approx(item["distance_m"], abs=1e-3)
        assert float(row["distance_raw_m"]) == pytest.approx(item["distance_raw_m"], abs=1e-3)
        # The raw one is as the camera saw it: without zero, lengths and joints.
        assert abs(float(row["distance_raw_m"]) - uncorrected_m[item["frame"]]) < TOLERANCE_M
    assert REASON in [event["remark"] for event in report["events"]]
    assert report["inspection"]["header"]["end_condition"] == "complete"
    assert report["corrections"]["result"]["distance_class"]["percent"] is not None


class _Truth:
    """The true distance of each frame of a recording, by the number that its picture shows."""

    def __init__(self, server: Server, inspection: str, culvert: Culvert) -> None:
        self._path = f"/api/inspections/{inspection}/frames"
        self._server, self._culvert = server, culvert

    def __getitem__(self, frame: int) -> float:
        picture = self._server.ask("GET", f"{self._path}/{frame}.jpg").read()
        return self._culvert.distances_m[frame_number(picture)]


def _start(page: Page, server: Server, camera: MjpegCamera, rig: Path) -> str:
    """From the list to the first live picture; answers the inspection's id."""
    log_in(page, server)
    page.get_by_role("link", name="New inspection").first.click()
    page.get_by_label("Live camera").check()
    page.get_by_label("Address of the camera").fill(camera.url)
    page.get_by_label("Name", exact=True).fill("Live culvert")
    page.locator("rig-form input[type=file]").set_input_files(rig)
    expect(page.locator(".header-form__missing")).to_contain_text("Asset")
    for name, value in HEADER.items():
        page.locator(f"#header-{name}").fill(value)
    for name, value in CHOICES.items():
        page.locator(f"#header-{name}").select_option(value)
    page.get_by_role("button", name="Start recording").click()
    page.wait_for_url("**/inspections/*")
    expect(_bar(page)).to_contain_text("Camera connected")
    return page.url.rsplit("/", 1)[1]


def _drive(page: Page, robot: Robot, camera: MjpegCamera, last: int) -> None:
    """To the outlet with six tags on the way, and twice without the camera."""
    page.wait_for_function(
        "() => document.querySelector('inspection-page').desk?.playhead.value.row"
    )
    page.keyboard.press("z")
    expect(page.get_by_text("Zero set at frame")).to_be_visible()
    page.keyboard.press("t")

    robot.go(last // 3)
    robot.wait_at(last // 8)
    page.keyboard.press("1")
    robot.wait_at(last // 4)
    page.keyboard.press("5")
    page.keyboard.press("s")
    expect(page.get_by_role("list", name="Open stretches")).to_contain_text("A1 BBA")
    robot.wait_at(last // 3)

    # The robot stands while the picture is gone; what was seen last can still be tagged.
    camera.drop_out()
    expect(_bar(page)).to_contain_text("Camera gone")
    page.keyboard.press("3")
    camera.come_back()
    expect(_bar(page)).to_contain_text("Camera connected")

    robot.go(2 * last // 3)
    robot.wait_at(2 * last // 3)
    camera.drop_out()
    expect(_bar(page)).to_contain_text("Camera gone")
    robot.roll_on(ROLLED)
    camera.come_back()
    expect(_bar(page)).to_contain_text("Camera connected")

    robot.go(last)
    robot.wait_at(last)
    expect(page.locator(".defect")).to_have_count(4)


def _finish(page: Page) -> None:
    """Refused while the stretch is open; then with the length that is known."""
    finish = page.locator("live-bar").get_by_role("button", name="Finish")
    dialog = page.get_by_role("dialog")
    submit = dialog.get_by_role("button", name="Stop and finish")
    finish.click()
    dialog.get_by_label("The end was reached").check()
    submit.click()
    expect(dialog.get_by_role("alert").last).to_contain_text("A1")
    page.keyboard.press("Escape")
    expect(dialog).to_be_hidden()  # it would take the key
    page.keyboard.press("f")
    expect(page.get_by_role("list", name="Open stretches")).to_be_hidden()
    page.keyboard.press("t")
    expect(page.locator(".save")).to_have_text("Saved")

    finish.click()
    dialog.get_by_label("The end was reached").check()
    dialog.get_by_label("Known length").fill(str(LENGTH_MM / 1000))
    dialog.get_by_label("Known length").press("Tab")
    expect(dialog.locator(".closure__residual")).to_contain_text("mm")
    for code in ("BCD", "BCE"):  # they are tagged already, and coded later
        dialog.get_by_role("checkbox", name=code).uncheck()
    submit.click()
    expect(dialog).to_be_hidden()


def _expect_every_step_to_be_the_next_frame(page: Page) -> None:
    """By the numbers that the recorded pictures show: while the robot stands they stay."""
    page.keyboard.press("g")
    page.get_by_role("textbox", name="Distance, time, frame or joint").fill("0.3")
    page.keyboard.press("Enter")
    frame = page.locator(".transport__frame")
    expect(page.locator(".readout__distance")).to_contain_text(re.compile(r"0\.(29|3)"))
    drawn, start = page.evaluate(DRAWN_AND_STATED)
    for step in range(1, 6):
        page.keyboard.press("ArrowRight")
        expect(frame).to_have_text(re.compile(rf"frame {start + step}$"))
        assert page.evaluate(DRAWN_AND_STATED) == [drawn + step, start + step]


def _complete(page: Page) -> None:
    """The codes and quantities that were left for later."""
    rows = page.locator(".defect")
    expect(rows).to_have_count(6)
    _describe(page, rows.nth(0), "BCD Z")
    _describe(page, rows.nth(1), "BAB B A", quantity="0.4")
    _describe(page, rows.nth(2), "BBA C", quantity="10")
    _describe(page, rows.nth(3), "BAF B A")
    _describe(page, rows.filter(has_text="no code"), "BCE Z")
    expect(page.locator(".save")).to_have_text("Saved")


def _describe(page: Page, row: Locator, code: str, quantity: str | None = None) -> None:
    row.locator(".defect__main").click()
    page.keyboard.press("e")
    page.get_by_label("Code", exact=True).fill(code)
    page.get_by_label("Code", exact=True).press("Enter")
    if quantity:
        page.get_by_label("Quantity", exact=True).fill(quantity)
        page.get_by_label("Quantity", exact=True).press("Tab")
    page.get_by_role("button", name="Done").click()
    expect(page.locator(".save")).to_have_text("Saved")


def _correct(page: Page) -> None:
    """The length of the header, taped, and the joints."""
    page.get_by_role("tab", name="Corrections").click()
    page.get_by_role("button", name="of the header").click()
    page.get_by_role("button", name="Tape ± 5").click()
    page.get_by_label("Use the joints").check()
    expect(page.get_by_text("It fits")).to_be_visible()
    page.get_by_label("Why (for the history)").fill(REASON)
    page.get_by_role("button", name="Apply").click()
    expect(page.get_by_text("Distances corrected").first).to_be_visible()


def _bar(page: Page) -> Locator:
    return page.get_by_role("region", name="Camera", exact=True)


def _distances_m(server: Server, inspection: str) -> dict[int, float]:
    return {item["frame"]: item["distance_raw_m"] for item in observations(server, inspection)}
