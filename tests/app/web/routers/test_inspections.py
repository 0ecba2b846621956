import copy
import hashlib
import os
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from builders import (
    STEP_MM,
    TOKEN,
    TUS,
    Client,
    assert_error,
    clip_rig,
    frame_number,
    make_clip,
    wait_until,
)
from surveys import Survey, another
from websockets.sync.client import connect
from websockets.typing import Origin

from app.tracker import tracker
from vo_core import Track


def test_an_upload_becomes_a_tracked_inspection(shared: Client, clip: Path, done: str) -> None:
    inspection = shared.inspection(done)
    assert inspection["status"] == "done"
    assert inspection["progress"]["frames_done"] == inspection["progress"]["frames_total"] == 40
    assert inspection["distance_m"] == pytest.approx(39 * STEP_MM / 1000, abs=0.001)
    assert inspection["distance_u95_m"] is not None
    assert inspection["error"] is None
    assert inspection["warning"] is None
    assert inspection["finished_at"] > inspection["created_at"]
    assert inspection["header"] == {"asset_id": "CUL-0041"}
    assert (
        inspection["rig"]["camera"] == clip_rig(skew=0.0, distortion=[], readout_ms=0.0)["camera"]
    )
    assert inspection["source"] == {
        "kind": "upload",
        "filename": "short.mp4",
        "size": clip.stat().st_size,
        "sha256": hashlib.sha256(clip.read_bytes()).hexdigest(),
    }
    assert inspection["video"] == {
        "width": 256,
        "height": 160,
        "duration_s": 1.6,
        "codec": "h264",
        "pixel_aspect": 1.0,
        "playable": True,
    }


def body(upload_id: str, **changes: Any) -> dict[str, Any]:
    source = {"kind": "upload", "upload_id": upload_id}
    return {"name": "x", "source": source, "rig": clip_rig()} | changes


def test_what_is_not_a_video_is_refused_by_name_and_its_upload_stays(shared: Client) -> None:
    upload_id = shared.upload(b"#EXTM3U\nhttp://127.0.0.1/secret\n", "holiday.mp4")
    answer = shared.post("/api/inspections", json=body(upload_id))
    assert "holiday.mp4" in assert_error(answer, 422, "unreadable_video")
    assert shared.head(f"/api/uploads/{upload_id}", headers=TUS).status_code == 200


def test_an_incomplete_upload_is_not_taken(shared: Client) -> None:
    created = shared.post("/api/uploads", headers={**TUS, "Upload-Length": "10"})
    upload_id = created.headers["Location"].rsplit("/", 1)[1]
    answer = shared.post("/api/inspections", json=body(upload_id))
    assert "0 of 10" in assert_error(answer, 409, "upload_incomplete")
    assert_error(shared.post("/api/inspections", json=body("0" * 32)), 404, "upload_not_found")


def test_a_rig_for_another_picture_size_is_refused(shared: Client, clip: Path) -> None:
    detail = assert_error(shared.create(clip, rig=clip_rig(width=640)), 422, "rig_video_mismatch")
    assert "640 x 160" in detail
    assert "256 x 160" in detail


@pytest.mark.parametrize(
    ("part", "field", "value", "said"),
    [
        ("camera", "fx", -5, "camera.fx"),
        ("camera", "fx", False, "camera.fx"),
        ("camera", "fx", 8, "is it the lens's focal length in mm?"),
        ("mount", "height_mm", 0.2, "200 if it is in metres"),
        ("mount", "view", "up", "'down' or 'forward'"),
        ("pipe", "colour", "grey", "pipe.colour"),
    ],
)
def test_a_wrong_rig_is_refused_with_field_and_value(
    shared: Client, part: str, field: str, value: object, said: str
) -> None:
    rig = copy.deepcopy(clip_rig())
    rig[part][field] = value
    answer = shared.post("/api/inspections", json=body("0" * 32, rig=rig))
    detail = assert_error(answer, 422, "invalid_rig")
    assert said.lower() in detail.lower()
    assert str(value) in detail


@pytest.mark.parametrize(
    "changes",
    [
        {"name": ""},
        {"name": "  "},
        {"name": "a\nb"},
        {"name": "x" * 201},
        {"header": {"Not A Name": "x"}},
        {"header": {"a": ["x"]}},
        {"source": {"kind": "file", "path": "/etc/passwd"}},
        {"source": {"kind": "upload", "upload_id": "../../x"}},
        {"rig": None},
        {"more": 1},
    ],
)
def test_a_body_out_of_bounds_is_refused(shared: Client, changes: dict[str, Any]) -> None:
    answer = shared.post("/api/inspections", json=body("0" * 32, **changes))
    assert_error(answer, 422, "invalid_request")


