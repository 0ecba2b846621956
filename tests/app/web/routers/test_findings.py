"""Proposals on the wall: from the tiles through a user's model to an observation, and back."""

from __future__ import annotations

import sqlite3
import uuid
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
import onnx_files
import pytest
from builders import Client, assert_error, children, serving, wait_until
from proposals import WAITING, finding, findings_of, settle
from surveys import Survey

from app.storage.database.database import FILE, Database
from app.storage.records.findings import FindingStore
from app.storage.records.observations import ObservationStore

FINDS_DARK = """
name: Dark lines
task: segment
input: [128, 128]
mm_per_px: 1.0
colours: grey
output: logits
least_mm: 40
classes: [{kind: crack}]
"""
LINE_MM = ((20.0, -40.0), (100.0, -40.0))
"""Ends of a crack of 4 mm on the wall, axial and arc."""


class Wall:
    """One inspection, as a person sees its findings."""

    def __init__(self, client: Client, inspection_id: str) -> None:
        self.client, self.id = client, inspection_id
        self.path = f"/api/inspections/{self.id}/findings"

    def all(self) -> dict[str, Any]:
        return dict(self.client.get(self.path).json())

    def states(self) -> list[str]:
        return [each["state"] for each in self.all()["findings"]]

    def decide(self, finding_id: str, what: str, name: str = "", **changes: Any) -> httpx.Response:
        sent = {"observation_id": name, "changes": changes} if what == "accept" else None
        return self.client.post(f"{self.path}/{finding_id}/{what}", json=sent)

    def search(self, detector: str) -> dict[str, Any]:
        asked = self.client.post(f"{self.path}/search", json={"detector": detector})
        assert asked.status_code == 200, asked.text
        return wait_until(self._ended)

    def _ended(self) -> dict[str, Any] | None:
        found = self.all()
        return found if found["search"]["state"] in ("done", "failed") else None

    def draw_line(self) -> None:
        """Draw the crack on the tiles, which are grey apart from it."""
        wall = self.client.get(f"/api/inspections/{self.id}/unrolled").json()
        (u0, v), (u1, _) = (
            (round(x / wall["mm_per_px"]), round((y - wall["arc_from_mm"]) / wall["mm_per_px"]))
            for x, y in LINE_MM
        )
        picture = np.full((wall["height_px"], wall["width_px"], 3), 150, np.uint8)
        for index in (-1, 0):
            if index == 0:
                cv2.line(picture, (u0, v), (u1, v), (30, 30, 30), round(4 / wall["mm_per_px"]))
            tile = self.client.data / "inspections" / self.id / "wall" / f"{index}.jpg"
            cv2.imwrite(str(tile), picture)


@pytest.fixture
def wall(shared: Client, own: str) -> Wall:
    """Two offered cracks."""
    wall = Wall(shared, own)
    settle(shared, own, finding(own), finding(own, 120.0))
    return wall


WORKING = ("waiting", "searching")


@pytest.fixture(scope="module")
def model(shared: Client) -> str:
    upload = shared.upload(onnx_files.finds_dark(), "dark.onnx")
    body = {"upload_id": upload, "declaration": FINDS_DARK}
    added = shared.post("/api/detectors", json=body)
    assert added.status_code == 201, added.text
    return str(added.json()["id"])


def test_a_model_of_a_user_finds_a_crack_which_becomes_an_observation(
    shared: Client, own: str, model: str
) -> None:
    wall = Wall(shared, own)
    wall.draw_line()
    listed = wall.search(model)
    assert listed["search"] | {"searched_to_m": 0} == {
        "state": "done", "detail": None, "detector": model, "searched_to_m": 0,
    }  # fmt: skip
    assert listed["counts"] == {"offered": 1, "accepted": 0, "rejected": 0}
    (found,) = listed["findings"]
    assert found["detector"].startswith("Dark lines ")
    assert (found["kind"], found["direction"]) == ("crack", "along")
    assert found["distance_m"] == pytest.approx(0.06, abs=0.003)
    assert found["distance_u95_m"] > 0
    assert found["length_mm"]["low"] < 80 < found["length_mm"]["high"]
    assert found["suggested"]["code"] == "BAB"
    picture = shared.get(f"{wall.path}/{found['id']}/picture.jpg")
    shown = cv2.imdecode(np.frombuffer(picture.content, np.uint8), cv2.IMREAD_COLOR)
    assert max(shown.shape) <= 800
    assert shown.min() < 60  # the crack, and its outline beside it
    known = {"If-None-Match": picture.headers["ETag"]}
    assert shared.get(str(picture.url), headers=known).status_code == 304
    name = str(uuid.uuid4())
    made = wall.decide(found["id"], "accept", name, severity=3, remark="wide").json()
    assert made["frame"], made["pixel"] == (found["frame"], found["pixel"])
    assert made["distance_m"] == pytest.approx(found["distance_m"], abs=0.001)
    assert (made["code"], made["severity"], made["remark"]) == ("BAB", 3, "wide")
    assert wall.states() == ["accepted"]


