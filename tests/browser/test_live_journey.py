"""From the register and a live camera that drops out to a corrected report, in few actions."""

from __future__ import annotations

import csv
import io
import json
import re
import threading
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from builders import BLOCK, blocks, frame_number, half_size, wait_until
from cameras import MjpegCamera, Picture
from desks import DRAWN_AND_STATED, expect_saved, observations
from hands import Hands
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
SECTION = {
    "start_node": "HW1", "end_node": "HW2", "shape": "circular", "height_mm": 300.0,
    "unit_length_m": 0.3, "material": "Concrete", "client": "JKR", "asset_type": "culvert",
}  # fmt: skip
MOST_ACTIONS = 38
REASON = "Taped from headwall to headwall"


@dataclass(frozen=True)
class Culvert:
    """What the camera sees on its way, each picture with its number; the rig as it is stated."""

    pictures: list[Picture]
    distances_m: list[float]
    """True, of each picture."""
    rig: dict[str, Any]


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
def culvert() -> Culvert:
    """1.5 m of units of 300 mm, and a rig whose camera is 1.5 % too low."""
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
    places_m = [frame.x_mm / 1000 for frame in frames]
    return Culvert([frame.image for frame in frames], places_m, fields)


@pytest.fixture
def live_server(tmp_path: Path, culvert: Culvert) -> Iterator[Server]:
    with Server(tmp_path / "data", camera_networks="127.0.0.0/8") as running:
        running.ask("PUT", "/api/register/assets/CUL-0041", {"header": SECTION})
        running.ask("PUT", f"/api/rigs/{uuid4()}", {"name": "Crawler A", "rig": culvert.rig})
        yield running


def test_a_live_camera_becomes_a_corrected_and_exported_inspection(
    page: Page, live_server: Server, culvert: Culvert
) -> None:
    robot, hands = Robot(culvert), Hands(page)
    with MjpegCamera(rate_hz=RATE_HZ, size_wh=(320, 240), picture=robot.look) as camera:
        inspection = _start(hands, live_server, camera)
        _drive(hands, robot, camera, last=len(culvert.pictures) - 1)
        _finish(hands)
    expect(page.locator(".chip")).to_contain_text("Done")
    expect(page.locator(".defect")).to_have_count(6)
    expect_saved(page)
    _expect_every_step_to_be_the_next_frame(page)

    frames_m = _Truth(live_server, inspection, culvert)
    uncorrected_m = _distances_m(live_server, inspection)
    assert max(abs(m - frames_m[frame]) for frame, m in uncorrected_m.items()) > TOLERANCE_M
    _correct(hands)
    page.set_viewport_size({"width": 1100, "height": 768})
    assert page.evaluate("document.documentElement.scrollWidth - innerWidth") == 0
    made = observations(live_server, inspection)
    made_m = sorted(item["distance_m"] for item in made)
    for item in made:
        true_m = frames_m[item["frame"]]
        assert item["distance_m"] == pytest.approx(true_m, abs=TOLERANCE_M), item
        assert abs(item["distance_m"] - true_m) <= item["distance_u95_m"] + 0.001, item

    page.get_by_role("tab", name="Defects").click()
    wait_until(lambda: _shown_m(page) == pytest.approx(made_m, abs=0.00501))
    page.get_by_role("tab", name="Checks").click()
    expect(page.locator("checks-panel")).to_contain_text(re.compile("thing|Nothing"))
    expect(page.locator("checks-panel")).not_to_contain_text("blocks a report")
    page.get_by_role("tab", name="History").click()
    expect(page.locator(".event").first).to_contain_text(REASON)

    # What is taken home says the same as the page, corrected and as measured.
    rows = list(csv.DictReader(io.StringIO(hands.export("CSV").decode("utf-8-sig"))))
    assert hands.actions <= MOST_ACTIONS
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


