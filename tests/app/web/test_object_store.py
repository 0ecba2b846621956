"""A server whose films, photos, tiles and tracks are in a bucket of a real S3 server."""

from __future__ import annotations

import io
import json
import shutil
import uuid
import zipfile

import pytest
from builders import TUS, assert_error, clip_rig, serving, wait_until
from cameras import MjpegCamera
from object_stores import Line

from app.errors import UnusableBackup
from app.storage.database.backup import back_up, restore

RANGES = {
    "bytes=0-99": [(0, 100)],
    "bytes=100-": [(100, None)],
    "bytes=-50": [(-50, None)],
    "bytes=-99999999": [(0, None)],
    "bytes=7-99999999": [(7, None)],
    "bytes=0-0": [(0, 1)],
    "bytes=10-19, 40-49": [(10, 20), (40, 50)],
    "bytes=0-30,20-49": [(0, 50)],
}
"""Headers and the slices of the film that they ask for."""


@pytest.fixture
def line(object_store):
    """A line to the S3 server."""
    line = Line(object_store.port)
    yield line
    line.cut()


def quietly(done, total):
    """Report no progress."""


def upload_in_pieces(client, content, size):
    created = client.post("/api/uploads", headers={**TUS, "Upload-Length": str(len(content))})
    location = created.headers["Location"]
    for first in range(0, len(content), size):
        sent = client.patch_upload(location, first, content[first : first + size])
        assert sent.status_code == 204, sent.text
    return location.rsplit("/", 1)[1]


def inspect(client, upload_id):
    return client.post(
        "/api/inspections",
        json={
            "name": "Culvert 7",
            "source": {"kind": "upload", "upload_id": upload_id},
            "rig": clip_rig(),
            "counter": {"is_present": False},
        },
    )


def everything(client, inspection_id, observation_id):
    """Return what the server answers about an inspection, by path."""
    root = f"/api/inspections/{inspection_id}"
    wall = client.get(f"{root}/unrolled").json()["tiles"]
    paths = [f"{root}/video", f"{root}/observations/{observation_id}/photo", f"{root}/track"]
    paths += [f"{root}/unrolled/{tile['index']}.jpg" for tile in wall]
    answers = {path: client.get(path) for path in paths}
    assert {path: answer.status_code for path, answer in answers.items()} == dict.fromkeys(
        paths, 200
    )
    assert len(answers) > 3
    return {path: answer.content for path, answer in answers.items()}


def test_everything_is_in_the_store(object_store, clip, tmp_path, chainage, monkeypatch):
    url = object_store.new()
    data, film = tmp_path / "data", clip.read_bytes()
    with serving(data, store=url) as client:
        inspection_id = inspect(client, upload_in_pieces(client, film, 60_000)).json()["id"]
        done = client.wait(inspection_id)
        assert done["status"] == "done"
        observation_id = str(uuid.uuid4())
        assert client.tag(inspection_id, observation_id, frame=12).is_success
        root = f"/api/inspections/{inspection_id}"
        wait_until(lambda: client.get(f"{root}/observations/{observation_id}/photo").is_success)
        before = everything(client, inspection_id, observation_id)
        assert before[f"{root}/video"] == film
        for header, slices in RANGES.items():
            assert_ranges(client.get(f"{root}/video", headers={"Range": header}), film, slices)
        for header in ("bytes=99999999-", "bytes=-0"):
            refused = client.get(f"{root}/video", headers={"Range": header})
            assert_error(refused, 416, "range_not_satisfiable")
            assert refused.headers["Content-Range"] == f"bytes */{len(film)}"
        changed = {"Range": "bytes=0-9", "If-Range": '"another"'}
        assert client.get(f"{root}/video", headers=changed).content == film
        bundle = zipfile.ZipFile(io.BytesIO(client.get(f"{root}/exports/zip").content))
        assert any(name.endswith(".jpg") for name in bundle.namelist())
        assert "s3://films-" in client.get("/readyz").text
    # Only the database survives.
    for path in sorted(data.rglob("*"), reverse=True):
        if path.is_file() and not path.name.startswith("chainage.db"):
            assert path.name not in ("video.mp4", "track.csv")
            path.unlink()
    tables = tmp_path / "tables.zip"
    elsewhere = chainage("archive", "export", tables, "--tracks", "--data", data)
    assert elsewhere.code == 1
    assert "the store has no sound track of Culvert 7;" in elsewhere.err
    monkeypatch.setenv("CHAINAGE_STORE", url)
    assert chainage("archive", "export", tables, "--tracks", "--data", data).code == 0
    with zipfile.ZipFile(tables) as archive:
        assert len(archive.read("tracks.jsonl").splitlines()) == done["progress"]["frames_done"]
        assert json.loads(archive.read("defects.jsonl"))["distance_m"] > 0
    monkeypatch.delenv("CHAINAGE_STORE")
    with serving(data, store=url) as client:
        assert everything(client, inspection_id, observation_id) == before
        assert client.get(f"{root}/frames/3.jpg").is_success
        archive, folder, moved = (tmp_path / name for name in ("all.zip", "folder", "moved"))
        back_up(data, archive, quietly, store=url)
        restore(archive, folder, quietly)
        assert (folder / "inspections" / inspection_id / "video.mp4").read_bytes() == film
        other = object_store.new()
        restore(archive, moved, quietly, store=other)
        assert not (moved / "inspections" / inspection_id).exists()
        with pytest.raises(UnusableBackup, match="There are inspections in s3://"):
            restore(archive, tmp_path / "again", quietly, store=other)
        with serving(moved, store=other) as restored:
            assert everything(restored, inspection_id, observation_id) == before
        assert client.post(f"{root}/retry").is_success
        assert client.wait(inspection_id)["status"] == "done"
        assert client.get(f"{root}/track").content == before[f"{root}/track"]
        assert client.delete(root).is_success
        assert_error(client.get(f"{root}/video"), 404, "inspection_not_found")
    assert object_store.keys(url) == {"archive/store-check"}