def test_a_decision_is_made_once_and_can_be_undone(wall: Wall) -> None:
    first, second = (each["id"] for each in wall.all()["findings"])
    name, path = str(uuid.uuid4()), f"/api/inspections/{wall.id}/observations"
    made = wall.decide(first, "accept", name)
    again = wall.decide(first, "accept", name).json()
    assert again | {"photo": None} == made.json() | {"photo": None}
    assert_error(wall.decide(first, "accept", str(uuid.uuid4())), 409, "finding_decided")
    assert_error(wall.decide(first, "reject"), 409, "finding_decided")
    assert wall.decide(second, "reject").json()["decided_by"] == "server"
    assert wall.decide(second, "reject").status_code == 200
    assert_error(wall.decide(second, "accept", str(uuid.uuid4())), 409, "finding_decided")
    assert [each["id"] for each in wall.client.get(path).json()["observations"]] == [name]
    exports = f"/api/inspections/{wall.id}/exports"
    assert (
        "Proposals by classical 1: 2 offered, 1 accepted" in wall.client.get(f"{exports}/html").text
    )
    assert [wall.decide(each, "reopen").json()["state"] for each in (first, second)] == [
        "offered",
        "offered",
    ]
    assert wall.client.get(path).json()["observations"] == []
    assert len(wall.client.get(f"{exports}/csv").text.splitlines()) == 1
    assert wall.decide(first, "accept", name).json()["seq"] == made.json()["seq"]
    events = wall.client.get(f"/api/inspections/{wall.id}/events").json()["events"]
    decisions = [each["action"] for each in events if each["action"].startswith("finding_")]
    assert decisions[::-1] == [
        "finding_accepted", "finding_rejected", "finding_reopened", "finding_reopened",
        "finding_accepted",
    ]  # fmt: skip


def test_of_two_people_who_decide_at_once_one_is_told(wall: Wall) -> None:
    first, _ = (each["id"] for each in wall.all()["findings"])
    with ThreadPoolExecutor(4) as people:
        answers = list(
            people.map(lambda name: wall.decide(first, "accept", name), map(str, _uuids(4)))
        )
    assert sorted(each.status_code for each in answers) == [200, 409, 409, 409]
    tags = wall.client.get(f"/api/inspections/{wall.id}/observations").json()["observations"]
    assert len(tags) == 1


def _uuids(count: int) -> Iterator[uuid.UUID]:
    return (uuid.uuid4() for _ in range(count))


def test_an_approved_inspection_is_decided(wall: Wall) -> None:
    first, _ = (each["id"] for each in wall.all()["findings"])
    for state in ("submitted", "in_review", "approved"):
        moved = wall.client.post(f"/api/inspections/{wall.id}/review", json={"state": state})
        assert moved.status_code == 200, moved.text
    for what in ("accept", "reject"):
        refused = wall.decide(first, what, str(uuid.uuid4()))
        assert_error(refused, 409, "inspection_locked")
    search = f"{wall.path}/search"
    assert_error(wall.client.post(search, json={}), 409, "inspection_locked")
    assert_error(wall.client.delete(search), 409, "inspection_locked")


