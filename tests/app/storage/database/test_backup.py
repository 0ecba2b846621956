"""Backups of a server at work, and the way back; what is damaged or hostile leaves nothing."""

from __future__ import annotations

import hashlib
import json
import shutil
import sqlite3
import stat
import threading
import uuid
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from builders import Client, make_clip, serving, wait_until
from processes import process
from small_disk import small_disk
from surveys import Survey

from app.errors import DiskFull, UnusableBackup, UnusableDatabase
from app.storage.database.backup import back_up, restore


def quietly(_done: int, _total: int) -> None:
    """Nobody looks at the progress."""


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory, survey: Survey) -> Path:
    """A backup of a tracked inspection with a photo."""
    folder = tmp_path_factory.mktemp("archive")
    with serving(survey.copied_to(folder / "data")) as client:
        tag = client.tag(survey.id).json()["id"]
        path = f"/api/inspections/{survey.id}/observations/{tag}/photo"
        wait_until(lambda: client.get(path).status_code == 200)
        back_up(folder / "data", folder / "backup.zip", quietly)
    return folder / "backup.zip"


def test_a_backup_of_a_server_at_work_restores_to_a_whole_one(
    tmp_path: Path, survey: Survey, chainage: Command
) -> None:
    done, film = survey.id, make_clip(tmp_path / "film.mp4", 300)
    with process(survey.copied_to(tmp_path / "data"), PACE="0.5") as client:
        running = client.inspect(film)
        client.wait(running, "running")
        acknowledged: list[str] = []
        is_over = threading.Event()
        writer = threading.Thread(target=tag_until, args=(is_over, client, done, acknowledged))
        writer.start()
        wait_until(lambda: len(acknowledged) > 20)
        before = list(acknowledged)
        made = chainage("backup", tmp_path / "backup.zip", "--data", tmp_path / "data")
        is_over.set()
        writer.join()
        assert (made.code, "2 inspections" in made.out) == (0, True), made.err
        answers = everything_of(client, done)
    back = chainage("restore", tmp_path / "backup.zip", "--data", tmp_path / "restored")
    assert (back.code, "2 inspections" in back.out) == (0, True), back.err
    with sqlite3.connect(tmp_path / "restored" / "chainage.db") as database:
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert database.execute("PRAGMA foreign_key_check").fetchall() == []
    with serving(tmp_path / "restored", pace=0.5) as client:
        listed = client.get(f"/api/inspections/{done}/observations").json()["observations"]
        assert set(before) <= {tag["id"] for tag in listed}
        assert everything_of(client, done) == answers
        photo = f"/api/inspections/{done}/observations/{before[0]}/photo"
        assert wait_until(lambda: client.get(photo).content)[:2] == b"\xff\xd8"
        assert client.inspection(running)["status"] in ("queued", "running")
        wait_until(lambda: client.inspection(running)["progress"]["frames_done"] > 0)


def tag_until(
    is_over: threading.Event, client: Client, inspection_id: str, acknowledged: list[str]
) -> None:
    while not is_over.is_set():
        name = str(uuid.uuid4())
        assert client.tag(inspection_id, name, frame=len(acknowledged) % 40).status_code == 200
        acknowledged.append(name)


def everything_of(client: Client, inspection_id: str) -> dict[str, Any]:
    """What does not change with new tags."""
    path = f"/api/inspections/{inspection_id}"
    video = client.get(f"{path}/video", headers={"Range": "bytes=0-"})
    assert client.get(f"{path}/exports/csv").status_code == 200
    assert client.get(f"{path}/exports/json").status_code == 200
    return {
        "track": client.get(f"{path}/track").text,
        "video": hashlib.sha256(video.content).hexdigest(),
        "rig": client.inspection(inspection_id)["rig"],
    }


def test_a_backup_is_whole_while_inspections_come_and_go(
    tmp_path: Path, clip: Path, survey: Survey
) -> None:
    kept = survey.id
    with serving(survey.copied_to(tmp_path / "data")) as client:
        is_over = threading.Event()
        worker = threading.Thread(target=come_and_go_until, args=(is_over, client, clip))
        worker.start()
        for number in range(3):
            back_up(tmp_path / "data", tmp_path / "backup.zip", quietly)
            made = restore(tmp_path / "backup.zip", tmp_path / f"restored{number}", quietly)
            assert (made.inspections >= 1, made.missing) == (True, ())
            assert (tmp_path / f"restored{number}" / "inspections" / kept / "video.mp4").is_file()
        is_over.set()
        worker.join()