def test_the_list_has_the_newest_first(server: Client, survey: Survey, done: str) -> None:
    first, second = (another(survey, server, name=name) for name in ("first", "second"))
    listed = server.get("/api/inspections").json()["inspections"]
    assert [item["id"] for item in listed] == [second, first, done]
    assert listed[0]["name"] == "second"
    assert listed[0]["defects"] == 0
    unknown = server.get("/api/inspections", params={"_": 1}).json()
    assert [item["id"] for item in unknown.pop("inspections")] == [second, first, done]
    assert unknown == {}, "a page"
    for name in ("search", "label"):  # PostgreSQL takes no NUL
        for path in ("/api/inspections", "/api/inspections/ids"):
            assert_error(server.get(path, params={name: "a\0"}), 422, "invalid_request")


def test_a_page_of_the_list_has_what_fits_and_their_number(server: Client, survey: Survey) -> None:
    made = [another(survey, server, name=name) for name in ("100 % full", "Sungai Besi", "sungai")]
    server.patch(f"/api/inspections/{made[1]}", json={"header": {"client": "O'Neil"}})

    def ids(**wanted: str | int) -> tuple[list[str], int]:
        answer = server.get("/api/inspections", params=wanted).json()
        return [item["id"] for item in answer["inspections"]], answer["total"]

    assert ids(offset=1, limit=2) == ([made[1], made[0]], 4)
    assert ids(search="sungai") == ([made[2], made[1]], 2)
    assert ids(search="O'NEIL besi") == ([made[1]], 1)
    assert ids(search="%") == ([made[0]], 1)
    assert ids(search="CUL-0041 mp4", status="done")[1] == 3
    assert ids(status="failed") == ([], 0)
    assert ids(search="sungai", offset=50) == ([], 2)
    assert server.get("/api/inspections", params={"search": "%"}).json()["stored"] == 4


def test_a_page_of_the_list_names_the_newest_severe_defects(
    server: Client, survey: Survey, done: str
) -> None:
    def grave() -> list[str]:
        answer = server.get("/api/inspections", params={"search": "nowhere", "limit": 1}).json()
        return [item["id"] for item in answer["grave"]]

    other = another(survey, server)
    server.tag(done, severity=4)
    assert grave() == []
    server.tag(done, severity=5)
    server.tag(other, severity=5)
    assert grave() == [other, done]


def test_films_of_an_older_program_are_named_and_tracked_again_together(
    server: Client, survey: Survey, done: str
) -> None:
    def issues(inspection: str) -> set[str]:
        found = server.get(f"/api/inspections/{inspection}/checks").json()["checks"]
        return {issue["code"] for issue in found}

    present = server.inspection(done)
    assert (present["tracked_with"], present["outdated"]) == (tracker(), False)
    same = another(survey, server, tracked_with="9.9.9+" + tracker().partition("+")[2])
    old = another(survey, server, tracked_with="0.0.9+0123456789ab")
    approved = another(survey, server, tracked_with=None, review_state="approved")
    another(survey, server, tracked_with=None, video_file="")  # nobody could track it again
    listed = server.get("/api/inspections", params={"outdated": True}).json()
    assert {item["id"] for item in listed["inspections"]} == {old, approved}
    assert "outdated" in issues(old)
    assert "outdated" not in issues(done) | issues(same)
    page = server.get(f"/api/inspections/{old}/exports/html").text
    assert "An older version of Chainage tracked the film" in page
    assert "Chainage 0.0.9+0123456789ab" in page
    queued = server.post("/api/inspections/retry", json={"ids": [old, approved, "0" * 32]})
    assert queued.json() == {"queued": 1}
    assert not server.wait(old)["outdated"]


def test_name_and_header_can_be_changed(shared: Client, own: str) -> None:
    path = f"/api/inspections/{own}"
    changed = shared.patch(path, json={"name": "Renamed"}).json()
    assert (changed["name"], changed["header"]) == ("Renamed", {"asset_id": "CUL-0041"})
    changed = shared.patch(path, json={"header": {"operator": "Ai"}}).json()
    assert (changed["name"], changed["header"]) == ("Renamed", {"operator": "Ai"})
    assert_error(shared.patch(path, json={"status": "done"}), 422, "invalid_request")