def test_what_was_decided_is_not_offered_again_when_the_track_has_moved(wall: Wall) -> None:
    first, second = (each["id"] for each in wall.all()["findings"])
    wall.decide(first, "reject")
    with findings_of(wall.client) as store:
        known = {each.id: each for each in store.listed(wall.id)}
    # Another rig: the same pixels show wall that is 300 mm further on.
    places = {name: (each.middle_mm[0] + 300, -10.0) for name, each in known.items()}
    again, other = finding(wall.id, 344.0), finding(wall.id, 423.0, score=0.9)
    new = finding(wall.id, 700.0)
    settle(wall.client, wall.id, again, other, new, places=places)
    after = {each["id"]: each for each in wall.all()["findings"]}
    assert {name: each["state"] for name, each in after.items()} == {
        first: "rejected", second: "offered", new.id: "offered",
    }  # fmt: skip
    assert after[second]["score"] == 0.9
    settle(wall.client, wall.id)  # nothing is found any more
    assert wall.states() == ["rejected"]


def test_a_finding_belongs_to_its_inspection(wall: Wall, done: str) -> None:
    first, _ = (each["id"] for each in wall.all()["findings"])
    other = Wall(wall.client, done)
    for what in ("accept", "reject", "reopen"):
        assert_error(other.decide(first, what, str(uuid.uuid4())), 404, "finding_not_found")
    assert_error(wall.client.get(f"{other.path}/{first}/picture.jpg"), 404, "finding_not_found")
    assert wall.client.delete(f"/api/inspections/{wall.id}").status_code == 204
    with closing(sqlite3.connect(wall.client.data / FILE)) as database:
        left = database.execute("SELECT * FROM findings WHERE inspection_id = ?", (wall.id,))
        assert left.fetchall() == []


def test_a_search_that_waits_is_stopped(wall: Wall) -> None:
    with findings_of(wall.client) as store:
        store.put_search(wall.id, WAITING)
    stopped = wall.client.delete(f"{wall.path}/search").json()
    assert (stopped["state"], stopped["detail"]) == ("none", "Stopped by server.")
    assert_error(wall.client.delete(f"{wall.path}/search"), 409, "not_running")
    unknown = wall.client.post(f"{wall.path}/search", json={"detector": "0" * 32})
    assert_error(unknown, 404, "detector_not_found")


def test_models_are_listed_deleted_and_refused(shared: Client, model: str) -> None:
    (listed,) = shared.get("/api/detectors").json()["detectors"]
    assert (listed["id"], listed["name"], listed["declared"]["task"]) == (
        model, "Dark lines", "segment",
    )  # fmt: skip
    body = {"upload_id": shared.upload(onnx_files.finds_dark()), "declaration": FINDS_DARK}
    assert_error(shared.post("/api/detectors", json=body), 409, "detector_name_taken")
    other = FINDS_DARK.replace("Dark lines", "Other").replace("[128, 128]", "[64, 128]")
    body = {"upload_id": shared.upload(b"no model"), "declaration": other}
    assert_error(shared.post("/api/detectors", json=body), 422, "invalid_detector")
    assert shared.get("/healthz").status_code == 200


def test_a_server_searches_what_waited_and_again_what_is_tracked_again(
    survey: Survey, tmp_path: Path
) -> None:
    with closing(Database(survey.copied_to(tmp_path) / FILE)) as database:
        store = FindingStore(database, ObservationStore(database))
        store.put_search(survey.id, WAITING)  # as a server leaves it that dies in the middle
    with serving(tmp_path, find_defects=True) as client:
        wall = Wall(client, survey.id)
        wait_until(lambda: wall.all()["search"]["state"] == "done")
        rejected = finding(survey.id)
        settle(client, survey.id, rejected)
        wall.decide(rejected.id, "reject")
        assert client.post(f"/api/inspections/{survey.id}/retry").is_success
        wait_until(lambda: wall.all()["search"]["state"] != "done")
        wait_until(lambda: wall.all()["search"]["state"] == "done")
        assert wall.all()["counts"]["rejected"] == 1
        assert client.post(f"{wall.path}/search", json={}).json()["state"] in WORKING
        assert client.delete(f"/api/inspections/{survey.id}").status_code == 204
        wait_until(lambda: not children("app.jobs.requests.finder"))
        assert_error(client.get(wall.path), 404, "inspection_not_found")
