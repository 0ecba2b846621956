"""A disk without a free page: 507 and a sentence, nothing acknowledged is lost, and on it goes."""

from __future__ import annotations

import shutil
import sqlite3
import uuid
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest
from builders import (
    PATIENCE_S,
    TOKEN,
    TUS,
    Client,
    assert_error,
    clip_rig,
    frame_number,
    make_clip,
    serving,
    wait_until,
)
from cameras import MjpegCamera
from small_disk import SmallDisk, small_disk
from surveys import Survey

from app.main import in_background
from app.settings import Settings
from app.storage.database import revisions
from app.storage.database.database import Database
from app.storage.database.sqlite import revision_of
from app.storage.database.tables import Heartbeat

PACK = (
    "code,char1,char2,label,group,needs_clock,needs_q1,unit_q1,needs_q2,unit_q2,"
    "continuous_allowed,grade_s\nSCR,,,Scour at the outlet,S,no,opt,mm,no,,no,3\n"
)
CSV = {"Content-Type": "text/csv"}


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[SmallDisk]:
    with small_disk(tmp_path / "disk") as disk:
        yield disk


def test_what_writes_is_refused_and_goes_on_when_there_is_room(
    disk: SmallDisk, clip: Path, survey: Survey
) -> None:
    content, data = clip.read_bytes(), survey.copied_to(disk.place / "data")
    with serving(data) as client, client.anonymous() as browser:
        assert browser.post("/api/login", json={"token": TOKEN}).is_success
        done, kept = survey.id, str(uuid.uuid4())
        path, tags = f"/api/inspections/{done}", f"/api/inspections/{done}/observations"
        assert client.tag(done, kept).status_code == 200
        photo = wait_until(lambda: photo_of(client, tags, kept))
        upload_id = client.upload(content)
        begun = client.post("/api/uploads", headers={**TUS, "Upload-Length": str(len(content))})
        place, half = begun.headers["Location"], len(content) // 2
        assert client.patch_upload(place, 0, content[:half]).status_code == 204
        new = str(uuid.uuid4())
        preferences = client.get("/api/me").json()["preferences"]

        def writes() -> Iterator[httpx.Response]:
            yield client.patch_upload(place, half, content[half:])
            yield client.post("/api/uploads", headers={**TUS, "Upload-Length": "10"})
            yield client.tag(done, new)
            yield client.delete(f"{tags}/{kept}")
            yield client.post(f"{tags}/{kept}/restore")
            source = {"kind": "upload", "upload_id": upload_id}
            body: dict[str, Any] = {"name": "Next", "source": source, "rig": clip_rig()}
            body["counter"] = {"is_present": False}
            yield client.post("/api/inspections", json=body)
            yield client.patch(path, json={"name": "Another"})
            yield client.put("/api/me/preferences", json=preferences | {"units": "ft"})
            yield client.put(f"{path}/corrections", json={"zero": {"frame": 5, "offset_m": 1}})
            yield client.post("/api/packs?name=Ours", content=PACK, headers=CSV)
            yield client.post("/api/login", json={"token": TOKEN})

        def exported() -> dict[str, Any]:
            body = {"inspections": [done], "formats": ["csv"]}
            ordered = client.post("/api/bulk-exports", json=body)
            assert ordered.status_code == 202
            order = f"/api/bulk-exports/{ordered.json()['id']}"
            wait_until(lambda: client.get(order).json()["state"] in ("done", "failed"))
            return dict(client.get(order).json())

        disk.fill()
        for _ in range(2):
            failed = exported()
            assert (failed["state"], failed["size"]) == ("failed", None)
            assert "disk is full" in failed["detail"]
        for number, answer in enumerate(writes()):
            if number != 4:  # nothing was deleted, so nothing is to be restored
                assert "disk" in assert_error(answer, 507, "disk_full"), answer.request.url
        for reader in (client, browser):
            for read in ("/api/inspections", tags, f"{path}/track", f"{tags}/{kept}/photo"):
                assert reader.get(read).status_code == 200, read
        assert client.get(f"{tags}/{kept}/photo").content == photo
        wait_until(lambda: client.get("/readyz").status_code == 503)

        disk.make_room()
        assert exported()["state"] == "done"
        answers = list(writes())
        assert [answer.request.url.path for answer in answers if not answer.is_success] == []
        for inspection_id in (done, answers[5].json()["id"]):
            assert client.wait(inspection_id)["status"] == "done"
        assert [tag["id"] for tag in client.get(tags).json()["observations"]] == [kept, new]
        assert client.inspection(done)["name"] == "Another"
        wait_until(lambda: photo_of(client, tags, new))
        wait_until(lambda: client.get("/readyz").status_code == 200)


def test_a_server_that_starts_without_room_lets_people_read_and_later_write(
    disk: SmallDisk, survey: Survey, chainage: Callable[..., Any]
) -> None:
    data = survey.copied_to(disk.place / "data")
    with closing(sqlite3.connect(data / "chainage.db")) as database, database:
        database.execute("UPDATE inspections SET status = 'running'")  # it was killed
    disk.fill()
    settings = Settings(data=data, disk_reserve_bytes=0)
    with in_background(settings) as login_url:
        url, token = login_url.split("/login?token=")
        headers = {"Authorization": f"Bearer {token}"}
        with httpx.Client(base_url=url, headers=headers, timeout=PATIENCE_S) as client:
            path = f"/api/inspections/{survey.id}"
            for read in ("", "/track", "/observations", "/video", "/exports/csv"):
                assert client.get(path + read).status_code == 200, read
            assert_error(client.patch(path, json={"name": "Another"}), 507, "disk_full")
            assert not (data / "address.json").exists()
            assert not (data / "token").exists()
            disk.make_room()
            assert client.patch(path, json={"name": "Another"}).status_code == 200
            wait_until((data / "address.json").exists)
    disk.fill()
    refused = chainage("serve", "--port", "0", "--data", disk.place / "new")
    assert refused.code == 1
    assert "disk is full" in refused.err
    assert "Traceback" not in refused.err


