import hashlib
import signal
import uuid
from pathlib import Path
from typing import Any

import pytest
from builders import (
    FOCAL_PX,
    HEIGHT_MM,
    STEP_MM,
    Client,
    assert_error,
    clip_rig,
    frame_number,
    send_signal,
    wait_until,
)
from surveys import Survey, another

pytestmark = pytest.mark.usefixtures("photos_are_waited_for")


def path(inspection_id: str, name: str = "") -> str:
    return f"/api/inspections/{inspection_id}/observations" + (f"/{name}" if name else "")


def listed(client: Client, inspection_id: str) -> list[dict[str, Any]]:
    return list(client.get(path(inspection_id)).json()["observations"])


def test_a_tag_gets_its_distance_from_the_camera(shared: Client, done: str) -> None:
    tag = shared.tag(done, frame=30).json()
    assert tag["distance_m"] == pytest.approx(30 * STEP_MM / 1000, abs=0.001)
    assert tag["distance_u95_m"] >= 0
    assert tag["time_s"] == pytest.approx(1.2)
    assert tag["code"] is None
    assert tag["pixel"] is None
    assert tag["clock"] is None


def test_a_tag_with_a_pixel_gets_the_distance_of_that_wall_point(shared: Client, done: str) -> None:
    tag = shared.tag(done, frame=30, pixel=[27.5, 79.5]).json()
    assert tag["distance_m"] == pytest.approx((30 * STEP_MM - 80) / 1000, abs=0.001)


def test_everything_that_was_entered_comes_back(shared: Client, done: str) -> None:
    entered = {
        "frame": 12, "pixel": [3.5, 70.0], "code": "BAB", "char1": "B", "char2": "A",
        "quant1": 2.5, "quant2": 0.0, "clock_from": 10, "clock_to": 2, "severity": 4,
        "continuous": "A1", "remark": "crack, <b>wide</b>\nsecond line",
        "measures": [{"kind": "gap", "points": [
            {"frame": 12, "pixel": [40.0, 80.0]}, {"frame": 13, "pixel": [60.0, 80.0]}]}],
    }  # fmt: skip
    name = str(uuid.uuid4())
    assert shared.put(path(done, name), json=entered).status_code == 200
    tag = shared.get(path(done, name)).json()
    assert {field: tag[field] for field in entered} == entered
    assert tag["clock"] == 10
    assert tag in listed(shared, done)


WIDTH: dict[str, Any] = {
    "kind": "width",
    "points": [{"frame": 30, "pixel": [80.0, 79.5]}, {"frame": 30, "pixel": [180.0, 79.5]}],
}
WIDTH_MM = 100 * HEIGHT_MM / FOCAL_PX


def test_a_measure_of_a_tag_comes_with_its_figure(shared: Client, done: str) -> None:
    tag = shared.tag(done, frame=30, measures=[WIDTH]).json()
    (figure,) = tag["measured"]
    assert figure["value"] == pytest.approx(WIDTH_MM, rel=0.005)
    assert 0 < figure["u95"] < 0.1 * WIDTH_MM
    assert (figure["unit"], figure["percent"]) == ("mm", None)
    assert tag in listed(shared, done)


def test_a_size_is_measured_without_a_tag(shared: Client, done: str) -> None:
    measured = shared.post(f"/api/inspections/{done}/measure", json=WIDTH)
    assert measured.json() == shared.tag(done, frame=30, measures=[WIDTH]).json()["measured"][0]


def test_a_measure_outside_the_film_is_refused(shared: Client, done: str) -> None:
    for point, code in (
        ({"frame": 30, "pixel": [500.0, 10.0]}, "pixel_outside_picture"),
        ({"frame": 4000, "pixel": [10.0, 10.0]}, "frame_outside_video"),
    ):
        outside = {**WIDTH, "points": [WIDTH["points"][0], point]}
        assert_error(shared.tag(done, frame=30, measures=[outside]), 422, code)
        assert_error(shared.post(f"/api/inspections/{done}/measure", json=outside), 422, code)


def test_a_depth_on_a_floor_cannot_be_measured(shared: Client, done: str) -> None:
    depth = {**WIDTH, "kind": "depth"}
    assert_error(
        shared.post(f"/api/inspections/{done}/measure", json=depth), 404, "frame_not_found"
    )


