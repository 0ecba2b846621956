"""What the lists show of an inspection: its labels, its small picture, and where it belongs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from builders import Client, assert_error, frame_number, make_clip
from hostile import write_clip

TAGS = [f"7d444840-9dc0-4d2a-8a6a-00000000000{n}" for n in range(3)]


def label(client: Client, inspection_id: str, *labels: str) -> list[str]:
    answer = client.put(f"/api/inspections/{inspection_id}/labels", json={"labels": labels})
    assert answer.status_code == 200, answer.text
    found: list[str] = answer.json()["labels"]
    return found


def listed(client: Client, **query: Any) -> list[str]:
    answer = client.get("/api/inspections", params=query).raise_for_status().json()
    return [one["id"] for one in answer["inspections"]]


def review(client: Client, inspection_id: str, *states: str) -> None:
    for state in states:
        path = f"/api/inspections/{inspection_id}/review"
        client.post(path, json={"state": state}).raise_for_status()


def test_labels_sort_the_list_and_outlive_export_and_import(server: Client, done: str) -> None:
    assert label(server, done, " invoiced ", "Urgent", "urgent") == ["Urgent", "invoiced"]
    assert server.inspection(done)["labels"] == ["Urgent", "invoiced"]
    in_use = server.get("/api/inspections/labels").json()["labels"]
    assert in_use == [{"label": name, "inspections": 1} for name in ("Urgent", "invoiced")]

    content = server.get(f"/api/inspections/{done}/exports/json").content
    label(server, done, "invoiced")
    assert server.get(f"/api/inspections/{done}/exports/json").content != content
    made = server.post("/api/imports", params={"filename": "again.json"}, content=content)
    (other,) = (one["id"] for one in made.json()["inspections"])
    assert set(listed(server, label="invoiced")) == {done, other}
    assert listed(server, label="Urgent") == [other]
    ids = server.get("/api/inspections/ids", params={"label": "Urgent"}).json()
    assert ids == {"ids": [other]}

    last = server.get(f"/api/inspections/{done}/events").json()["events"][0]
    assert (last["action"], last["after"]) == ("labelled", {"labels": ["invoiced"]})
    server.delete(f"/api/inspections/{other}").raise_for_status()
    assert len(server.get("/api/inspections/labels").json()["labels"]) == 1


def test_an_approved_inspection_still_gets_labels(shared: Client, own: str) -> None:
    review(shared, own, "submitted", "in_review", "approved")
    assert label(shared, own, "invoiced") == ["invoiced"]
    assert listed(shared, review="approved", label="invoiced") == [own]


@pytest.mark.parametrize("labels", [[""], ["a" * 51], ["a\nb"], [str(n) for n in range(21)], None])
def test_what_is_no_label_is_refused(shared: Client, done: str, labels: Any) -> None:
    answer = shared.put(f"/api/inspections/{done}/labels", json={"labels": labels})
    assert_error(answer, 422, "invalid_request")
    assert_error(shared.put(f"/api/inspections/{'0' * 32}/labels", json={"labels": []}), 404,
                 "inspection_not_found")  # fmt: skip


def test_the_thumbnail_is_the_photo_of_the_worst_defect(shared: Client, own: str) -> None:
    path = f"/api/inspections/{own}/thumbnail"
    film = shared.get(path)
    assert (film.status_code, film.headers["Content-Type"]) == (200, "image/jpeg")
    shared.tag(own, TAGS[0], frame=5, code="BAB", severity=1).raise_for_status()
    shared.tag(own, TAGS[1], frame=30, code="BAC", severity=4).raise_for_status()
    worst = shared.get(path)
    assert worst.headers["ETag"] != film.headers["ETag"]
    photo = shared.get(f"/api/inspections/{own}/observations/{TAGS[1]}/photo").content
    small, whole = (
        cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR).astype(float)
        for jpeg in (worst.content, photo)
    )
    assert small.shape[1] == min(whole.shape[1], 240)
    assert frame_number(photo) == 30
    expected = cv2.resize(whole, small.shape[1::-1], interpolation=cv2.INTER_AREA)
    assert np.abs(small - expected).mean() < 3
    unchanged = shared.get(path, headers={"If-None-Match": worst.headers["ETag"]})
    assert (unchanged.status_code, unchanged.content) == (304, b"")


def test_an_inspection_without_a_film_has_no_thumbnail(shared: Client) -> None:
    text = b"#B01=AAA;AAD;ABF\nCV-9;Here;2024-05-01\n#C=I;A;B;C\n1;BAB;B;A\n#Z\n"
    made = shared.post("/api/imports", params={"filename": "old.txt"}, content=text)
    (old,) = made.raise_for_status().json()["inspections"]
    assert_error(shared.get(f"/api/inspections/{old['id']}/thumbnail"), 404, "photo_not_found")


def test_a_photo_is_of_its_frame_where_other_parts_of_the_film_have_its_time(
    shared: Client, tmp_path: Path
) -> None:
    """The track ends where the size changes, so its times do not show that they begin anew; nor do
    they while the film is tracked.
    """
    parts = make_clip(tmp_path / "a.ts", 40), write_clip(tmp_path / "b.ts", frames=80)
    joined = tmp_path / "joined.ts"
    joined.write_bytes(b"".join(part.read_bytes() for part in parts))
    film = shared.tracked(joined)
    tag = shared.tag(film, TAGS[0], frame=38).json()
    photo = shared.get(f"/api/inspections/{film}/observations/{tag['id']}/photo")
    assert frame_number(photo.content) == 38


def test_a_film_of_one_picture_has_a_thumbnail(shared: Client, tmp_path: Path) -> None:
    """No picture is shown in its middle."""
    film = shared.tracked(make_clip(tmp_path / "one.mp4", 1))
    picture = shared.get(f"/api/inspections/{film}/thumbnail")
    assert (picture.status_code, frame_number(picture.content)) == (200, 0)
