"""Photos, drawings and voice notes of observations, their clips, and what reports show of them."""

from __future__ import annotations

import io
import itertools
import sqlite3
import uuid
import zipfile
from contextlib import closing
from pathlib import Path
from typing import Any

import av
import openpyxl
import pypdfium2
import pytest
from builders import HEIGHT, WIDTH, Client, assert_error, frame_number, serving
from lxml import html
from PIL import Image
from surveys import Survey

from app.data_folder import reading
from app.reports import pdf as document
from app.reports.bundle.verify import verify
from app.reports.html import web_page
from app.reports.pdf import emergency
from app.reports.report import Extras
from app.reports.tables import spreadsheet
from app.settings import Settings
from app.storage.database.backup import back_up, restore
from app.survey.distances.track_rows import estimate_at

pytestmark = pytest.mark.usefixtures("photos_are_waited_for")

VOICE = b"\x1aE\xdf\xa3 as a browser's recorder gives it"
ARROW = {"kind": "arrow", "points": [[40.0, 130.0], [90.0, 60.0]], "colour": "red"}
TEXT = {"kind": "text", "points": [[100.0, 100.0]], "colour": "yellow", "text": "root"}


def one(inspection: str, tag: str, name: str, what: str = "") -> str:
    path = f"/api/inspections/{inspection}/observations/{tag}/attachments/{name}"
    return f"{path}/{what}" if what else path


def attach(client: Client, inspection: str, tag: str, **fields: Any) -> dict[str, Any]:
    answer = client.put(one(inspection, tag, str(uuid.uuid4())), json=fields)
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def say(client: Client, inspection: str, tag: str, name: str, sound: bytes = VOICE) -> Any:
    headers = {"Content-Type": "audio/webm;codecs=opus"}
    query = {"duration_s": 3.5}
    return client.put(
        one(inspection, tag, name, "voice"), content=sound, headers=headers, params=query
    )


def of(client: Client, inspection: str, tag: str) -> list[dict[str, Any]]:
    listed = client.get(f"/api/inspections/{inspection}/attachments").json()["attachments"]
    return [item for item in listed if item["observation_id"] == tag]


def test_photos_and_drawings_are_of_their_frames_and_in_the_order_of_the_person(
    shared: Client, done: str
) -> None:
    tag = shared.tag(done, frame=10, code="BAB").json()["id"]
    later = attach(shared, done, tag, kind="photo", frame=25, rank=2)
    drawing = attach(shared, done, tag, kind="drawing", frame=10, rank=1, strokes=[ARROW, TEXT])
    assert [item["id"] for item in of(shared, done, tag)] == [drawing["id"], later["id"]]
    assert drawing["strokes"] == [ARROW, TEXT]
    assert [frame_number(shared.get(item["file"]).content) for item in (later, drawing)] == [25, 10]
    moved = {"kind": "photo", "frame": 25, "rank": -1}
    assert shared.put(one(done, tag, later["id"]), json=moved).json()["rank"] == -1
    assert of(shared, done, tag)[0]["id"] == later["id"]
    assert_error(
        shared.put(one(done, tag, later["id"]), json=moved | {"frame": 5}), 422, "invalid_request"
    )
    assert_error(
        shared.put(one(done, tag, str(uuid.uuid4())), json=moved | {"frame": 5000}),
        422,
        "frame_outside_video",
    )
    strokes = moved | {"strokes": [ARROW]}
    assert_error(
        shared.put(one(done, tag, str(uuid.uuid4())), json=strokes), 422, "invalid_request"
    )


def test_a_deleted_attachment_comes_back_and_the_history_has_it(shared: Client, done: str) -> None:
    tag = shared.tag(done, frame=12).json()["id"]
    photo = attach(shared, done, tag, kind="photo", frame=20)
    assert [shared.delete(one(done, tag, photo["id"])).status_code for _ in range(2)] == [204, 204]
    assert of(shared, done, tag) == []
    assert_error(shared.get(photo["file"]), 404, "attachment_not_found")
    assert shared.post(one(done, tag, photo["id"], "restore")).json() == photo
    assert frame_number(shared.get(photo["file"]).content) == 20
    events = shared.get(f"/api/inspections/{done}/events", params={"observation": tag}).json()
    actions = [event["action"] for event in events["events"]]
    assert actions[:3] == ["attached", "detached", "attached"]
    other = shared.tag(done, frame=13).json()["id"]
    assert_error(shared.delete(one(done, other, photo["id"])), 404, "attachment_not_found")