def _start(hands: Hands, server: Server, camera: MjpegCamera) -> str:
    """From the day's work to the first live picture; answers the inspection's id."""
    page = hands.page
    log_in(page, server)
    hands.click(page.get_by_role("link", name="Start inspection of CUL-0041"))
    hands.click(page.get_by_text("Live camera"))
    hands.type(page.get_by_label("Address of the camera"), camera.url)
    hands.select(page.get_by_label("Direction"), "With the flow")
    hands.type(page.get_by_label("Operator", exact=False).first, "A. Rahman")
    hands.type(page.get_by_label("Distance is counted from"), "Inner face of the headwall")
    hands.select(page.locator("#rig-preset"), "Crawler A")
    hands.click(page.get_by_role("button", name="Test picture"))
    expect(page.locator(".rig-picture img")).to_be_in_viewport(ratio=1)
    hands.click(page.get_by_role("button", name="Start recording"))
    page.wait_for_url("**/inspections/*")
    expect(_bar(page)).to_contain_text("Camera connected")
    return page.url.rsplit("/", 1)[1]


def _drive(hands: Hands, robot: Robot, camera: MjpegCamera, last: int) -> None:
    """To the outlet with three defects on the way, and twice without the camera."""
    page = hands.page
    page.wait_for_function(
        "() => document.querySelector('inspection-page').desk?.playhead.value.row"
    )
    hands.press("z")
    expect(page.get_by_text("Zero set at frame")).to_be_visible()

    robot.go(last // 3)
    robot.wait_at(last // 8)
    _tag(hands, "1", "b", "a", "0.4")
    robot.wait_at(last // 4)
    _tag(hands, "5", "c", "10")
    hands.press("s")
    expect(page.get_by_role("list", name="Open stretches")).to_contain_text("A1 BBA")
    robot.wait_at(last // 3)

    # The robot stands while the picture is gone; what was seen last can still be tagged.
    camera.drop_out()
    expect(_bar(page)).to_contain_text("Camera gone")
    _tag(hands, "3", "b", "a")
    expect_saved(page)
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
    hands.press("f")
    expect(page.get_by_role("list", name="Open stretches")).to_be_hidden()


def _tag(hands: Hands, digit: str, *answers: str) -> None:
    """In full, at the picture that is shown."""
    hands.press(digit)
    hands.answer(*answers)
    hands.press("Shift+Digit3")
    expect(hands.page.locator("defect-form")).to_have_count(0)


def _finish(hands: Hands) -> None:
    """With the length that is known."""
    dialog = hands.page.get_by_role("dialog")
    hands.click(hands.page.locator("live-bar").get_by_role("button", name="Finish"))
    hands.click(dialog.get_by_label("The end was reached"))
    hands.type(dialog.get_by_label("Known length"), str(LENGTH_MM / 1000))
    dialog.get_by_label("Known length").press("Tab")
    expect(dialog.locator(".closure__residual")).to_contain_text("mm")
    hands.click(dialog.get_by_role("button", name="Stop and finish"))
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


def _correct(hands: Hands) -> None:
    """The length of the header, taped, and the joints."""
    page = hands.page
    hands.click(page.get_by_role("tab", name="Corrections"))
    hands.click(page.get_by_role("button", name="of the header"))
    hands.click(page.get_by_role("button", name="Tape ± 5"))
    hands.click(page.get_by_label("Use the joints"))
    expect(page.get_by_text("It fits")).to_be_visible()
    hands.type(page.get_by_label("Why (for the history)"), REASON)
    hands.click(page.get_by_role("button", name="Apply"))
    expect(page.get_by_text("Distances corrected").first).to_be_visible()


def _shown_m(page: Page) -> list[float]:
    """The distances of the list."""
    shown = page.locator(".defect__where").all_text_contents()
    return sorted(float(text.split()[0]) for text in shown)


def _bar(page: Page) -> Locator:
    return page.get_by_role("region", name="Camera", exact=True)


def _distances_m(server: Server, inspection: str) -> dict[int, float]:
    return {item["frame"]: item["distance_raw_m"] for item in observations(server, inspection)}
