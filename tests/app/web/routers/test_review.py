"""The review of an inspection: who moves it on, what may be said, and what an approval locks."""

from __future__ import annotations

from typing import Any

import httpx
import pytest
from builders import Client, assert_error, clip_rig

from app.access.access import create_token
from app.storage.folder.tokens import Role, TokenFile

QUESTION = "11111111-2222-4333-8444-000000000001"
ACCEPTANCE = "11111111-2222-4333-8444-000000000002"
UNSTATED = {"zero": None, "lengths": [], "rig_sigma": None, "forced": None, "remark": None} | {
    "joints": {"use": None, "marked": [], "left_out": []}
}


@pytest.fixture(scope="module")
def reviewed(shared: Client, done: str) -> Review:
    secret = create_token(TokenFile(shared.data), "Ana", Role.OPERATOR)
    return Review(shared, secret, done, shared.tag(done, frame=3).json()["id"])


class Review:
    """One inspection with one tag, as an admin and as the operator Ana use it."""

    def __init__(self, server: Client, secret: str, inspection: str, tag: str) -> None:
        self.server = server
        self.path = f"/api/inspections/{inspection}"
        self.tag = tag
        self.ana = {"Authorization": f"Bearer {secret}"}

    def move(self, state: str, reason: str | None = None, **options: Any) -> httpx.Response:
        sent = {"state": state, "reason": reason}
        return self.server.post(f"{self.path}/review", json=sent, **options)

    def say(self, remark: str, kind: str, text: str, version: str | None = None) -> httpx.Response:
        sent = {"observation": self.tag, "kind": kind, "text": text, "version": version}
        path = f"{self.path}/review/remarks/{remark}"
        return self.server.put(path, json=sent, headers=self.ana)

    def settle(self, *, settled: bool = True) -> httpx.Response:
        path = f"{self.path}/review/remarks/{QUESTION}/settled"
        return self.server.put(path, json={"settled": settled})

    def summary(self) -> tuple[str, int]:
        shown = self.server.get(self.path).json()
        return shown["review"]["state"], shown["open_questions"]


def test_an_acceptance_is_of_what_was_seen(reviewed: Review) -> None:
    path, remark = f"{reviewed.path}/observations/{reviewed.tag}", ACCEPTANCE[:-1] + "9"
    seen = reviewed.server.get(path).json()["version"]
    changed = reviewed.server.put(path, json={"frame": 3, "severity": 4}).json()
    refused = reviewed.say(remark, "accepted", "", seen)
    assert refused.status_code == 412
    assert refused.json()["code"] == "changed_meanwhile"
    assert refused.json()["current"]["severity"] == 4
    assert refused.headers["ETag"] == f'"{changed["version"]}"'
    said = reviewed.say(remark, "accepted", "", changed["version"]).json()
    assert said["remarks"][-1]["version"] == changed["version"]
    reviewed.server.delete(f"{reviewed.path}/review/remarks/{remark}")


def test_an_inspection_goes_from_draft_to_approved_and_back(reviewed: Review) -> None:
    assert reviewed.summary() == ("draft", 0)
    assert_error(reviewed.move("approved"), 409, "wrong_review_state")
    assert reviewed.move("submitted", headers=reviewed.ana).json()["by"] == "Ana"
    assert reviewed.move("submitted").json()["by"] == "Ana", "repeated: nothing happens"
    assert reviewed.move("in_review", headers=reviewed.ana).status_code == 200
    assert reviewed.say(QUESTION, "question", "Is this a root?").status_code == 200
    assert reviewed.say(ACCEPTANCE, "accepted", "").status_code == 200
    assert reviewed.summary() == ("in_review", 1)
    found = reviewed.server.get("/api/inspections?review=in_review").json()
    assert (found["total"], found["inspections"][0]["open_questions"]) == (1, 1)
    assert reviewed.server.get("/api/inspections?review=draft").json()["total"] == 0

    assert_error(reviewed.move("approved"), 409, "open_questions")
    assert reviewed.settle().json()["remarks"][0]["settled_by"] == "server"
    assert_error(reviewed.move("approved", headers=reviewed.ana), 403, "forbidden")
    assert reviewed.move("approved").json()["state"] == "approved"
    assert "approved by server" in reviewed.server.get(f"{reviewed.path}/exports/html").text
    expect_locked(reviewed)
    assert_error(reviewed.move("reopened"), 422, "invalid_request")
    assert_error(reviewed.move("reopened", "Wrong pipe", headers=reviewed.ana), 403, "forbidden")
    review = reviewed.move("reopened", "Wrong pipe").json()
    assert [(step["state"], step["by"], step["reason"]) for step in review["steps"]] == [
        ("submitted", "Ana", None),
        ("in_review", "Ana", None),
        ("approved", "server", None),
        ("reopened", "server", "Wrong pipe"),
    ]
    assert reviewed.server.tag(reviewed.path.split("/")[-1], frame=5).status_code == 200


def expect_locked(reviewed: Review) -> None:
    """Every request that would change the approved inspection is refused, and nothing changes."""
    server, path = reviewed.server, reviewed.path
    tag = f"{path}/observations/{reviewed.tag}"
    shown = ("", "/observations", "/corrections", "/events", "/review", "/counter")
    before = [server.get(path + part).json() for part in shown]
    for answer in (
        server.patch(path, json={"name": "Another"}),
        server.delete(path),
        server.post(f"{path}/retry"),
        server.put(f"{path}/rig", json={"rig": clip_rig()}),
        server.post(f"{path}/continue", json={"url": "rtsp://x/y", "robot": "moved"}),
        server.post(f"{path}/finish", json={"end_condition": "complete"}),
        server.put(f"{path}/counter", json={"is_present": False}),
        server.put(f"{path}/corrections", json=UNSTATED | {"zero": {"frame": 1, "offset_m": 1}}),
        server.tag(path.split("/")[-1], frame=5),
        server.put(tag, json={"frame": 3, "code": "BAC"}),
        server.delete(tag),
        server.put(f"{tag}/attachments/{ACCEPTANCE}", json={"kind": "photo", "frame": 5}),
        server.post(f"{tag}/restore"),
        reviewed.say("11111111-2222-4333-8444-000000000003", "comment", "Late"),
        reviewed.settle(settled=False),
        server.delete(f"{path}/review/remarks/{ACCEPTANCE}"),
    ):
        assert_error(answer, 409, "inspection_locked")
    assert [server.get(path + part).json() for part in shown] == before


def test_a_remark_is_withdrawn_by_its_author_or_an_admin_only(reviewed: Review) -> None:
    server, path = reviewed.server, f"{reviewed.path}/review/remarks"
    mine, theirs = (f"11111111-2222-4333-8444-00000000001{n}" for n in range(2))
    said = {"observation": reviewed.tag, "kind": "comment", "text": "By the admin"}
    assert server.put(f"{path}/{theirs}", json=said).status_code == 200
    assert reviewed.say(mine, "comment", "By Ana").status_code == 200
    assert_error(server.delete(f"{path}/{theirs}", headers=reviewed.ana), 403, "forbidden")
    assert server.delete(f"{path}/{mine}", headers=reviewed.ana).status_code == 200
    left = server.delete(f"{path}/{theirs}").json()["remarks"]
    assert not {mine, theirs} & {remark["id"] for remark in left}