def test_an_upload_is_used_up_by_its_inspection_and_a_deleted_one_is_gone_with_its_files(
    server: Client, long_clip: Path, done: str
) -> None:
    created = server.create(long_clip)
    assert created.status_code == 201
    inspection_id = created.json()["id"]
    assert created.headers["Location"] == f"/api/inspections/{inspection_id}"
    assert list((server.data / "uploads").iterdir()) == []
    server.wait(inspection_id, "running")
    assert server.delete(f"/api/inspections/{inspection_id}").status_code == 204
    assert_error(server.get(f"/api/inspections/{inspection_id}"), 404, "inspection_not_found")
    assert [folder.name for folder in (server.data / "inspections").iterdir()] == [done]


def test_an_unknown_inspection_is_not_found_everywhere(shared: Client) -> None:
    path = f"/api/inspections/{'0' * 32}"
    for part in ("", "/track", "/video", "/observations", "/wallgrid", "/exports/csv"):
        assert_error(shared.get(path + part), 404, "inspection_not_found")
    for part in ("/cancel", "/retry"):
        assert_error(shared.post(path + part), 404, "inspection_not_found")
    assert_error(shared.delete(path), 404, "inspection_not_found")
    assert_error(shared.get(f"/viewer/{'0' * 32}/"), 404, "inspection_not_found")


def test_the_track_comes_as_csv_json_and_tum(shared: Client, done: str) -> None:
    path = f"/api/inspections/{done}/track"
    track = Track.from_csv(shared.get(path).text)
    assert track.frame.tolist() == list(range(40))
    assert track.distance_mm == pytest.approx(STEP_MM * np.arange(40), abs=0.5)
    columns = shared.get(path, params={"format": "json"}).json()["columns"]
    assert columns["distance_mm"] == pytest.approx(track.distance_mm.tolist())
    assert columns["status"] == track.status.tolist()
    assert len(shared.get(path, params={"format": "tum"}).text.splitlines()) == 40
    late = shared.get(path, params={"format": "json", "since": 38}).json()["columns"]
    assert late["frame"] == [38, 39]
    assert shared.get(path, params={"format": "json", "since": 99}).json()["columns"]["frame"] == []
    assert_error(shared.get(path, params={"format": "xml"}), 422, "invalid_request")


def test_the_original_is_served_whole_and_in_ranges(shared: Client, done: str, clip: Path) -> None:
    path, content = f"/api/inspections/{done}/video", clip.read_bytes()
    whole = shared.get(path)
    assert whole.content == content
    assert whole.headers["Content-Type"] == "video/mp4"
    assert whole.headers["Content-Security-Policy"] == "sandbox"
    part = shared.get(path, headers={"Range": "bytes=100-199"})
    assert (part.status_code, part.content) == (206, content[100:200])
    assert part.headers["Content-Range"] == f"bytes 100-199/{len(content)}"
    beyond = shared.get(path, headers={"Range": f"bytes={len(content)}-"})
    assert_error(beyond, 416, "range_not_satisfiable")


def test_a_film_that_grows_while_it_is_sent_is_sent_as_it_was(shared: Client, own: str) -> None:
    (film,) = (shared.data / "inspections" / own).glob("video.*")
    for asked, size in (({}, 2**25 + 9), ({"Range": "bytes=5-"}, 2**25 + 4)):
        os.truncate(film, 2**25 + 9)  # more than fits into the sockets: the end waits
        with shared.stream("GET", f"/api/inspections/{own}/video", headers=asked) as sent:
            with film.open("ab") as recording:
                recording.write(bytes(2**20))
            assert len(sent.read()) == int(sent.headers["Content-Length"]) == size


def test_a_single_frame_is_exactly_that_frame(shared: Client, done: str) -> None:
    for frame in (0, 17, 39):
        answer = shared.get(f"/api/inspections/{done}/frames/{frame}.jpg")
        assert answer.headers["Content-Type"] == "image/jpeg"
        assert frame_number(answer.content) == frame


def test_a_frame_that_is_not_tracked_has_no_picture(shared: Client, done: str) -> None:
    assert_error(shared.get(f"/api/inspections/{done}/frames/40.jpg"), 404, "frame_not_found")
    assert_error(shared.get(f"/api/inspections/{done}/frames/-1.jpg"), 422, "invalid_request")


CONTAINERS = (
    ("a.webm", "libvpx", "video/webm", True),
    ("a.mkv", "libx264", "video/x-matroska", False),
    ("a.avi", "mpeg4", "video/x-msvideo", False),
    ("a.ts", "mpeg2video", "video/mp2t", False),
)
"""With a codec, its media type, and whether a browser plays it."""


def test_other_containers_are_tracked_too(shared: Client, tmp_path: Path, is_long: bool) -> None:
    for name, codec, media_type, playable in CONTAINERS if is_long else CONTAINERS[-1:]:
        video = make_clip(tmp_path / name, 12, codec=codec)
        expect_tracked(shared, video, media_type, playable=playable)


