"""An archive file carries an inspection whole to another server, or not at all."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
import struct
import uuid
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from builders import Client, assert_error, frame_number, serving, wait_until
from object_stores import ObjectStore
from proposals import finding, settle
from small_disk import small_disk
from surveys import Survey

from app.access.access import create_token
from app.errors import InvalidImport
from app.imports.moved import archive_file, chainage_json
from app.storage.database.backup import back_up, restore
from app.storage.database.database import FILE, Database
from app.storage.folder.tokens import Role, TokenFile

VOICE = b"\x1aE\xdf\xa3 as a browser's recorder gives it"
ARROW = {"kind": "arrow", "points": [[40.0, 130.0], [90.0, 60.0]], "colour": "red"}
PACK = (
    "code,char1,char2,label,group,needs_clock,needs_q1,unit_q1,needs_q2,unit_q2,"
    "continuous_allowed,grade_s\nSCR,,,Scour at the outlet,S,no,opt,mm,no,,no,3\n"
)
PROJECT = "Ring road"
TEMPLATE = {"grade": "structural", "costs": True, "currency": "MYR", "company_name": "Jurutera"}
CAME_ALONG = [
    "The code pack Own came along and was added.",
    "The report template came along and is now that of the project Ring road.",
]
NO_FILM: dict[str, str | int] = {"kind": "upload", "filename": "a.mp4", "size": 1}
NO_FILM |= {"sha256": hashlib.sha256(b"x").hexdigest()}
"""What a report says of a file `x`, which is no film."""
Members = dict[str, bytes]


def archive(client: Client, inspection_id: str, *, film: bool) -> bytes:
    answer = client.get(f"/api/inspections/{inspection_id}/exports/archive", params={"film": film})
    assert answer.status_code == 200, answer.text
    return answer.content


def bring(client: Client, content: bytes, **options: Any) -> httpx.Response:
    upload = client.upload(content, "CUL-7.chainage.zip")
    return client.post("/api/imports/archive", json={"upload_id": upload}, **options)


def moved(client: Client, content: bytes) -> tuple[str, list[str]]:
    answer = bring(client, content)
    assert answer.status_code == 201, answer.text
    (inspection,) = answer.json()["inspections"]
    return str(inspection["id"]), list(answer.json()["warnings"])


def members(content: bytes) -> Members:
    """Read and check an archive file with nothing of the program."""
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        assert file.testzip() is None
        found = {name: file.read(name) for name in file.namelist()}
    listed = json.loads(found["manifest.json"])["files"]
    assert listed == {
        name: {"size": len(part), "sha256": hashlib.sha256(part).hexdigest()}
        for name, part in found.items()
        if name != "manifest.json"
    }
    return found


def but_for_dates(content: bytes) -> dict[str, Any]:
    """Return the files of an archive but for the moment of the export."""
    found: dict[str, Any] = dict(members(content))
    report = json.loads(found["inspection.json"])
    del report["exported_at"]
    found["inspection.json"] = report
    manifest = json.loads(found["manifest.json"])
    del manifest["made_at"], manifest["files"]["inspection.json"]
    found["manifest.json"] = manifest
    return found


@pytest.fixture(scope="module")
def source(
    survey: Survey, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Client, str]]:
    """A server, and an approved inspection with everything that a person can state."""
    with serving(survey.copied_to(tmp_path_factory.mktemp("source"))) as client:
        headers = {"Content-Type": "text/csv"}
        pack = client.post("/api/packs", params={"name": "Own"}, content=PACK, headers=headers)
        done = survey.id
        path = f"/api/inspections/{done}"
        assert client.put(f"/api/report-templates/{PROJECT}", json=TEMPLATE).is_success
        header = {"asset_id": "CUL-7", "code_pack": pack.json()["id"], "project": PROJECT}
        named = client.patch(path, json={"name": "Jalan Besar", "header": header})
        assert named.is_success, named.text
        tag = client.tag(done, frame=10, code="SCR", remark="deep").json()["id"]
        client.tag(done, frame=20, pixel=[200.0, 100.0], severity=4)
        beside = f"{path}/observations/{tag}/attachments"
        drawing = {"kind": "drawing", "frame": 25, "rank": -1, "strokes": [ARROW]}
        for stated in ({"kind": "photo", "frame": 30}, drawing):
            assert client.put(f"{beside}/{uuid.uuid4()}", json=stated).is_success
        answer = client.put(
            f"{beside}/{uuid.uuid4()}/voice",
            content=VOICE,
            headers={"Content-Type": "audio/webm"},
            params={"duration_s": 3.5},
        )
        assert answer.is_success, answer.text
        client.put(f"{path}/labels", json={"labels": ["north"]})
        said = {"observation": tag, "kind": "comment", "text": "seen", "version": None}
        assert client.put(f"{path}/review/remarks/{uuid.uuid4()}", json=said).is_success
        proposed = finding(done), finding(done, 120.0, length=None, code={"code": "SCR"})
        settle(client, done, *proposed)
        assert client.post(f"{path}/findings/{proposed[0].id}/reject").is_success
        wait_until(lambda: len(photos_of(client, done)) == 4)
        for state in ("submitted", "in_review", "approved"):
            assert client.post(f"{path}/review", json={"state": state, "reason": None}).is_success
        yield client, done


def photos_of(client: Client, inspection_id: str) -> list[str]:
    path = f"/api/inspections/{inspection_id}"
    shown = [row["photo"] for row in client.get(f"{path}/observations").json()["observations"]]
    attached = client.get(f"{path}/attachments").json()["attachments"]
    shown += [row["file"] for row in attached if row["kind"] != "voice"]
    return [photo for photo in shown if photo]


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with serving(tmp_path_factory.mktemp("target")) as client:
        yield client


@pytest.fixture(scope="module")
def whole(source: tuple[Client, str]) -> bytes:
    return archive(*source, film=True)


def test_it_goes_to_another_server_whole_and_back_out_the_same(
    source: tuple[Client, str], whole: bytes, clip: Path, tmp_path: Path
) -> None:
    client, done = source
    assert members(whole)["film/video.mp4"] == clip.read_bytes()
    with serving(tmp_path / "other") as other:
        back, warnings = moved(other, whole)
        assert (back, warnings) == (done, CAME_ALONG)
        here, there = (but_for_dates(each) for each in (archive(other, back, film=True), whole))
        for part in there["inspection.json"]:
            assert here["inspection.json"][part] == there["inspection.json"][part], part
        assert here == there
        shown = other.inspection(back)
        assert shown["review"]["state"] == "approved"
        assert (shown["video"]["playable"], shown["labels"]) == (True, ["north"])
        review, first = (
            each.get(f"/api/inspections/{done}/review").json() for each in (other, client)
        )
        assert review["remarks"] == first["remarks"]
        findings = [
            each.get(f"/api/inspections/{done}/findings").json() for each in (other, client)
        ]
        assert findings[0]["findings"] == findings[1]["findings"]
        assert findings[0]["counts"] == {"offered": 1, "accepted": 0, "rejected": 1}
        assert [step["state"] for step in review["steps"]] == [
            "submitted", "in_review", "approved",
        ]  # fmt: skip
        part = other.get(f"/api/inspections/{back}/video", headers={"Range": "bytes=0-99"})
        assert part.content == clip.read_bytes()[:100]
        numbers = sorted(frame_number(other.get(photo).content) for photo in photos_of(other, back))
        assert numbers == [10, 20, 25, 30]
        path = f"/api/inspections/{back}"
        assert other.get(f"{path}/exports/csv").content == (
            client.get(f"{path}/exports/csv").content
        )
        again, _ = moved(other, whole)  # beside itself, under an id of its own
        assert again != back
        locked = other.tag(back, frame=5)
        assert_error(locked, 409, "inspection_locked")
        for each in (back, again):
            other.post(
                f"/api/inspections/{each}/review", json={"state": "reopened", "reason": "more"}
            )
        assert other.tag(back, frame=5).is_success
        back_up(tmp_path / "other", tmp_path / "backup", lambda *_: None)
        assert other.delete(f"/api/inspections/{again}").status_code == 204
        assert not (tmp_path / "other" / "inspections" / again).exists()
        left = [p.name for p in (tmp_path / "other" / "inspections").iterdir()]
        assert (left, list((tmp_path / "other" / "uploads").iterdir())) == ([back], [])
    restore(tmp_path / "backup", tmp_path / "restored", lambda *_: None)
    with serving(tmp_path / "restored") as restored:
        assert "film/video.mp4" in members(archive(restored, again, film=True))


def test_it_goes_to_a_server_with_an_object_store(
    whole: bytes, object_store: ObjectStore, tmp_path: Path
) -> None:
    url = object_store.new()
    with serving(tmp_path / "data", store=url) as client:
        empty = object_store.keys(url)
        foreign = packed(with_report(members(whole) | {"film/video.mp4": b"x"}, source=NO_FILM))
        assert_error(bring(client, foreign), 422, "unreadable_video")
        damaged = bytearray(whole)
        damaged[whole.index(b"ftyp") + 1000] ^= 1
        answer = bring(client, bytes(damaged))
        assert "film/video.mp4 is not the file" in assert_error(answer, 422, "invalid_import")
        assert object_store.keys(url) == empty
        back, warnings = moved(client, whole)
        assert warnings == CAME_ALONG
        assert but_for_dates(archive(client, back, film=True)) == but_for_dates(whole)
        film = members(whole)["film/video.mp4"]
        part = client.get(f"/api/inspections/{back}/video", headers={"Range": "bytes=0-99"})
        assert part.content == film[:100]
        numbers = sorted(frame_number(client.get(it).content) for it in photos_of(client, back))
        assert numbers == [10, 20, 25, 30]
        assert [path.name for path in (tmp_path / "data" / "inspections").iterdir()] == []
        reopened = {"state": "reopened", "reason": "more"}
        client.post(f"/api/inspections/{back}/review", json=reopened)
        assert client.delete(f"/api/inspections/{back}").status_code == 204
        assert object_store.keys(url) == empty


def test_without_the_film_the_file_says_so(
    source: tuple[Client, str], target: Client, tmp_path: Path
) -> None:
    small = archive(*source, film=False)
    manifest = json.loads(members(small)["manifest.json"])
    assert manifest["missing"] == ["film/video.mp4"]
    create_token(TokenFile(target.data), "Ana", Role.OPERATOR)
    back, warnings = moved(target, small)
    assert any("does not contain the film;" in warning for warning in warnings)
    assert len(photos_of(target, back)) == 4
    assert_error(target.post(f"/api/inspections/{back}/retry"), 409, "nothing_recorded")
    again = members(archive(target, back, film=False))
    assert json.loads(again["manifest.json"])["missing"] == []
    photos = [name for name in again if name.startswith("photos/")]
    assert {name: again[name] for name in photos} == {
        name: part for name, part in members(small).items() if name in photos
    }


def test_only_an_admin_brings_an_approval_along(target: Client, whole: bytes) -> None:
    secret = create_token(TokenFile(target.data), "Ben", Role.OPERATOR)
    answer = bring(target, whole, headers={"Authorization": f"Bearer {secret}"})
    assert answer.status_code == 201, answer.text
    (inspection,) = answer.json()["inspections"]
    assert inspection["review"]["state"] == "submitted"
    assert any("approved it where it comes from" in text for text in answer.json()["warnings"])


@pytest.mark.parametrize("own", [True, False], ids=["own template", "own inspection"])
def test_a_project_that_is_here_keeps_its_template_and_what_differs_is_named(
    whole: bytes, tmp_path: Path, own: bool
) -> None:
    with serving(tmp_path, company_name="North Ltd") as client:
        if own:
            kept = TEMPLATE | {"currency": "EUR", "company_name": ""}
            client.put(f"/api/report-templates/{PROJECT}", json=kept)
            named = "the company, costs and currency"
        else:
            text = b"#B01=AAA\nP1\n#C=I;A\n1.5;BAB\n#Z\n"
            other = client.post("/api/imports", params={"filename": "a.txt"}, content=text)
            (one,) = other.json()["inspections"]
            header = {"header": {"project": PROJECT}}
            assert client.patch(f"/api/inspections/{one['id']}", json=header).is_success
            named = "the company, the rule of the grade, costs and currency"
        before = client.get(f"/api/report-templates/{PROJECT}").json()
        _, warnings = moved(client, whole)
        assert any(warning.endswith(f"comes from, {named} differ.") for warning in warnings)
        assert client.get(f"/api/report-templates/{PROJECT}").json() == before
        report = json.loads(members(whole)["inspection.json"])
        report["report_template"]["grade"] = "best"
        changed = {"inspection.json": json.dumps(report).encode()}
        broken = packed(members(whole) | changed)
        assert "template" in assert_error(bring(client, broken), 422, "invalid_import")


def test_photos_may_be_embedded_in_json(source: tuple[Client, str], target: Client) -> None:
    client, done = source
    path = f"/api/inspections/{done}/exports/json"
    full = client.get(path, params={"photos": "embedded"}).json()
    assert len(full["media"]) == 5
    assert base64.b64decode(next(v for n, v in full["media"].items() if n.startswith("voice"))) == (
        VOICE
    )
    query = {"filename": "report.json"}
    answer = target.post("/api/imports", params=query, content=json.dumps(full).encode())
    assert answer.status_code == 201, answer.text
    assert "does not contain the film, the picture of the wall;" in answer.json()["warnings"][0]
    assert len(photos_of(target, answer.json()["inspections"][0]["id"])) == 4
    voice = next(name for name in full["media"] if name.startswith("voice"))
    for part, row in (("tags", 0), ("attachments", 0)):
        changed = json.loads(json.dumps(full))
        changed[part][row] |= {"photo": voice, "file": voice, "kind": "photo", "media_type": None}
        with pytest.raises(InvalidImport, match=rf"{part}\.{row}"):
            chainage_json.read(json.dumps(changed).encode())
    full["media"] |= dict.fromkeys(list(full["media"])[:1], base64.b64encode(b"<html>").decode())
    answer = target.post("/api/imports", params=query, content=json.dumps(full).encode())
    assert "no picture in JPEG" in assert_error(answer, 422, "invalid_import")


def packed(found: Members, **forms: int) -> bytes:
    """Write a ZIP whose manifest fits its files."""
    files = {name: part for name, part in found.items() if name != "manifest.json"}
    manifest = json.loads(found["manifest.json"])
    manifest["files"] = {
        name: {"size": len(part), "sha256": hashlib.sha256(part).hexdigest()}
        for name, part in files.items()
    }
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as file:
        for name, part in {**files, "manifest.json": json.dumps(manifest).encode()}.items():
            file.writestr(name, part, forms.get("compression", zipfile.ZIP_STORED))
    return out.getvalue()


def with_report(found: Members, **changed: Any) -> Members:
    report = json.loads(found["inspection.json"])
    report["inspection"] |= changed
    return found | {"inspection.json": json.dumps(report).encode()}


def _flipped(content: bytes) -> bytes:
    at = content.index(VOICE)
    return content[:at] + b"?" + content[at + 1 :]


def _torn(whole: bytes) -> bytes:
    """Damage the stream of the report within the ZIP."""
    content = bytearray(whole)
    at = content.index(b"inspection.json") + len("inspection.json")
    content[at : at + 40] = 40 * b"\xff"
    return bytes(content)


def _shifted(whole: bytes) -> bytes:
    """Say that the directory begins later than it does: so does every file, by the same bytes."""
    at = whole.rindex(b"PK\x05\x06") + 16
    (offset,) = struct.unpack_from("<I", whole, at)
    return whole[:at] + struct.pack("<I", offset + 100) + whole[at + 4 :]


def _misnamed(whole: bytes) -> bytes:
    """Name a file in bytes that are no UTF-8, though the ZIP says so."""
    zipped = _zip({"\u00e9.json": b"{}"})
    return zipped.replace("\u00e9".encode(), b"\xff\xff")


HOSTILE: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "truncated": (lambda whole: whole[: len(whole) // 2], "cut off or damaged"),
    "no zip": (lambda whole: b"PK\x03\x04 hello", "cut off or damaged"),
    "damaged": (_flipped, "damaged"),
    "a torn stream": (_torn, "damaged"),
    "a false directory offset": (_shifted, "before the file"),
    "letters of no name": (_misnamed, "damaged"),
    "wrong digest": (
        lambda whole: packed(members(whole)).replace(VOICE, VOICE[::-1]),
        "damaged",
    ),
    "foreign": (lambda whole: packed({"manifest.json": b"{}", "a.txt": b"x"}), "'a.txt'"),
    "no manifest": (lambda whole: _zip({"inspection.json": b"{}"}), "no manifest.json"),
    "traversal": (
        lambda whole: packed(members(whole) | {"photos/../../chainage.db": b"x"}),
        "'photos/../../chainage.db'",
    ),
    "unlisted": (lambda whole: _added(whole, "photos/more.jpg"), "does not list"),
    "twice": (lambda whole: _added(whole, "inspection.json"), "two files"),
    "bomb": (lambda whole: _zip({"manifest.json": bytes(65 * 2**20)}), "may have 64"),
    "compressed photo": (
        lambda whole: packed(members(whole), compression=zipfile.ZIP_DEFLATED),
        "is compressed",
    ),
    "no photo": (
        lambda whole: packed(members(whole) | {"photos/CUL-7-001.jpg": b"<svg/>"}),
        "no picture in JPEG",
    ),
    "another film": (
        lambda whole: packed(members(whole) | {"film/video.mp4": b"x"}),
        "not that of the inspection",
    ),
}


def _zip(found: Members) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as file:
        for name, part in found.items():
            file.writestr(name, part)
    return out.getvalue()


def _added(whole: bytes, name: str) -> bytes:
    out = io.BytesIO(whole)
    with zipfile.ZipFile(out, "a") as file:
        file.writestr(name, b"x")
    return out.getvalue()


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("kind", HOSTILE)
def test_a_file_that_is_not_whole_is_refused_with_a_reason(
    whole: bytes, kind: str, tmp_path: Path
) -> None:
    """In this process; that the server reads in another one is tested below."""
    spoil, said = HOSTILE[kind]
    path = tmp_path / "archive.zip"
    path.write_bytes(spoil(whole))
    with pytest.raises(InvalidImport, match=re.escape(said)):
        archive_file.read(path)


def test_nothing_is_stored_of_a_file_that_is_refused(target: Client, whole: bytes) -> None:
    no_film = with_report(members(whole) | {"film/video.mp4": b"x"}, source=NO_FILM)
    before = sorted(path.name for path in (target.data / "inspections").iterdir())
    assert "a.mp4" in assert_error(bring(target, packed(no_film)), 422, "unreadable_video")
    assert_error(bring(target, _flipped(whole)), 422, "invalid_import")
    assert sorted(path.name for path in (target.data / "inspections").iterdir()) == before


def test_neither_a_killed_server_nor_a_full_disk_leaves_anything(
    whole: bytes, tmp_path: Path
) -> None:
    name = json.loads(members(whole)["manifest.json"])["inspection_id"]
    with small_disk(tmp_path / "disk") as disk:
        inspections = disk.place / "data" / "inspections"
        (inspections / name).mkdir(parents=True)
        Database(disk.place / "data" / FILE).close()
        (inspections / name / "video.mp4").write_bytes(b"half")
        for suffix in (".importing", ".import"):
            (inspections / f"{name}{suffix}").write_bytes(b"")
        with serving(disk.place / "data") as client:
            assert list(inspections.iterdir()) == [], "the next start deletes it"
            upload = client.upload(whole, "a.zip")
            disk.fill()
            body = {"upload_id": upload}
            assert_error(client.post("/api/imports/archive", json=body), 507, "disk_full")
            assert list(inspections.iterdir()) == []
            disk.make_room()
            made = client.post("/api/imports/archive", json=body).json()
            assert [one["id"] for one in made["inspections"]] == [name]
            assert_error(client.post("/api/imports/archive", json=body), 404, "upload_not_found")
