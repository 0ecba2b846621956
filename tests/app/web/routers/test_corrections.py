"""Corrections over HTTP: what was stated moves every distance, and the record says why."""

from __future__ import annotations

import csv
import io
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from builders import (
    HEIGHT_MM,
    STEP_MM,
    Client,
    assert_error,
    clip_rig,
    make_clip,
    serving,
    wait_until,
)

from app.survey.distances.interval import half_width_m
from vo_core import Track
from vo_core.joints.sightings import Sighting, to_csv

FRAMES = 160
TRUE_M = (FRAMES - 1) * STEP_MM / 1000
WRONG = 0.95
"""The rig of these tests states a height that is too small by 5 %, so that all is too short."""


def wrong_rig() -> dict[str, Any]:
    rig = clip_rig()
    rig["mount"]["height_mm"] = WRONG * HEIGHT_MM
    rig["pipe"]["segment_length_mm"] = 100.0
    rig["tolerance"] = {"height_mm": 5.0, "segment_length_mm": 0.3}
    return rig


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_clip(tmp_path_factory.mktemp("clips") / "drive.mp4", FRAMES)


@pytest.fixture(scope="module")
def tracked(shared: Client, drive: Path) -> str:
    inspection_id = shared.inspect(drive, rig=wrong_rig())
    assert shared.wait(inspection_id)["status"] == "done"
    return inspection_id


@pytest.fixture
def run(shared: Client, tracked: str) -> Iterator[str]:
    """A tracked inspection; what a test states and tags is taken back."""
    joints = shared.data / "inspections" / tracked / "joints.csv"
    seen = joints.read_bytes()
    yield tracked
    joints.write_bytes(seen)
    path = f"/api/inspections/{tracked}"
    shared.put(f"{path}/corrections", json={}).raise_for_status()
    for tag in shared.get(f"{path}/observations").json()["observations"]:
        shared.delete(f"{path}/observations/{tag['id']}")


def stated(**fields: Any) -> dict[str, Any]:
    return {
        "zero": None, "lengths": [], "joints": {"use": None, "marked": [], "left_out": []},
        "rig_sigma": None, "typed": [], "forced": None,
    } | fields  # fmt: skip


def whole(length_m: float = TRUE_M, kind: str = "known", sigma_mm: float = 1.0) -> dict[str, Any]:
    return {
        "first_frame": 0, "last_frame": FRAMES - 1, "length_m": length_m, "sigma_mm": sigma_mm,
        "kind": kind,
    }  # fmt: skip


TAPED = stated(lengths=[whole(kind="tape")])


def put(client: Client, run: str, body: dict[str, Any], **more: Any) -> Any:
    return client.put(f"/api/inspections/{run}/corrections", json=body | more)


def correct(client: Client, run: str, body: dict[str, Any], **more: Any) -> dict[str, Any]:
    answer = put(client, run, body, **more)
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def track_of(client: Client, run: str, **query: Any) -> Track:
    return Track.from_csv(client.get(f"/api/inspections/{run}/track", params=query).text)


def test_a_taped_length_moves_every_distance_that_is_shown(shared: Client, run: str) -> None:
    shared.tag(run, frame=100, code="BAB", continuous="A1")
    shared.tag(run, frame=150, code="BAB", continuous="B1", pixel=[200.0, 100.0])
    before = shared.get(f"/api/inspections/{run}/observations").json()["observations"]
    revision = shared.inspection(run)["revision"]
    after_put = correct(shared, run, TAPED, remark="taped along the invert")
    assert after_put["result"]["scale"] == pytest.approx(1 / WRONG, rel=0.002)
    height = after_put["result"]["height"]
    assert height["height_mm"] == pytest.approx(HEIGHT_MM, abs=3 * height["sigma_mm"])

    view = shared.inspection(run)
    assert (view["revision"], view["corrected"]) == (revision + 1, True)
    assert view["distance_m"] == pytest.approx(TRUE_M, abs=0.0005)
    assert view["distance_raw_m"] == pytest.approx(WRONG * TRUE_M, rel=0.002)
    (listed,) = [i for i in shared.get("/api/inspections").json()["inspections"] if i["id"] == run]
    assert listed["distance_m"] == view["distance_m"]

    first, second = shared.get(f"/api/inspections/{run}/observations").json()["observations"]
    assert first["distance_m"] == pytest.approx(100 * STEP_MM / 1000, abs=0.0005)
    assert first["distance_raw_m"] == before[0]["distance_m"]
    ahead_mm = (200.0 - 127.5) * 0.8  # of the wall at the true height
    assert second["distance_m"] == pytest.approx((150 * STEP_MM + ahead_mm) / 1000, abs=0.001)
    assert second["distance_raw_m"] == before[1]["distance_m"]
    wall = shared.get(
        f"/api/inspections/{run}/wall", params={"frame": 150, "u": 200, "v": 100}
    ).json()
    assert wall["distance_m"] == second["distance_m"]

    table = shared.get(f"/api/inspections/{run}/exports/csv").content.decode("utf-8-sig")
    row = next(csv.DictReader(io.StringIO(table)))
    assert float(row["distance_m"]) == pytest.approx(first["distance_m"], abs=0.0006)
    assert float(row["distance_raw_m"]) == pytest.approx(first["distance_raw_m"], abs=0.0006)
    length_m = second["distance_m"] - first["distance_m"]
    assert float(row["cont_length_m"]) == pytest.approx(length_m, abs=0.001)
    report = shared.get(f"/api/inspections/{run}/exports/json").json()
    assert report["corrections"]["stated"] == TAPED
    assert report["corrections"]["result"]["scale"] == after_put["result"]["scale"]
    assert report["inspection"]["distance_raw_m"] == pytest.approx(WRONG * TRUE_M, rel=0.01)