def test_what_a_killed_server_left_in_the_log_is_read_and_written_without_room(
    disk: SmallDisk, tmp_path: Path
) -> None:
    file, left = tmp_path / "chainage.db", disk.place / "chainage.db"
    first = Database(file)
    first.beat()
    for name in (file.name, f"{file.name}-wal"):
        shutil.copy(tmp_path / name, disk.place / name)
    first.close()
    disk.fill()
    database = Database(left)
    with database.read() as session:
        assert session.get(Heartbeat, 1) is not None
    disk.make_room()
    database.beat()
    database.close()
    assert revision_of(left) == revisions.newest()  # by others, too


def photo_of(client: Client, tags: str, observation_id: str) -> bytes | None:
    answer = client.get(f"{tags}/{observation_id}/photo")
    return answer.content if answer.is_success else None


def test_a_track_is_kept_when_there_is_room_again_also_after_a_restart(
    disk: SmallDisk, tmp_path: Path, *, is_long: bool
) -> None:
    video = make_clip(tmp_path / "clip.mp4", 150)
    with serving(disk.place / "data") as client:
        if is_long:  # without a restart; a recording and an object store are tried so, too
            first = client.inspect(video)
            track_without_room(client, disk, first)
            disk.make_room()
            assert_done(client, first)
        second = client.inspect(video)
        track_without_room(client, disk, second)
    disk.make_room()
    with serving(disk.place / "data") as client:
        assert_done(client, second)


def track_without_room(client: Client, disk: SmallDisk, inspection_id: str) -> None:
    client.wait(inspection_id, "running")
    disk.fill()
    waiting = wait_until(lambda: held_up(client, inspection_id))
    assert "disk is full" in waiting["warning"]
    assert (waiting["status"], waiting["progress"]["frames_done"]) == ("running", 150)


def held_up(client: Client, inspection_id: str) -> dict[str, Any] | None:
    inspection = client.inspection(inspection_id)
    assert inspection["status"] in ("queued", "running")
    return inspection if inspection["warning"] else None


def assert_done(client: Client, inspection_id: str) -> None:
    done = client.wait(inspection_id)
    assert (done["status"], done["warning"], done["error"]) == ("done", None, None)
    track = client.get(f"/api/inspections/{inspection_id}/track?format=json").json()
    assert track["columns"]["frame"] == list(range(150))


def test_a_recording_needs_room_to_begin_with(disk: SmallDisk) -> None:
    networks = ("127.0.0.0/8",)
    with MjpegCamera() as camera, serving(disk.place / "data", camera_networks=networks) as client:
        source = {"kind": "live", "url": camera.url}
        body = {"name": "Live", "source": source, "rig": clip_rig(), "header": {}}
        answer = client.post("/api/inspections", json=body)
        assert_error(answer, 507, "disk_full")  # 64 MiB


def test_a_full_disk_stops_the_recording_until_there_is_room_and_never_the_tracking(
    tmp_path: Path,
) -> None:
    networks = ("127.0.0.0/8",)
    with (
        small_disk(tmp_path / "disk", megabytes=80) as disk,
        MjpegCamera() as camera,
        serving(disk.place / "data", camera_networks=networks) as client,
    ):
        inspection_id = client.record(camera.url)
        path = f"/api/inspections/{inspection_id}"

        def frames() -> int:
            return int(client.inspection(inspection_id)["progress"]["frames_done"])

        def is_recording() -> bool:
            inspection = client.inspection(inspection_id)
            assert inspection["status"] == "running"
            return bool(inspection["live"]["is_recording"])

        def tagged() -> tuple[int, dict[str, Any]]:
            """A frame from now, which is tracked, and its row."""
            before = frames()
            wait_until(lambda: frames() > before + 20)
            return before + 10, row(client, path, before + 10)

        client.state_no_counter(inspection_id)
        wait_until(lambda: frames() > 15)
        disk.fill()
        wait_until(lambda: not is_recording())
        unrecorded, its_row = tagged()
        disk.make_room()
        wait_until(is_recording)
        later, later_row = tagged()
        assert later_row["time_s"] > its_row["time_s"]
        photos = [client.get(f"{path}/frames/{frame}.jpg") for frame in (unrecorded, later)]
        assert "not recorded" in assert_error(photos[0], 404, "frame_not_found")
        assert photos[1].is_success
        client.post(f"{path}/cancel")
        ended = client.wait(inspection_id)
        assert ended["status"] == "cancelled"
        assert "tracked but not recorded" in ended["warning"]
        assert frame_number(client.get(f"{path}/frames/{later}.jpg").content) == frame_number(
            photos[1].content
        )
        total = ended["progress"]["frames_done"]

        client.post(f"{path}/retry")
        again = client.wait(inspection_id)
        assert (again["status"], again["progress"]["frames_done"]) == ("done", total)
        assert row(client, path, later)["time_s"] == pytest.approx(later_row["time_s"])
        now_unseen = row(client, path, unrecorded)
        assert now_unseen["time_s"] == pytest.approx(its_row["time_s"])
        assert now_unseen["status"] == "lost"
        error_mm = row(client, path, later)["distance_mm"] - later_row["distance_mm"]
        assert abs(error_mm) < 2 * row(client, path, later)["sigma_distance_mm"]


def row(client: Client, path: str, frame: int) -> dict[str, Any]:
    columns = client.get(f"{path}/track?format=json&raw=true").json()["columns"]
    return {name: column[frame] for name, column in columns.items()}
