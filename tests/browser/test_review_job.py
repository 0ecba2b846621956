"""A past video is reviewed in the office: by keys and in all views."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from builders import half_size
from desks import another_tab, drawn_in_3d, expect_read, expect_saved
from playwright.sync_api import Locator, Page, expect
from steps import Server, export, log_in, start_inspection, wait_until_done

from app.lab.simulation import SCENARIOS, SimulatedRun, simulate
from vo_core.rig import Rig

LENGTH_MM = 1000.0
TOLERANCE_M = 0.005
DRAWN_LIMIT = 40
DISTINCT_COLOURS = 300
"""A culvert with its lights has thousands; an empty view has the few of its background."""
ROBOT_PIXELS = 20


@dataclass(frozen=True)
class Desk:
    """The page of the inspection, and what the server knows of it."""

    page: Page
    server: Server
    path: str

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.keyboard.press(key)

    def expect_frame(self, frame: int | str) -> None:
        expect(self.page.locator(".transport__frame")).to_have_text(re.compile(rf"frame {frame}$"))

    def expect_defects(self, count: int) -> None:
        expect(self.page.locator(".defect")).to_have_count(count)
        expect(self.page.locator(".save")).to_have_text("Saved")

    def observations(self) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = json.load(self.server.ask("GET", self.path))["observations"]
        return found

    def go_to(self, place: str) -> None:
        self.press("g")
        self.page.get_by_role("textbox", name="Distance, time, frame or joint").fill(place)
        self.press("Enter")
        expect(self.page.get_by_role("dialog")).to_have_count(0)


@pytest.fixture(scope="module")
def culvert(tmp_path_factory: pytest.TempPathFactory) -> SimulatedRun:
    """1 m in small pictures of a lens that sees the wall on both sides."""
    wide = SCENARIOS["wide_lens"]
    scenario = replace(wide, rig=Rig.parse(half_size(wide.rig)), length_mm=LENGTH_MM)
    return simulate(scenario, tmp_path_factory.mktemp("culvert"))


def test_a_past_video_is_reviewed(page: Page, server: Server, culvert: SimulatedRun) -> None:
    true_m = _true_distances_m(culvert.truth)
    log_in(page, server, "/new")
    inspection = start_inspection(page, server, culvert.video, culvert.rig, "Past culvert")
    wait_until_done(page)
    desk = Desk(page, server, f"/api/inspections/{inspection}/observations")

    _play_by_keys(desk, last=len(true_m) - 1)
    _tag_in_every_view(desk)
    [by_key] = [item for item in desk.observations() if item["code"] == "BAB"]
    assert by_key["distance_m"] == pytest.approx(true_m[by_key["frame"]], abs=TOLERANCE_M)

    _go_from_defect_to_defect(desk)
    _edit(desk)
    _undo_and_redo(desk)
    _open_permalink(desk)
    _expect_exports_to_agree(desk)


def _play_by_keys(desk: Desk, last: int) -> None:
    """J, K, L, single frames and places."""
    desk.press("Home")
    desk.expect_frame(0)
    desk.press("l")
    expect(desk.page.get_by_role("button", name="Pause")).to_be_visible()
    desk.expect_frame(r"[1-9]\d")
    desk.press("k")
    expect(desk.page.get_by_role("button", name="Play", exact=True)).to_be_visible()
    desk.press("End")
    desk.expect_frame(last)
    desk.press("ArrowLeft")
    desk.expect_frame(last - 1)
    desk.press("ArrowRight")
    desk.expect_frame(last)
    desk.go_to("#20")
    desk.expect_frame(20)
    desk.press("j", "j")
    desk.expect_frame(0)
    desk.go_to("#40")
    desk.expect_frame(40)
    desk.go_to("0.495")  # a frame every centimetre, at 0.485, 0.495, 0.505 m
    expect(desk.page.locator(".readout__distance")).to_contain_text(re.compile(r"0\.(49|50)"))


def _tag_in_every_view(desk: Desk) -> None:
    """On the film by key and by click, on the unrolled wall, on the wall of the 3D view."""
    page = desk.page
    desk.press("1")
    desk.expect_defects(1)

    desk.go_to("0.795")
    expect(page.locator(".readout__distance")).to_contain_text(re.compile(r"0\.(79|80)"))
    _click(page.locator(".stage__overlay"), 0.5, 0.4)
    desk.expect_defects(2)

    page.wait_for_function("() => document.querySelector('wall-strip')?.pictures?.count > 0")
    page.get_by_role("button", name="Tag", exact=True).click()
    _click(page.locator(".wall__track"), 0.75, 0.6)
    desk.expect_defects(3)

    with drawn_in_3d(page) as other:
        expect_read(other)
        Desk(other, desk.server, desk.path).go_to("0.795")
        # In the view that follows the robot, wall that it has seen is all around it.
        view = other.locator("viewer-panel iframe")
        _expect_a_picture_in_3d(view)
        other.keyboard.down("Shift")
        _click(view, 0.4, 0.85)
        other.keyboard.up("Shift")
        expect(other.locator(".defect")).to_have_count(4)
        expect_saved(other)
    desk.expect_defects(4)


def _expect_a_picture_in_3d(view: Locator) -> None:
    """Wait for the culvert with its lights, and the robot: it is yellow, nothing else is."""
    for _ in range(DRAWN_LIMIT):
        pixels = cv2.imdecode(np.frombuffer(view.screenshot(), np.uint8), cv2.IMREAD_COLOR)
        colours = len(np.unique(pixels.reshape(-1, 3), axis=0))
        blue, green, red = (pixels[..., i].astype(int) for i in range(3))
        yellow = np.count_nonzero((red > 120) & (red - blue > 60) & (green - blue > 30))
        if colours > DISTINCT_COLOURS and yellow > ROBOT_PIXELS:
            return
    pytest.fail(f"The 3D view has {colours} colours and {yellow} pixels of a robot.")


def _go_from_defect_to_defect(desk: Desk) -> None:
    """N and P, in the order along the pipe."""
    frames = [item["frame"] for item in sorted(desk.observations(), key=_distance_m)]
    desk.press("Escape", "n")
    desk.expect_frame(frames[0])
    desk.press("n")
    desk.expect_frame(frames[1])
    desk.press("p")
    desk.expect_frame(frames[0])


def _edit(desk: Desk) -> None:
    """The selected one, by the form and its dial."""
    page = desk.page
    desk.press("e")
    code = page.get_by_label("Code", exact=True)
    code.fill("BAB B A")
    code.press("Enter")
    page.get_by_label("Quantity", exact=True).fill("1.5")
    page.get_by_label("Remark").fill("=widens to the left")
    start, end = (page.get_by_role("slider", name=f"Clock {name}") for name in ("from", "to"))
    start.focus()
    desk.press("ArrowRight")
    end.focus()
    desk.press("ArrowRight")
    page.get_by_role("button", name="Done").click()
    desk.press("Shift+Digit4")
    desk.expect_defects(4)
    edited = min(desk.observations(), key=_distance_m)
    assert (edited["code"], edited["char1"], edited["quant1"]) == ("BAB", "B", 1.5)
    assert (edited["severity"], edited["remark"]) == (4, "=widens to the left")
    assert edited["clock_from"] is not None
    assert edited["clock_to"] is not None


def _undo_and_redo(desk: Desk) -> None:
    desk.press("u")
    expect(desk.page.locator(".toast").last).to_contain_text("Undone: severity")
    desk.expect_defects(4)
    assert min(desk.observations(), key=_distance_m)["severity"] is None
    desk.press("Shift+U")
    expect(desk.page.locator(".toast").last).to_contain_text("Redone: severity")
    desk.expect_defects(4)
    assert min(desk.observations(), key=_distance_m)["severity"] == 4
    desk.press("Delete")
    desk.expect_defects(3)
    desk.press("u")
    desk.expect_defects(4)


def _open_permalink(desk: Desk) -> None:
    """The address of the selected defect, in another tab, shows that very one."""
    rows = desk.page.locator(".defect__main")
    rows.nth(2).click()
    desk.page.wait_for_url("**?defect=*")
    frame = desk.page.locator(".transport__frame")
    wanted = sorted(desk.observations(), key=_distance_m)[2]
    desk.expect_frame(wanted["frame"])
    other = another_tab(desk.page)
    other.goto(desk.page.url)
    expect(other.locator(".transport__frame")).to_have_text(frame.inner_text())
    expect(other.locator(".defect [aria-current=true]")).to_have_count(1)
    other.close()


def _expect_exports_to_agree(desk: Desk) -> None:
    page = desk.page
    observations = {item["seq"]: item for item in desk.observations()}
    rows = list(csv.DictReader(io.StringIO(export(page, "CSV").decode("utf-8-sig"))))
    report = json.loads(export(page, "JSON"))
    assert len(rows) == len(report["observations"]) == len(observations) == 4
    for row in [*rows, *report["observations"]]:
        item = observations[int(row["seq"])]
        assert float(row["distance_m"]) == pytest.approx(item["distance_m"], abs=1e-3)
        assert int(row["frame"]) == item["frame"]
    # A spreadsheet must not take a remark for a formula.
    assert [row["remark"] for row in rows if row["remark"]] == ["'=widens to the left"]


def _distance_m(item: dict[str, Any]) -> float:
    return float(item["distance_m"])


def _true_distances_m(path: Path) -> list[float]:
    with path.open(newline="") as file:
        return [float(row["distance_mm"]) / 1000 for row in csv.DictReader(file)]


def _click(place: Locator, across: float, down: float) -> None:
    box = place.bounding_box()
    assert box is not None
    place.page.mouse.click(box["x"] + across * box["width"], box["y"] + down * box["height"])