def assert_ranges(answer, film, slices):
    """Check a partial answer against the film."""
    assert answer.status_code == 206
    parts = [film[first:end] for first, end in slices]
    if len(parts) == 1:
        first = slices[0][0] % len(film) if slices[0][0] < 0 else slices[0][0]
        span = f"bytes {first}-{first + len(parts[0]) - 1}/{len(film)}"
        assert (answer.content, answer.headers["Content-Range"]) == (parts[0], span)
        return
    boundary = answer.headers["Content-Type"].partition("boundary=")[2].encode()
    _, *found, end = answer.content.split(b"\r\n--" + boundary)
    assert end == b"--\r\n"
    assert [part.partition(b"\r\n\r\n")[2] for part in found] == parts


def test_a_store_that_goes_away_loses_nothing(object_store, line, clip, survey, tmp_path):
    film = clip.read_bytes()
    settings = {"store": object_store.new(line.port), "pace": 0.4}
    with serving(tmp_path / "data", **settings) as client:
        running = inspect(client, upload_in_pieces(client, film, len(film))).json()["id"]
        wait_until(lambda: client.inspection(running)["progress"]["frames_done"])
        upload_id = upload_in_pieces(client, film, len(film))
        line.cut()
        refused = assert_error(inspect(client, upload_id), 503, "store_unavailable")
        assert "s3://films-" in refused
        assert_error(client.get(f"/api/inspections/{running}/video"), 503, "store_unavailable")
        assert "store: The object store s3://" in client.get("/readyz").text
        wait_until(lambda: "object store" in (client.inspection(running)["warning"] or ""))
        line.mend()
        assert client.wait(running)["status"] == "done"
        tiles = client.get(f"/api/inspections/{running}/unrolled").json()["tiles"]
        assert {f"{tile['index']}.jpg" for tile in tiles} == {
            tile.name for tile in (survey.folder / "wall").iterdir()
        }
        other = inspect(client, upload_id)
        assert other.status_code == 201, other.text
        client.post(f"/api/inspections/{other.json()['id']}/cancel")
        track = client.get(f"/api/inspections/{running}/track?raw=true").text
    assert rows(track) == rows((survey.folder / "track.csv").read_text())


def rows(track):
    """The lines of a track without the comments that name its inspection."""
    return [line for line in track.splitlines() if not line.startswith("#")]


def test_a_recording_goes_to_the_store_when_it_ends_and_can_be_continued(object_store, tmp_path):
    url = object_store.new()
    with (
        serving(tmp_path / "data", store=url, camera_networks=("127.0.0.0/8",)) as client,
        MjpegCamera() as camera,
    ):
        inspection_id = client.record(camera.url)
        root = f"/api/inspections/{inspection_id}"
        folder = tmp_path / "data" / "inspections" / inspection_id
        recorded = record(client, root, 10)
        film = client.get(f"{root}/video").content
        assert {f"archive/inspections/{inspection_id}/recording.mkv"} <= object_store.keys(url)
        shutil.rmtree(folder)
        going_on = client.post(f"{root}/continue", json={"url": camera.url, "robot": "stood_still"})
        assert going_on.status_code == 200, going_on.text
        assert record(client, root, recorded + 10) > recorded
        assert len(client.get(f"{root}/video").content) > len(film)
        assert client.get(f"{root}/frames/3.jpg").is_success
        assert not {path.suffix for path in folder.iterdir()} & {".mkv", ".mp4"}


def record(client, root, frames):
    """Wait for so many frames of a live inspection, then end it; return how many it has then."""
    wait_until(lambda: client.get(root).json()["progress"]["frames_done"] >= frames)
    assert client.post(f"{root}/finish", json={"end_condition": "complete"}).status_code == 200
    ended = client.wait(root.rpartition("/")[2])
    assert ended["status"] == "done", ended
    return ended["progress"]["frames_done"]


@pytest.mark.parametrize(
    ("url", "sentence"),
    [
        ("nowhere", "The bucket of s3://nowhere/archive does not exist."),
        ("http://films", "CHAINAGE_STORE must read s3://"),
    ],
)
def test_a_wrong_store_ends_the_start_with_a_sentence(
    object_store, tmp_path, monkeypatch, chainage, url, sentence
):
    monkeypatch.setenv("CHAINAGE_STORE", url if "/" in url else object_store.url(url))
    ended = chainage("serve", "--port", 0, "--data", tmp_path / "data")
    assert ended.code == 1
    assert sentence in " ".join(ended.err.split())
    assert "Traceback" not in ended.err