def expect_tracked(shared: Client, video: Path, media_type: str, *, playable: bool) -> None:
    inspection_id = shared.tracked(video)
    inspection = shared.inspection(inspection_id)
    assert inspection["progress"]["frames_done"] == 12
    assert inspection["video"]["playable"] is playable
    sent = shared.get(f"/api/inspections/{inspection_id}/video")
    assert sent.headers["Content-Type"] == media_type
    picture = shared.get(f"/api/inspections/{inspection_id}/frames/7.jpg").content
    assert frame_number(picture) == 7


def test_the_wall_under_a_pixel_is_ray_cast(shared: Client, done: str) -> None:
    path = f"/api/inspections/{done}/wall"
    wall = shared.get(path, params={"frame": 20, "u": 152.5, "v": 104.5}).json()
    assert wall["distance_m"] == pytest.approx((20 * STEP_MM + 20) / 1000, abs=0.001)
    assert wall["y_mm"] == pytest.approx(20, abs=0.5)
    assert wall["clock"] is None
    outside = shared.get(path, params={"frame": 20, "u": 256, "v": 0})
    assert_error(outside, 422, "pixel_outside_picture")
    assert_error(shared.get(path, params={"frame": 40, "u": 0, "v": 0}), 404, "frame_not_found")
    nan = shared.get(path, params={"frame": 0, "u": "nan", "v": 0})
    assert_error(nan, 422, "invalid_request")


def test_the_wall_grid_has_the_rays_and_where_the_camera_starts(shared: Client, done: str) -> None:
    grid = shared.get(f"/api/inspections/{done}/wallgrid").json()
    assert len(grid["rays"]) == grid["rows"]
    assert len(grid["rays"][0]) == grid["cols"]
    assert (grid["u"][-1], grid["v"][-1]) == (255, 159)
    ahead, right, down = grid["rays"][-1][0]
    assert (ahead / down, right / down) == pytest.approx((-127.5 / 250, 79.5 / 250), abs=1e-5)
    assert grid["radius_mm"] is None
    start = {"y_mm": 0.0, "z_mm": -200.0, "yaw_deg": 0.0, "pitch_deg": 0.0, "roll_deg": 0.0}
    assert grid["start"] == start


def test_a_damaged_photo_folder_does_not_hide_the_inspection(shared: Client, own: str) -> None:
    name = shared.tag(own).json()["id"]
    shutil.rmtree(shared.data / "inspections" / own / "photos")
    answer = shared.get(f"/api/inspections/{own}/observations/{name}/photo")
    assert_error(answer, 404, "photo_not_found")
    assert shared.inspection(own)["defects"] == 1


def test_a_damaged_track_is_said_with_its_repair_and_costs_nothing_else(
    shared: Client, done: str, own: str
) -> None:
    (shared.data / "inspections" / own / "track.csv").write_bytes(bytes(range(256)))
    path = f"/api/inspections/{own}"
    needs_it = ("/track", "/observations", "/frames/3.jpg", "/exports/pdf", "/exports/csv")
    answers = [shared.get(path + needing) for needing in needs_it]
    for answer in (*answers, shared.tag(own)):
        assert "Track the film again" in assert_error(answer, 409, "damaged_track")
    for read in ("", "/video", "/events", "/thumbnail"):
        assert shared.get(path + read).is_success, read
    assert shared.patch(path, json={"name": "Still here"}).is_success
    url = f"{shared.server.websocket_url}{path}/live"
    headers = {"Authorization": f"Bearer {TOKEN}"}
    with connect(url, origin=Origin(shared.server.url), additional_headers=headers) as live:
        live.recv()  # the page may follow another run
    body = {"inspections": [own, done], "formats": ["csv"]}
    order = shared.post("/api/bulk-exports", json=body).json()["id"]
    wait_until(lambda: shared.get(f"/api/bulk-exports/{order}").json()["state"] == "done")
    (missing,) = shared.get(f"/api/bulk-exports/{order}").json()["not_made"]
    assert missing["detail"] == "its track is damaged; track the film again."
    assert shared.post(f"{path}/retry").is_success
    shared.wait(own, "done")
    assert shared.get(f"{path}/observations").is_success


def test_presets_are_rigs(shared: Client) -> None:
    presets = shared.get("/api/presets").json()["presets"]
    assert len(presets) >= 3
    assert all({"camera", "mount", "pipe"} <= preset["rig"].keys() for preset in presets)


def test_a_large_preview_is_a_picture(shared: Client, done: str) -> None:
    picture = shared.get(f"/api/inspections/{done}/frames/3.jpg").content
    image = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    assert image.shape == (160, 256, 3)