def test_a_voice_note_is_kept_whole_and_may_be_sent_again(shared: Client, done: str) -> None:
    tag, name = shared.tag(done, frame=14).json()["id"], str(uuid.uuid4())
    first, again = (say(shared, done, tag, name) for _ in range(2))
    assert first.json() == again.json()
    assert first.json()["duration_s"] == 3.5
    part = shared.get(first.json()["file"], headers={"Range": "bytes=5-"})
    assert (part.status_code, part.content) == (206, VOICE[5:])
    assert part.headers["Content-Type"] == "audio/webm"
    assert_error(say(shared, done, tag, name, b"another"), 422, "invalid_request")
    assert_error(say(shared, done, tag, str(uuid.uuid4()), bytes(2**20 + 1)), 413, "body_too_large")
    nobody = say(shared, done, str(uuid.uuid4()), str(uuid.uuid4()))
    assert_error(nobody, 404, "observation_not_found")
    page = {"content": b"<script>", "headers": {"Content-Type": "text/html"}}
    path = one(done, tag, str(uuid.uuid4()), "voice")
    refused = shared.put(path, params={"duration_s": 1}, **page)
    assert_error(refused, 415, "wrong_content_type")


def test_an_observation_has_a_bounded_number_of_attachments(
    shared: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.storage.records.attachments.MOST", 2)
    tag = shared.tag(done, frame=15).json()["id"]
    for _ in range(2):
        assert say(shared, done, tag, str(uuid.uuid4())).status_code == 200
    assert_error(say(shared, done, tag, str(uuid.uuid4())), 409, "too_many_attachments")


def test_a_clip_has_the_frames_around_the_tag_at_their_own_times(shared: Client, done: str) -> None:
    tag = shared.tag(done, frame=30).json()["id"]
    path = f"/api/inspections/{done}/observations/{tag}/clip"
    whole = shared.get(path)
    assert whole.headers["Content-Type"] == "video/mp4"
    assert shared.get(path, headers={"Range": "bytes=4-7"}).content == b"ftyp"
    with av.open(io.BytesIO(whole.content)) as container:
        assert container.streams.video[0].codec_context.name == "h264"
        frames = list(container.decode(video=0))
    # The film has 40 frames of 1/25 s: the clip of 3 s to both sides is the whole of it.
    assert len(frames) == 40
    times = [float(frame.pts * frame.time_base) for frame in frames]
    steps = [b - a for a, b in itertools.pairwise(times)]
    assert steps == pytest.approx([0.04] * 39, abs=1e-4)
    buffer = io.BytesIO()
    frames[30].to_image().save(buffer, "PNG")
    assert frame_number(buffer.getvalue()) == 30


def test_a_file_that_has_changed_on_the_disk_is_not_given_away(shared: Client, done: str) -> None:
    tag, name = shared.tag(done, frame=16).json(), str(uuid.uuid4())
    photo = attach(shared, done, tag["id"], kind="photo", frame=20)
    sound = say(shared, done, tag["id"], name).json()
    photos = shared.data / "inspections" / done / "photos"
    (photos / f"{tag['id']}-16.jpg").write_bytes((photos / f"{photo['id']}-20.jpg").read_bytes())
    (photos / f"{photo['id']}-20.jpg").write_bytes(b"no picture")
    (photos.parent / "voice" / f"{name}.webm").write_bytes(VOICE[::-1])
    paths = [tag["photo"], photo["file"], sound["file"]]
    paths += [f"/api/inspections/{done}/photos/{one}" for one in (tag["id"], photo["id"])]
    for path in paths:
        assert_error(shared.get(path), 404, "blob_changed")
    shared.delete(f"/api/inspections/{done}/observations/{tag['id']}")


def test_the_bundle_has_photos_as_taken_and_marked_and_what_was_said(
    server: Client, done: str, tmp_path: Path
) -> None:
    tag = server.tag(done, frame=10, code="BAB", severity=3).json()["id"]
    drawing = attach(server, done, tag, kind="drawing", frame=12, rank=1, strokes=[ARROW])
    say(server, done, tag, str(uuid.uuid4()))
    query = {"burnt_in": True, "clips": True}
    bundle = server.get(f"/api/inspections/{done}/exports/zip", params=query)
    (tmp_path / "bundle.zip").write_bytes(bundle.content)
    assert verify(tmp_path / "bundle.zip").is_right
    with zipfile.ZipFile(tmp_path / "bundle.zip") as archive:
        names = {name for name in archive.namelist() if "/" in name and "exchange/" not in name}
        read = {name: archive.read(name) for name in names}
    (stem,) = {name.partition("/")[2].partition("-001")[0] for name in names}
    assert names == {
        f"photos/{stem}-001.jpg", f"photos/{stem}-001-marked.jpg",
        f"photos/{stem}-001-2.jpg", f"photos/{stem}-001-2-marked.jpg",
        f"voice/{stem}-001-1.webm", f"clips/{stem}-001.mp4",
    }  # fmt: skip
    assert read[f"voice/{stem}-001-1.webm"] == VOICE
    assert read[f"photos/{stem}-001-2.jpg"] == server.get(drawing["file"]).content
    marked = Image.open(io.BytesIO(read[f"photos/{stem}-001-2-marked.jpg"]))
    assert marked.width == WIDTH
    assert marked.height > HEIGHT  # the caption hides nothing of the picture
    red, green, _ = marked.getpixel((65, 95))  # the middle of the arrow
    assert red > 180 > green + 60
    taken = Image.open(io.BytesIO(read[f"photos/{stem}-001-2.jpg"])).convert("RGB")
    assert max(taken.getpixel((65, 95))) - min(taken.getpixel((65, 95))) < 30
    path = f"/api/inspections/{done}/photos/{drawing['id']}"
    plain = Image.open(io.BytesIO(server.get(path).content))
    assert plain.size == (WIDTH, HEIGHT)
    assert Image.open(io.BytesIO(server.get(path, params=query).content)).size == marked.size
    page = server.get(f"/api/inspections/{done}/exports/html").text
    assert page.count('<div class="photo"><img src="data:image/jpeg') == 2


def test_a_photo_of_another_frame_is_captioned_with_its_own_place_and_time(
    survey: Survey, tmp_path: Path
) -> None:
    with serving(survey.copied_to(tmp_path)) as client:
        tag = client.tag(survey.id, frame=2, code="BAB", severity=5).json()
        further = attach(client, survey.id, tag["id"], kind="photo", frame=38, rank=-1)
        drawing = {"kind": "drawing", "strokes": [ARROW], "rank": 2}
        here, there = (
            attach(client, survey.id, tag["id"], frame=frame, **drawing)["id"] for frame in (2, 38)
        )
    with reading(Settings(data=tmp_path)) as records:
        extras = Extras(burnt_in=True, film_path="film.mp4")
        made = records.reports.builder.report(survey.id, extras=extras)
    (entry,) = made.entries
    at = estimate_at(made.track, 38)
    place = f"{at.distance_mm / 1000:.2f} m"
    burnt = {photo.of: photo.marked.caption for photo in entry.photos if photo.marked}
    for own in (tag["id"], here):
        assert burnt[own].startswith(f"{tag['distance_m']:.2f} m ±")
    for other in (further["id"], there):
        assert burnt[other].startswith(f"taken at {place} ±")
    page = html.fromstring(web_page.write(made).content)
    captions = {
        caption.text_content().split("·")[1].strip().partition(" ±")[0]: caption.xpath(".//@href")
        for caption in page.xpath("//figcaption")
    }
    assert captions.keys() == {f"{tag['distance_m']:.2f} m", f"taken at {place}"}
    assert captions[f"taken at {place}"][-1] == f"film.mp4#t={at.time_s:.10g}"
    for form, times in ((document, 2), (emergency, 1)):
        with pypdfium2.PdfDocument(form.write(made).content) as pdf:
            text = "".join(each.get_textpage().get_text_range() for each in pdf)
        assert text.count(f"taken at {place}") == times
    book = openpyxl.load_workbook(io.BytesIO(spreadsheet.write(made).content))
    cells = [cell.value for row in book[book.sheetnames[0]] for cell in row]
    assert any(str(cell).startswith(f"taken at {place} ±") for cell in cells)


def test_a_backup_has_attachments_and_a_deleted_inspection_leaves_none(
    survey: Survey, tmp_path: Path
) -> None:
    with serving(survey.copied_to(tmp_path / "data")) as client:
        tag = client.tag(survey.id, frame=10).json()["id"]
        photo = attach(client, survey.id, tag, kind="photo", frame=20)
        note = say(client, survey.id, tag, str(uuid.uuid4())).json()
        back_up(tmp_path / "data", tmp_path / "backup.zip", lambda _done, _total: None)
        (film,) = (tmp_path / "data" / "inspections").glob("*/video.mp4")
        film.unlink()  # it may be a link to the film of other tests
        film.write_bytes(b"no film")
        refused = client.get(f"/api/inspections/{survey.id}/observations/{tag}/clip")
        assert_error(refused, 422, "unreadable_video")
        client.delete(f"/api/inspections/{survey.id}")
    assert not list((tmp_path / "data" / "inspections").iterdir())
    with closing(sqlite3.connect(tmp_path / "data" / "chainage.db")) as database:
        assert database.execute("SELECT count(*) FROM attachments").fetchone() == (0,)
    restore(tmp_path / "backup.zip", tmp_path / "restored", lambda _done, _total: None)
    place = tmp_path / "restored" / "inspections" / survey.id
    assert (place / "voice" / f"{note['id']}.webm").read_bytes() == VOICE
    assert frame_number((place / "photos" / f"{photo['id']}-20.jpg").read_bytes()) == 20