def test_the_track_is_returned_corrected_and_raw(shared: Client, run: str) -> None:
    raw = track_of(shared, run)
    correct(shared, run, TAPED | {"zero": {"frame": 20, "offset_m": 0.35}})
    text = shared.get(f"/api/inspections/{run}/track").text
    assert "# zero: frame 20 at 0.350 m\n" in text
    assert "\n# scale: 1.05" in text
    corrected = Track.from_csv(text)
    assert corrected.distance_mm[20] == pytest.approx(350, abs=0.001)
    assert corrected.x_mm == pytest.approx(corrected.distance_mm)
    assert corrected.sigma_distance_mm[20] == 0
    still_raw = track_of(shared, run, raw=True)
    assert still_raw.distance_mm == pytest.approx(raw.distance_mm)
    kept = Track.from_csv((shared.data / "inspections" / run / "track.csv").read_text("utf-8"))
    assert kept.distance_mm == pytest.approx(raw.distance_mm)
    json = shared.get(f"/api/inspections/{run}/track?format=json&since=100").json()["columns"]
    assert json["frame"] == list(range(100, FRAMES))
    assert json["distance_raw_mm"] == pytest.approx(raw.distance_mm[100:])
    assert json["distance_mm"] == pytest.approx(corrected.distance_mm[100:])
    tum = shared.get(f"/api/inspections/{run}/track?format=tum").text.split("\n")[20].split()
    assert float(tum[1]) == pytest.approx(0.35)


def test_the_zero_moves_expected_joints_and_what_is_to_go(shared: Client, run: str) -> None:
    shared.patch(f"/api/inspections/{run}", json={"header": {"known_length_m": 2.0}})
    tag = shared.tag(run, frame=0).json()
    before = shared.get(f"/api/inspections/{run}/corrections").json()["result"]
    assert before["expected_joints"] == []
    now = correct(shared, run, stated(zero={"frame": 0, "offset_m": 0.52}))
    assert [joint["number"] for joint in now["result"]["expected_joints"]] == [6, 7]
    moved = shared.get(f"/api/inspections/{run}/observations/{tag['id']}").json()
    assert moved["distance_m"] == pytest.approx(0.52)
    assert (moved["at_joint"], moved["joint_no"]) == (False, None)
    row = shared.get(f"/api/inspections/{run}/exports/json").json()["observations"][0]
    assert row["distance_to_go_m"] == pytest.approx(1.48)
    assert (row["distance_source"], row["distance_raw_m"]) == ("odometry", 0)


def test_joints_that_were_seen_correct_and_number(shared: Client, run: str) -> None:
    raw = track_of(shared, run)
    frames = (10, 70, 130)
    seen = [
        Sighting(frame, float(at * WRONG - raw.distance_mm[frame]), 0.1, -0.3)
        for frame, at in zip(frames, (30.0, 130.0, 230.0), strict=True)
    ]
    joints = shared.data / "inspections" / run / "joints.csv"
    joints.write_text(to_csv(raw, seen, {}))
    tag = shared.tag(run, frame=85).json()
    use = {"use": True, "marked": [], "left_out": []}
    found = correct(shared, run, stated(joints=use))["result"]
    assert found["scale"] == pytest.approx(1 / WRONG, rel=0.01)
    assert [(joint["frame"], joint["number"]) for joint in found["joints"]] == [
        (10, 0), (70, 1), (130, 2),
    ]  # fmt: skip
    moved = shared.get(f"/api/inspections/{run}/observations/{tag['id']}").json()
    assert (moved["joint_no"], moved["distance_source"]) == (1, "joint")
    without = use | {"left_out": [{"frame": frame} for frame in frames]}
    answer = put(shared, run, stated(joints=without))
    assert "No joints were seen" in assert_error(answer, 422, "invalid_correction")
    body = stated(joints=without)
    preview = shared.post(f"/api/inspections/{run}/corrections/preview", json=body).json()
    assert preview["reason"] == {"code": "no_joints", "params": {}}
    assert "No joints were seen" in preview["error"]["detail"]


