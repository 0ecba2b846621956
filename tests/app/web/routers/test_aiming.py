"""The rig of a camera that looks along the pipe, by pictures of its film."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from builders import Client, assert_error

from app.lab.simulation import SCENARIOS, simulate
from vo_core import Rig
from vo_core.geometry.wall import robot_pixels

CROOKED = replace(SCENARIOS["forward_crooked"], length_mm=20.0)
TRUE_PITCH_DEG = CROOKED.true_rig.mount.pitch_deg if CROOKED.true_rig else 0.0
FOUND_WITHIN_DEG = 3.0
"""`vo_core.geometry.gaze.SIGMA_RAD`: by one picture the axis is not known better."""


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Looks 3 degrees down, which its rig does not say."""
    return simulate(CROOKED, tmp_path_factory.mktemp("crooked")).video


def stated(**mount: Any) -> dict[str, Any]:
    rig = CROOKED.rig.model_dump(mode="json")
    return rig | {"mount": rig["mount"] | mount}


def test_a_picture_comes_with_its_axis_which_states_the_pitch(shared: Client, film: Path) -> None:
    upload = shared.upload(film.read_bytes())
    seen = shared.get(f"/api/uploads/{upload}/axis").json()
    assert (seen["width"], seen["height"]) == (CROOKED.rig.camera.width, CROOKED.rig.camera.height)
    assert seen["pixel_aspect"] == 1
    assert 0 < seen["sure"] <= seen["looked_at"]
    at = {"time_s": seen["time_s"]}
    assert shared.get(f"/api/uploads/{upload}/axis", params=at).json()["axis"] == seen["axis"]
    answer = shared.get(f"/api/uploads/{upload}/picture", params=at)
    assert answer.headers["Content-Type"] == "image/jpeg"
    picture = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    assert picture.shape[:2] == (seen["height"], seen["width"])
    aim = shared.post("/api/aim", json={"rig": stated(), "axis": seen["axis"]}).json()
    assert aim["pitch_deg"] == pytest.approx(TRUE_PITCH_DEG, abs=FOUND_WITHIN_DEG)
    # The upload is still there, and can become an inspection.
    assert shared.get(f"/api/uploads/{upload}/axis").status_code == 200


def test_a_page_may_ask_for_everything_at_once(shared: Client, film: Path) -> None:
    upload = shared.upload(film.read_bytes())
    source = {"kind": "upload", "upload_id": upload}
    made = {"name": "Crooked", "source": source, "rig": stated(), "counter": {"is_present": False}}
    asked = [f"/api/uploads/{upload}/{what}" for what in 2 * ("picture", "axis")]
    with ThreadPoolExecutor(len(asked)) as threads:
        assert [each.status_code for each in threads.map(shared.get, asked)] == [200] * len(asked)
        threads.submit(shared.get, asked[0])
        # An inspection waits for who still reads.
        assert shared.post("/api/inspections", json=made).status_code == 201


def test_a_rig_says_where_it_has_the_axis_itself(shared: Client) -> None:
    aim = shared.post("/api/aim", json={"rig": stated(pitch_deg=0.0), "axis": None}).json()
    camera = CROOKED.rig.camera
    assert aim["axis"] == pytest.approx([camera.cx, camera.cy], abs=0.1)
    up = shared.post("/api/aim", json={"rig": stated(pitch_deg=40.0), "axis": None}).json()
    assert (up["axis"], up["pitch_deg"]) == (None, 40.0)


def test_a_film_that_was_tracked_with_another_view_says_so_and_shows_its_pictures(
    shared: Client, film: Path
) -> None:
    source = {"kind": "upload", "upload_id": shared.upload(film.read_bytes())}
    made = {"name": "Down", "source": source, "rig": stated(view="down")}
    inspection = shared.post("/api/inspections", json=made).json()["id"]
    shared.wait(inspection)
    strict = {"within_m": 1e-6, "percent": 0.0}
    usual = shared.get("/api/intended-use").json()
    shared.put("/api/intended-use", json=strict)
    try:
        (cause, *_) = shared.get(f"/api/inspections/{inspection}/diagnosis").json()["causes"]
    finally:
        shared.put("/api/intended-use", json=usual)
    assert (cause["code"], cause["repair"]) == ("looks_along", "axis")
    seen = shared.get(f"/api/inspections/{inspection}/axis").json()
    assert seen["axis"] is not None
    at = {"time_s": seen["time_s"]}
    answer = shared.get(f"/api/inspections/{inspection}/picture", params=at)
    assert answer.headers["Content-Type"] == "image/jpeg"


@pytest.mark.parametrize(("pitch_deg", "said_deg"), [(-3.0, 0.0), (5.0, 4.0)])
def test_the_pitch_is_that_of_the_axis_whatever_the_rig_said(
    shared: Client, pitch_deg: float, said_deg: float
) -> None:
    """Ahead and a tenth to the right: the camera looks 5.7 degrees to the left of the axis."""
    true = Rig.parse(stated(pitch_deg=pitch_deg, roll_deg=1.0))
    ((u, v),) = robot_pixels(true, np.array([[1.0, 0.1, 0.0]])).tolist()
    rig = stated(pitch_deg=said_deg, roll_deg=1.0)
    aim = shared.post("/api/aim", json={"rig": rig, "axis": [u, v]}).json()
    assert aim["pitch_deg"] == pytest.approx(pitch_deg, abs=0.01)
    assert aim["right_deg"] == pytest.approx(-np.degrees(np.arctan(0.1)), abs=0.01)
    ends = [line[-1] for line in aim["generators"]]
    # 30 radii ahead, from a camera off the axis: 1 px is 0.14 degrees here.
    assert np.mean(ends, axis=0) == pytest.approx([u, v], abs=4)


def test_a_film_that_is_none_and_a_rig_that_is_none_are_refused_with_the_reason(
    shared: Client,
) -> None:
    upload = shared.upload(b"Once upon a time there was a culvert.", "story.mp4")
    refused = shared.get(f"/api/uploads/{upload}/picture")
    assert "story.mp4" in assert_error(refused, 422, "unreadable_video")
    answer = shared.post("/api/aim", json={"rig": {"camera": {}}, "axis": [1, 1]})
    assert_error(answer, 422, "invalid_rig")
    floor = stated() | {"pipe": {"shape": "flat"}}
    answer = shared.post("/api/aim", json={"rig": floor, "axis": [1, 1]})
    assert "no rings" in assert_error(answer, 422, "invalid_rig")


def test_a_rig_is_judged_and_ruled_before_any_drive(shared: Client) -> None:
    ruler = shared.post("/api/rig/ruling", json={"rig": stated()}).json()
    assert ruler["step_mm"] == 100
    assert [line["at"] for line in ruler["along"]] == list(range(1, 13))
    advice = shared.post("/api/rig/advice", json={"rig": stated()}).json()
    assert (advice["verdict"], advice["findings"]) == ("fit with care", ["forward"])
    assert 0 < advice["good_speed_mm_s"] < advice["limit_speed_mm_s"]
    assert advice["seen_mm"] > advice["mm_per_px"] > 0
    for path in ("/api/rig/ruling", "/api/rig/advice"):
        refused = shared.post(path, json={"rig": stated(height_mm=0.25)})
        assert "mount.height_mm" in assert_error(refused, 422, "invalid_rig")