def test_the_same_put_again_changes_nothing(shared: Client, done: str) -> None:
    name = str(uuid.uuid4())
    first = shared.tag(done, name, code="BAF").json()
    again = shared.tag(done, name, code="BAF").json()
    assert again == first
    assert sum(tag["id"] == name for tag in listed(shared, done)) == 1


def test_another_put_replaces_all_fields_and_keeps_the_number(shared: Client, done: str) -> None:
    name = str(uuid.uuid4())
    first = shared.tag(done, name, code="BAF", severity=2).json()
    edited = shared.tag(done, name, code="BBC").json()
    assert (edited["code"], edited["severity"]) == ("BBC", None)
    assert edited["seq"] == first["seq"]
    assert edited["edited_at"] is not None
    assert first["edited_at"] is None


def test_delete_is_undone_by_restore_and_both_may_be_repeated(shared: Client, own: str) -> None:
    first = shared.tag(own, code="BAB").json()
    for _ in range(2):
        assert shared.delete(path(own, first["id"])).status_code == 204
    assert listed(shared, own) == []
    assert shared.inspection(own)["defects"] == 0
    assert_error(shared.get(path(own, first["id"])), 404, "observation_not_found")
    second = shared.tag(own).json()
    assert second["seq"] == 2, "a number is never used twice"
    for _ in range(2):
        restored = shared.post(path(own, first["id"]) + "/restore").json()
        assert restored["id"] == first["id"]
        assert restored["code"] == "BAB"
    assert [tag["seq"] for tag in listed(shared, own)] == [1, 2]


def test_what_never_was_cannot_be_deleted(shared: Client, done: str) -> None:
    name = str(uuid.uuid4())
    assert_error(shared.delete(path(done, name)), 404, "observation_not_found")
    assert_error(shared.post(path(done, name) + "/restore"), 404, "observation_not_found")
    assert_error(shared.tag("0" * 32, name), 404, "inspection_not_found")


OUT_OF_BOUNDS: tuple[dict[str, Any], ...] = (
        {"frame": -1}, {"frame": 1.5}, {"frame": "3"}, {"frame": False}, {"frame": None},
        {"frame": 2**40}, {"pixel": [1]}, {"pixel": [1, 2, 3]}, {"pixel": [True, 2]},
        {"pixel": ["1", "2"]}, {"code": "bab"}, {"code": ""}, {"code": "ABCDEFGHI"},
        {"code": "=CMD()"},
        {"char1": "AAAAA"}, {"char1": "a"}, {"quant1": False}, {"quant1": "2"}, {"quant1": 1e9},
        {"clock_from": 0}, {"clock_from": 13}, {"clock_from": 3.5}, {"clock_to": True},
        {"severity": 6}, {"severity": -1}, {"severity": True}, {"continuous": "D1"},
        {"continuous": True}, {"continuous": "A0"}, {"remark": 5}, {"remark": "x" * 4001},
        {"remark": "a\x00b"}, {"distance_m": 3.0},
)  # fmt: skip


def test_fields_out_of_bounds_are_refused_by_name(shared: Client, done: str) -> None:
    taken = []
    for fields in OUT_OF_BOUNDS:
        answer = shared.tag(done, **fields)
        if answer.status_code != 422 or next(iter(fields)) not in answer.json()["detail"]:
            taken.append((fields, answer.text))
    assert not taken


def test_frame_and_pixel_must_be_in_the_video(shared: Client, done: str) -> None:
    assert shared.tag(done, frame=39).status_code == 200
    assert "its last one is 39" in assert_error(
        shared.tag(done, frame=40), 422, "frame_outside_video"
    )
    for pixel in ([256, 0], [-1, 0], [0, 160], [0, -0.6]):
        assert_error(shared.tag(done, pixel=pixel), 422, "pixel_outside_picture")
    assert shared.tag(done, pixel=[255.5, -0.5]).status_code == 200


def test_the_photo_is_of_exactly_that_frame_also_after_an_edit(shared: Client, done: str) -> None:
    name = str(uuid.uuid4())
    for frame in (7, 31):
        tag = shared.tag(done, name, frame=frame).json()
        assert tag["photo_error"] is None
        photo = shared.get(tag["photo"])
        assert photo.headers["Content-Type"] == "image/jpeg"
        assert frame_number(photo.content) == frame