def test_a_preview_shows_the_residual_and_stores_nothing(shared: Client, run: str) -> None:
    revision = shared.inspection(run)["revision"]
    body = stated(lengths=[whole(1.3 * TRUE_M, sigma_mm=1)])
    answer = shared.post(f"/api/inspections/{run}/corrections/preview", json=body)
    assert answer.status_code == 200
    preview = answer.json()
    assert preview["error"]["code"] == "invalid_correction"
    closure = preview["result"]["closure"]
    assert closure["known_length_m"] == pytest.approx(1.3 * TRUE_M, abs=0.0005)
    assert closure["measured_m"] == pytest.approx(WRONG * TRUE_M, rel=0.002)
    assert closure["residual_mm"] == pytest.approx(-0.35 * 1000 * TRUE_M, rel=0.01)
    good = stated(lengths=[whole()])
    preview = shared.post(f"/api/inspections/{run}/corrections/preview", json=good).json()
    assert preview["error"] is None
    assert preview["result"]["scale"] == pytest.approx(1 / WRONG, rel=0.002)
    impossible = stated(zero={"frame": 5000, "offset_m": 0.0})
    preview = shared.post(f"/api/inspections/{run}/corrections/preview", json=impossible).json()
    assert preview["result"] is None
    assert "no frame 5000" in preview["error"]["detail"]
    assert shared.get(f"/api/inspections/{run}/corrections").json()["stated"] == stated()
    assert shared.inspection(run)["revision"] == revision


def test_a_length_that_cannot_be_is_refused_until_it_is_forced(shared: Client, run: str) -> None:
    revision = shared.inspection(run)["revision"]
    body = stated(lengths=[whole(1.3 * TRUE_M)])
    said = assert_error(put(shared, run, body), 422, "invalid_correction")
    assert "-89 mm (-26.9" in said
    assert "wrong asset" in said
    assert shared.inspection(run)["revision"] == revision
    assert_error(put(shared, run, body | {"forced": "  "}), 422, "invalid_request")
    forced = correct(shared, run, body | {"forced": "two tapes agree"})
    assert forced["result"]["scale"] == pytest.approx(1.3 / WRONG, rel=0.002)
    assert forced["error"] is None
    warned = [c for c in checks_of(shared, run) if c["code"] == "length_forced"]
    assert warned[0]["params"]["residual_mm"] == pytest.approx(-89, abs=1)


def test_one_interval_is_shown_everywhere_and_a_tape_shrinks_it(shared: Client, run: str) -> None:
    tag = shared.tag(run, frame=FRAMES - 1).json()

    def shown_intervals() -> set[float]:
        path = f"/api/inspections/{run}"
        rows = list(csv.DictReader(io.StringIO(shared.get(f"{path}/exports/csv").text)))
        columns = shared.get(f"{path}/track?format=json").json()["columns"]
        observation = shared.get(f"{path}/observations/{tag['id']}").json()
        corrected = shared.get(f"{path}/corrections").json()["result"]
        report = shared.get(f"{path}/exports/json").json()
        listed = shared.get("/api/inspections").json()["inspections"]
        return {
            float(rows[0]["distance_u95_m"]),
            half_width_m(columns["sigma_distance_mm"][-1]),
            observation["distance_u95_m"],
            corrected["distance_class"]["half_width_m"],
            report["inspection"]["distance_u95_m"],
            report["observations"][0]["distance_u95_m"],
            shared.inspection(run)["distance_u95_m"],
            *(i["distance_u95_m"] for i in listed if i["id"] == run),
        }

    (before,) = shown_intervals()
    correct(shared, run, TAPED)
    (after,) = shown_intervals()
    assert after == 0.01 < before


def test_every_correction_is_in_the_record_and_can_be_undone(shared: Client, run: str) -> None:
    revision = shared.inspection(run)["revision"]
    correct(shared, run, TAPED, remark="taped")
    correct(shared, run, TAPED, remark="the same again")
    zero = stated(zero={"frame": 3, "offset_m": 0.1})
    correct(shared, run, zero)
    newest, older, *_ = shared.get(f"/api/inspections/{run}/events").json()["events"]
    assert (newest["action"], newest["who"], newest["remark"]) == ("corrected", "server", None)
    assert (newest["before"], newest["after"]) == (TAPED, zero)
    assert (older["before"], older["after"], older["remark"]) == (stated(), TAPED, "taped")
    assert older["observation_id"] is None
    correct(shared, run, newest["before"])
    correct(shared, run, older["before"])
    view = shared.inspection(run)
    assert (view["revision"], view["corrected"]) == (revision + 4, False)
    assert view["distance_m"] == view["distance_raw_m"]


