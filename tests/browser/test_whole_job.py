"""From a video file to a located, tagged and exported inspection, as an operator does it."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import half_size
from playwright.sync_api import Page, expect
from steps import Server, export, export_track, log_in, start_inspection, wait_until_done

from app.lab.simulation import SCENARIOS, SimulatedRun, simulate
from vo_core.rig import Rig

TOLERANCE_M = 0.005
"""What the issue asks of tagged distances on the nominal scenario."""
LENGTH_MM = 1000.0


@pytest.fixture(scope="module")
def culvert(tmp_path_factory: pytest.TempPathFactory) -> SimulatedRun:
    nominal = SCENARIOS["nominal"].shortened(LENGTH_MM)
    small = replace(nominal, rig=Rig.parse(half_size(nominal.rig)))
    return simulate(small, tmp_path_factory.mktemp("culvert"))


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One that tracks slowly: the picture moves while it is tagged."""
    with Server(tmp_path_factory.mktemp("data"), pace="2") as running:
        yield running


def test_a_video_becomes_an_exported_inspection(
    page: Page, server: Server, culvert: SimulatedRun
) -> None:
    truth_m = _true_distances_m(culvert.truth)
    log_in(page, server, "/new")
    inspection = start_inspection(page, server, culvert.video, culvert.rig, "Culvert under test")

    # While it is tracked the distance rises, and a tag of the moving picture is taken at once.
    _expect_distance_beyond(page, 0.1)
    page.keyboard.press("4")
    expect(page.locator(".defect")).to_have_count(1)
    _expect_distance_beyond(page, 0.3)
    wait_until_done(page)

    # Review: a tag by key and one by click, each at a frame of its own.
    _go_to_time(page, 0.35)
    page.keyboard.press("1")
    expect(page.locator(".defect")).to_have_count(2)
    _go_to_time(page, 0.7)
    stage = page.locator(".stage__overlay").bounding_box()
    assert stage is not None
    page.mouse.click(stage["x"] + stage["width"] * 0.62, stage["y"] + stage["height"] * 0.4)
    expect(page.locator(".defect")).to_have_count(3)
    expect(page.locator(".save")).to_have_text("Saved")

    # After a reload everything is there again, photos included.
    page.reload()
    expect(page.locator(".defect")).to_have_count(3)
    expect(page.locator(".defect img:visible")).to_have_count(3)

    # Every stated distance, in the list and in the exports, is the true one.
    observations = _observations(page, inspection)
    rows = list(csv.DictReader(io.StringIO(export(page, "CSV").decode("utf-8-sig"))))
    report = json.loads(export(page, "JSON"))
    track = export_track(page).decode()
    assert [row["code"] for row in rows].count("BAB") == 1
    assert len(report["observations"]) == len(rows) == 3
    assert sum(not line.startswith("#") for line in track.splitlines()) == len(truth_m) + 1
    exported = {int(row["seq"]): float(row["distance_m"]) for row in rows}
    for item in observations:
        true_m = truth_m[item["frame"]] + _offset_m(item["pixel"], culvert.rig)
        assert item["distance_m"] == pytest.approx(true_m, abs=TOLERANCE_M)
        assert exported[item["seq"]] == pytest.approx(true_m, abs=TOLERANCE_M)


def _true_distances_m(path: Path) -> list[float]:
    with path.open(newline="") as file:
        return [float(row["distance_mm"]) / 1000 for row in csv.DictReader(file)]


def _offset_m(pixel: list[float], rig: Path) -> float:
    """How far ahead of the camera the wall point of a pixel lies (rotation 0: right is ahead).

    Along the row through the middle the wall is the invert, `height` below; above and below it the
    wall of the pipe rises, which brings it a little nearer: the ray meets it at the fraction t.
    """
    fields = json.loads(rig.read_text())
    camera, height = fields["camera"], fields["mount"]["height_mm"]
    radius = fields["pipe"]["diameter_mm"] / 2
    ahead = (pixel[0] - camera["cx"]) / camera["fx"]
    aside = (pixel[1] - camera["cy"]) / camera["fy"]
    # (t aside)^2 + (t - (height - radius))^2 = radius^2, camera at height - radius above the axis
    rise = height - radius
    a, b, c = aside**2 + 1, -2 * rise, rise**2 - radius**2
    t = (-b + np.sqrt(b * b - 4 * a * c)) / (2 * a)
    return float(ahead * t / 1000)


def _expect_distance_beyond(page: Page, metres: float) -> None:
    page.wait_for_function(
        "m => Number(document.querySelector('.readout__distance span')?.textContent) > m",
        arg=metres,
        timeout=60_000,
    )


def _go_to_time(page: Page, share: float) -> None:
    """To this share of the film, by the time slider."""
    clock = page.locator(".transport__clock")
    before = clock.inner_text()
    box = page.get_by_label("Time in the video").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
    expect(clock).not_to_have_text(before)
    expect(page.locator(".stage__note")).to_be_hidden()


def _observations(page: Page, inspection: str) -> list[dict]:
    answer = page.request.get(
        f"{page.url.split('/inspections')[0]}/api/inspections/{inspection}/observations"
    )
    return answer.json()["observations"]