def test_the_photo_is_on_the_disk_with_its_checksum(shared: Client, own: str) -> None:
    tag = shared.tag(own, frame=9).json()
    photos = shared.data / "inspections" / own / "photos"
    content = (photos / f"{tag['id']}-9.jpg").read_bytes()
    report = shared.get(f"/api/inspections/{own}/exports/json").json()
    sha256 = report["observations"][0]["photo_sha256"]
    assert sha256 == hashlib.sha256(content).hexdigest()


def test_a_tag_is_kept_when_its_photo_cannot_be_made(shared: Client, own: str) -> None:
    (shared.data / "inspections" / own / "video.mp4").write_bytes(b"damaged")
    tag = shared.tag(own, frame=3).json()
    assert tag["photo"] is None
    assert tag["photo_error"]
    assert tag["distance_m"] is not None


def test_a_media_process_that_dies_is_replaced(shared: Client, done: str) -> None:
    shared.tag(done, frame=2)
    send_signal("app.jobs.requests.media", signal.SIGKILL)
    tag = shared.tag(done, frame=3).json()
    again = shared.tag(done, frame=4).json()
    assert tag["photo_error"] is None or "SIGKILL" in tag["photo_error"]
    assert frame_number(shared.get(again["photo"]).content) == 4


def test_a_tag_is_located_once_its_frame_is_tracked_or_says_that_it_never_was(
    shared: Client, clip: Path, long_clip: Path
) -> None:
    blocking, waiting = shared.inspect(long_clip), shared.inspect(clip)
    shared.wait(blocking, "running")
    far = shared.tag(blocking, frame=1400, code="BAB").json()["id"]
    tag = shared.tag(waiting, frame=25, pixel=[100, 100]).json()
    assert tag["distance_m"] is tag["distance_u95_m"] is tag["photo"] is tag["at_joint"] is None
    assert tag["photo_error"] is None
    shared.post(f"/api/inspections/{blocking}/cancel")
    shared.wait(waiting)
    (later,) = wait_until(lambda: [t for t in listed(shared, waiting) if t["photo"]])
    assert later["distance_m"] == pytest.approx(0.018, abs=0.001)
    assert frame_number(shared.get(later["photo"]).content) == 25

    missed = wait_until(lambda: (t := shared.get(path(blocking, far)).json())["photo_error"] and t)
    assert "not tracked" in missed["photo_error"]
    assert missed["distance_m"] is None
    checks = shared.get(f"/api/inspections/{blocking}/checks").json()["checks"]
    assert ("block", "not_tracked") in [(check["level"], check["code"]) for check in checks]


def test_where_no_joint_was_seen_a_tag_is_at_none(shared: Client, own: str) -> None:
    zero = {"zero": {"frame": 0, "offset_m": 0.39}}  # a segment has 0.4 m
    shared.put(f"/api/inspections/{own}/corrections", json=zero).raise_for_status()
    tag = shared.tag(own, frame=10).json()
    assert (tag["at_joint"], tag["joint_no"]) == (False, None)
    result = shared.get(f"/api/inspections/{own}/corrections").json()["result"]
    assert result["joints"] == []
    assert result["expected_joints"] == [{"number": 1, "distance_m": 0.4}]


def test_in_a_pipe_the_pixel_gives_the_clock(shared: Client, survey: Survey) -> None:
    rig = clip_rig(fx=60.0, fy=60.0)
    rig["pipe"] = {"shape": "circular", "diameter_mm": 300.0}
    rig["mount"]["height_mm"] = 150.0
    pipe = another(survey, shared, rig=rig)
    clocks = {
        v: shared.tag(pipe, frame=5, pixel=[127.5, v]).json()["clock"] for v in (79.5, 159, 0)
    }
    assert clocks == {79.5: 6, 159: 4, 0: 8}  # atan(79.5 / 60) = 53 degrees to either side
    entered = shared.tag(pipe, frame=5, pixel=[127.5, 0], clock_from=11).json()
    assert entered["clock"] == 11


def test_counts_and_the_worst_severity_are_in_the_list(shared: Client, own: str) -> None:
    for severity in (2, 5, None):
        shared.tag(own, severity=severity)
    for code in ("BCD", "BCE"):  # where the survey began and ended
        shared.tag(own, code=code)
    for part in ("A1", "C1", "B1"):
        shared.tag(own, code="BBA", continuous=part)
    listed = shared.get("/api/inspections").json()["inspections"]
    (item,) = [one for one in listed if one["id"] == own]
    assert (item["observations"], item["defects"], item["worst_severity"]) == (8, 4, 5)