def come_and_go_until(is_over: threading.Event, client: Client, clip: Path) -> None:
    while not is_over.is_set():
        inspection_id = client.create(clip).json()["id"]
        client.delete(f"/api/inspections/{inspection_id}")


def test_what_was_lost_before_is_reported_and_the_rest_is_backed_up(
    tmp_path: Path, archive: Path, chainage: Command
) -> None:
    restore(archive, tmp_path / "data", quietly)
    (photo,) = (tmp_path / "data").rglob("photos/*.jpg")
    photo.unlink()
    made = chainage("backup", tmp_path / "second.zip", "--data", tmp_path / "data")
    assert made.code == 0
    assert f"{photo.name} is missing" in made.err
    assert restore(tmp_path / "second.zip", tmp_path / "again", quietly).inspections == 1


def test_a_folder_in_use_or_not_empty_is_left_alone(
    tmp_path: Path, archive: Path, chainage: Command
) -> None:
    with serving(tmp_path / "data"):
        before = sorted((tmp_path / "data").rglob("*"))
        refused = chainage("restore", archive, "--data", tmp_path / "data")
        assert refused.code == 1
        assert "is not empty" in refused.err
        assert sorted((tmp_path / "data").rglob("*")) == before


def test_a_mounted_folder_is_restored_into(tmp_path: Path, archive: Path) -> None:
    with small_disk(tmp_path / "volume") as disk:
        assert restore(archive, disk.place, quietly).observations == 1
        with serving(disk.place) as client:
            assert len(client.get("/api/inspections").json()["inspections"]) == 1


@pytest.mark.parametrize("part", [0.3, 0.9])
def test_without_room_nothing_is_left_of_a_restore_or_a_backup(
    tmp_path: Path, archive: Path, part: float
) -> None:
    restore(archive, tmp_path / "data", quietly)
    with small_disk(tmp_path / "volume", 1) as disk:
        room = round(part * archive.stat().st_size)
        (disk.place / "filler").write_bytes(bytes(2**20 - room))
        with pytest.raises(DiskFull):
            restore(archive, disk.place / "data", quietly)
        with pytest.raises(DiskFull):
            back_up(tmp_path / "data", disk.place / "backup.zip", quietly)
        assert [path.name for path in disk.place.iterdir()] == ["filler"]


def changed(archive: Path, target: Path, change: Callable[[Entries, Manifest], None]) -> Path:
    """A copy with other entries; the manifest is written as `change` leaves it."""
    with zipfile.ZipFile(archive) as source:
        entries = [(info, source.read(info)) for info in source.infolist()]
    manifest = json.loads(entries.pop()[1])
    change(entries, manifest)
    with zipfile.ZipFile(target, "w") as out:
        for info, content in entries:
            out.writestr(info, content)
        out.writestr("manifest.json", json.dumps(manifest))
    return target


Command = Callable[..., Any]
Entries = list[tuple[zipfile.ZipInfo, bytes]]
Manifest = dict[str, Any]


def add(entries: Entries, manifest: Manifest, name: str, content: bytes, mode: int = 0) -> None:
    info = zipfile.ZipInfo(name)
    info.external_attr = mode << 16
    entries.append((info, content))
    digest = hashlib.sha256(content).hexdigest()
    manifest["files"][name] = {"size": len(content), "sha256": digest}


def flip_a_byte_of_the_video(entries: Entries, manifest: Manifest) -> None:
    at = next(i for i, (info, _) in enumerate(entries) if info.filename.endswith(".mp4"))
    info, content = entries[at]
    entries[at] = (info, bytes([content[0] ^ 1]) + content[1:])


def climb_out(entries: Entries, manifest: Manifest) -> None:
    add(entries, manifest, "../escaped", b"x")


def climb_out_of_an_inspection(entries: Entries, manifest: Manifest) -> None:
    add(entries, manifest, f"inspections/{32 * 'a'}/../escaped", b"x")


def be_absolute(entries: Entries, manifest: Manifest) -> None:
    add(entries, manifest, "/escaped", b"x")