def test_the_record_of_one_observation(shared: Client, run: str) -> None:
    name = shared.tag(run, frame=3, code="BAB").json()["id"]
    shared.tag(run, name, frame=4, code="BAC")
    shared.tag(run, frame=5)
    path = f"/api/inspections/{run}/events"
    changed, created = shared.get(path, params={"observation": name}).json()["events"]
    assert created["before"] is None
    assert (changed["before"]["frame"], changed["after"]["frame"]) == (3, 4)
    assert changed["at"] >= created["at"]
    assert_error(shared.get(path, params={"observation": "x"}), 422, "invalid_request")
    nowhere = f"/api/inspections/{'0' * 32}/events"
    assert_error(shared.get(nowhere), 404, "inspection_not_found")


def test_what_is_no_correction_is_said(shared: Client, done: str) -> None:
    for body in (
        {"zero": {"frame": -1, "offset_m": 0.0}},
        {"lengths": [whole() | {"kind": "guess"}]},
        {"lengths": [whole() | {"length_m": 0.0}]},
        {"lengths": [whole() | {"sigma_mm": 0.0}]},
        {"rig_sigma": {"height_mm": 0.0, "focal_px": 0.0}},
        {"joints": {"use": 1}},
        {"joints": {"use": True, "marked": [{"frame": 1, "pixel": [1.0]}]}},
        {"more": 1},
    ):
        assert_error(put(shared, done, body), 422, "invalid_request")


def test_a_zero_set_while_it_is_tracked_counts_at_once(tmp_path: Path, long_clip: Path) -> None:
    with serving(tmp_path, pace=0.5) as client:
        run = client.inspect(long_clip)
        wait_until(lambda: client.inspection(run)["progress"]["frames_done"] > 30)
        early = put(client, run, stated(zero={"frame": 280, "offset_m": 0.0}))
        assert "no frame 280" in assert_error(early, 422, "invalid_correction")
        correct(client, run, stated(zero={"frame": 20, "offset_m": 5.0}))
        view = client.inspection(run)
        assert view["status"] == "running"
        assert view["distance_m"] - view["distance_raw_m"] == pytest.approx(
            5 - 20 * STEP_MM / 1000, abs=0.001
        )
        growing = track_of(client, run)
        assert growing.distance_mm[20] == pytest.approx(5000, abs=0.001)
        assert len(growing) > 30
        client.post(f"/api/inspections/{run}/cancel")
        ended = client.wait(run)
        assert ended["distance_m"] - ended["distance_raw_m"] == pytest.approx(
            5 - 20 * STEP_MM / 1000, abs=0.001
        )


def test_corrections_hold_in_another_run_and_what_it_does_not_reach_is_reported(
    shared: Client, own: str
) -> None:
    body = stated(
        zero={"frame": 30, "offset_m": 0.0}, rig_sigma={"height_mm": 2.0, "focal_px": 0.0}
    )
    correct(shared, own, body)
    before = shared.inspection(own)
    shared.post(f"/api/inspections/{own}/retry")
    shared.wait(own)
    now = shared.get(f"/api/inspections/{own}/corrections").json()
    assert (now["stated"], now["error"]) == (body, None)
    again = shared.inspection(own)["distance_m"]
    assert again == pytest.approx(before["distance_m"], abs=1e-4)

    (shared.data / "inspections" / own / "video.mp4").write_bytes(b"damaged")
    shared.post(f"/api/inspections/{own}/retry")
    assert shared.wait(own)["status"] == "failed"
    now = shared.get(f"/api/inspections/{own}/corrections").json()
    assert now["stated"]["zero"] == body["zero"]
    assert now["error"]["code"] == "invalid_correction"
    assert "no frame 30" in now["error"]["detail"]
    assert "correction_failed" in {check["code"] for check in checks_of(shared, own)}
    assert shared.inspection(own)["distance_m"] is None


def checks_of(client: Client, run: str) -> list[dict[str, Any]]:
    answer = client.get(f"/api/inspections/{run}/checks")
    assert answer.status_code == 200, answer.text
    return list(answer.json()["checks"])


def test_the_next_number_of_a_stretch_is_never_one_that_was_used(shared: Client, run: str) -> None:
    path = f"/api/inspections/{run}/observations"
    first = shared.get(path).json()["next_stretch"]
    shared.tag(run, frame=3, continuous=f"A{first}")
    gone = str(uuid.uuid4())
    shared.tag(run, gone, frame=4, continuous=f"A{first + 1}")
    shared.delete(f"{path}/{gone}")
    assert shared.get(path).json()["next_stretch"] == first + 2