def link(entries: Entries, manifest: Manifest) -> None:
    add(
        entries, manifest, f"inspections/{32 * 'a'}/video.mp4", b"/etc/passwd", stat.S_IFLNK | 0o777
    )


def make_a_device(entries: Entries, manifest: Manifest) -> None:
    add(entries, manifest, f"inspections/{32 * 'a'}/video.mp4", b"", stat.S_IFBLK | 0o600)


def bring_what_is_not_stated(entries: Entries, manifest: Manifest) -> None:
    add(entries, manifest, f"inspections/{32 * 'a'}/video.mp4", b"x")
    del manifest["files"][f"inspections/{32 * 'a'}/video.mp4"]


def state_what_is_not_there(entries: Entries, manifest: Manifest) -> None:
    manifest["files"]["tokens.json"] = {"size": 1, "sha256": 64 * "0"}


def state_another_size(entries: Entries, manifest: Manifest) -> None:
    manifest["files"]["chainage.db"]["size"] += 1


def swell(entries: Entries, manifest: Manifest) -> None:
    add(entries, manifest, f"inspections/{32 * 'a'}/video.mp4", bytes(2**20))
    entries[-1][0].compress_type = zipfile.ZIP_DEFLATED


def leave_the_video_out(entries: Entries, manifest: Manifest) -> None:
    at = next(i for i, (info, _) in enumerate(entries) if info.filename.endswith(".mp4"))
    del manifest["files"][entries.pop(at)[0].filename]


def leave_the_database_out(entries: Entries, manifest: Manifest) -> None:
    del manifest["files"][entries.pop(0)[0].filename]


def be_of_the_future(entries: Entries, manifest: Manifest) -> None:
    manifest["format"] = 2


def forge_the_database(entries: Entries, manifest: Manifest) -> None:
    entries.pop(0)
    add(entries, manifest, "chainage.db", b"SQLite format 3\0" + bytes(4000))


@pytest.mark.parametrize(
    "change",
    [
        flip_a_byte_of_the_video, climb_out, climb_out_of_an_inspection, be_absolute, link,
        make_a_device, bring_what_is_not_stated, state_what_is_not_there, state_another_size,
        swell, leave_the_video_out, leave_the_database_out, be_of_the_future, forge_the_database,
    ],
)  # fmt: skip
def test_an_archive_that_was_changed_is_refused_and_leaves_nothing(
    tmp_path: Path, archive: Path, change: Callable[[Entries, Manifest], None]
) -> None:
    bad = changed(archive, tmp_path / "bad.zip", change)
    assert_refused(bad, tmp_path)


@pytest.mark.parametrize("part", [0.0, 0.3, 0.999])
def test_an_archive_that_is_cut_off_is_refused(tmp_path: Path, archive: Path, part: float) -> None:
    content = archive.read_bytes()
    cut = tmp_path / "bad.zip"
    cut.write_bytes(content[: round(part * len(content))])
    assert_refused(cut, tmp_path)


def assert_refused(bad: Path, folder: Path) -> None:
    for target in (folder / "new", folder / "empty"):
        (folder / "empty").mkdir(exist_ok=True)
        with pytest.raises((UnusableBackup, UnusableDatabase)) as refusal:
            restore(bad, target, quietly)
        assert str(refusal.value).endswith(".")
    assert sorted(path.name for path in folder.iterdir()) == ["bad.zip", "empty"]
    assert list((folder / "empty").iterdir()) == []


def test_the_unchanged_copy_of_an_archive_is_taken(tmp_path: Path, archive: Path) -> None:
    """So that what is refused above is refused for its change."""
    same = changed(archive, tmp_path / "same.zip", lambda entries, manifest: None)
    assert restore(same, tmp_path / "data", quietly).observations == 1


def test_an_older_backup_stays_when_a_new_one_fails(
    tmp_path: Path, archive: Path, chainage: Command
) -> None:
    shutil.copy(archive, tmp_path / "backup.zip")
    refused = chainage("backup", tmp_path / "backup.zip", "--data", tmp_path / "nowhere")
    assert refused.code == 1
    assert "no database" in refused.err
    assert (tmp_path / "backup.zip").read_bytes() == archive.read_bytes()
