"""A client accepts by a link, and an office follows its orders: what is outside comes back."""

from __future__ import annotations

import logging
import re
import uuid
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import pytest
from builders import Client, assert_error, serving, wait_until
from receivers import Receiver, receiving
from surveys import Survey, another

from app.storage.database.database import FILE, Database, stored_at
from app.storage.database.tables import AcceptanceLink

ORDERS = "/api/work-orders"


@pytest.fixture(scope="module")
def receiver() -> Iterator[Receiver]:
    with receiving() as running:
        yield running


@pytest.fixture(scope="module")
def shared(
    survey: Survey,
    new_url: Callable[[], str | None],
    tmp_path_factory: pytest.TempPathFactory,
    receiver: Receiver,
) -> Iterator[Client]:
    data, url = survey.copied_to(tmp_path_factory.mktemp("data")), new_url()
    if url is not None:
        stored_at(url, data).take_over(data / FILE)
    hook = {"webhook_url": receiver.url, "webhook_secret": "a secret of sixteen or more"}
    with serving(data, database=url, **hook) as client:
        yield client


class Delivery:
    """A link to some inspections, as its client without an account uses it."""

    def __init__(self, server: Client, *ids: str, note: str = "Lot 3") -> None:
        made = server.post("/api/acceptance-links", json={"inspections": ids, "note": note})
        assert made.status_code == 201, made.text
        self.server, self.client = server, server.anonymous()
        self.id, self.path = made.json()["link"]["id"], made.json()["path"]

    def page(self, place: int | str = "") -> httpx.Response:
        return self.client.get(f"{self.path}{place}")

    def field(self, name: str, place: int = 1) -> str:
        (value,) = re.findall(rf'name="{name}" value="([^"]*)"', self.page(place).text)
        return str(value)

    def say(self, kind: str, text: str = "", **other: str) -> httpx.Response:
        form = {"id": str(uuid.uuid4()), "kind": kind, "person": "Ada", "text": text} | other
        if "version" not in form:
            form["version"] = self.field("version")
        # As browsers do of a page that sends no referrer.
        return self.client.post(f"{self.path}1", data=form, headers={"Origin": "null"})

    def standing(self) -> str:
        links = self.server.get("/api/acceptance-links").json()["links"]
        (link,) = (link for link in links if link["id"] == self.id)
        return str(link["sections"][0]["standing"])


def test_a_question_comes_back_into_the_review_and_its_reply_to_the_client(
    shared: Client, own: str, receiver: Receiver
) -> None:
    inspection = f"/api/inspections/{own}"
    shared.tag(own, "0123abcd-0000-4000-8000-000000000000", code="BAB", remark="<script>1")
    shared.post(f"{inspection}/review", json={"state": "submitted"})
    delivery = Delivery(shared, own)
    shown = delivery.page(1)
    assert (shown.status_code, delivery.page().status_code) == (200, 200)
    assert 'class="mark"' in shown.text
    assert "&lt;script&gt;1" in shown.text
    assert "<script>1" not in shown.text
    assert shown.headers["Referrer-Policy"] == "no-referrer"
    assert shown.headers["Cache-Control"] == "no-store"
    assert "script" not in shown.headers["Content-Security-Policy"]
    assert delivery.page("1/report.pdf").content.startswith(b"%PDF")

    answer = str(uuid.uuid4())
    for _ in range(2):  # sent again, it is the same one
        said = delivery.say("question", "Why <b>here</b>?", id=answer, person="Ada <i>")
        assert (said.status_code, said.headers["Location"]) == (303, "1#answer")
    state = shared.get(inspection).json()
    assert (state["review"]["state"], state["open_questions"]) == ("reopened", 1)
    review = shared.get(f"{inspection}/review").json()
    assert [(one["id"], one["person"], one["link"]) for one in review["said"]] == [
        (answer, "Ada <i>", "Lot 3")
    ]
    assert review["steps"][-1]["by"] == "Ada <i> (client via link Lot 3)"
    told = wait_until(
        lambda: [m for m in receiver.received if m.message["event"] == "acceptance.answered"]
    )
    assert told[0].message["answer"]["text"] == "Why <b>here</b>?"
    for step in ("submitted", "in_review"):
        shared.post(f"{inspection}/review", json={"state": step})
    refused = shared.post(f"{inspection}/review", json={"state": "approved"})
    assert_error(refused, 409, "open_questions")

    path = f"{inspection}/review/said/{answer}"
    assert shared.put(path, json={"reply": "It is <there>."}).status_code == 200
    assert_error(shared.put(path[:-1] + "x", json={"reply": "a"}), 422, "invalid_request")
    page = delivery.page(1).text
    assert "review moved on" not in page  # colleagues talk to each other in the history
    assert "Why &lt;b&gt;here&lt;/b&gt;?" in page
    assert "It is &lt;there&gt;." in page
    assert delivery.standing() == "answered"
    assert delivery.say("accepted").status_code == 303
    assert delivery.standing() == "accepted"
    assert shared.post(f"{inspection}/review", json={"state": "approved"}).status_code == 200


def test_an_answer_is_of_what_was_seen(shared: Client, own: str) -> None:
    delivery = Delivery(shared, own, note="")
    seen = delivery.field("version")
    assert delivery.say("accepted").status_code == 303
    shared.tag(own, code="BAB")
    assert delivery.standing() == "changed"
    refused = delivery.say("accepted", version=seen)
    assert (refused.status_code, "changed while you looked" in refused.text) == (409, True)
    assert "was changed after it was sent" in delivery.page(1).text
    assert delivery.say("accepted").status_code == 303
    assert delivery.standing() == "accepted"


def test_a_form_with_a_fault_keeps_what_was_typed_and_stores_nothing(
    shared: Client, own: str
) -> None:
    delivery = Delivery(shared, own)
    for faulty, sentence in (
        ({"text": "x" * 10_000}, "at most 4,000"),
        ({"text": ""}, "question first"),
        ({"person": " "}, "your name"),
        ({"id": "1"}, "not sent whole"),
    ):
        answer = delivery.say("question", **{"text": "kept", **faulty})
        assert (answer.status_code, sentence in answer.text) == (422, True)
        assert ("kept" in answer.text) is ("text" not in faulty)
    assert shared.get(f"/api/inspections/{own}/review").json()["said"] == []


def test_links_that_are_wrong_expired_or_revoked_answer_alike_and_guesses_are_limited(
    shared: Client, done: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG)
    valid, revoked, expired = (Delivery(shared, done) for _ in range(3))
    assert shared.delete(f"/api/acceptance-links/{revoked.id}").status_code == 204
    expire(shared, expired.id)
    answers = [revoked.page(), expired.page(1), valid.client.get("/accept/guessed/")]
    answers += [revoked.say("accepted", version="1.1.1"), valid.page("x")]
    assert {answer.status_code for answer in answers} == {404}
    assert len({answer.text for answer in answers}) == 1
    guesses = [valid.client.get(f"/accept/guess{n}/").status_code for n in range(10)]
    assert set(guesses) == {404, 429}
    assert valid.page().status_code == 200
    german = valid.client.get("/accept/other/", headers={"Accept-Language": "de-DE,en;q=0.5"})
    assert (german.status_code, "zu viele falsche Links" in german.text) == (429, True)
    secrets = {delivery.path.split("/")[2] for delivery in (valid, revoked, expired)}
    ours = [record.getMessage() for record in caplog.records if record.name.startswith("app.")]
    assert not [message for message in ours if any(secret in message for secret in secrets)]


def expire(server: Client, link_id: str) -> None:
    database = Database(server.data / FILE)

    def store(session: Any) -> None:
        link = session.get(AcceptanceLink, link_id)
        link.expires_at = datetime.now(UTC) - timedelta(seconds=1)

    database.write(store)
    database.close()


def test_a_link_admits_to_nothing_else(shared: Client, survey: Survey, done: str) -> None:
    gone = another(survey, shared)
    delivery = Delivery(shared, gone)
    secret = delivery.path.split("/")[2]
    for path in (f"/api/inspections/{gone}", "/", "/api/acceptance-links"):
        for how in ({}, {"Authorization": f"Bearer {secret}"}):
            assert delivery.client.get(path, headers=how).status_code == 401
    assert delivery.page(2).status_code == 404
    assert shared.delete(f"/api/inspections/{gone}").status_code == 204
    assert "Withdrawn" in delivery.page().text
    withdrawn = delivery.page(1)
    assert (withdrawn.status_code, "was withdrawn" in withdrawn.text) == (404, True)
    refused = shared.post("/api/acceptance-links", json={"inspections": [done, gone]})
    assert_error(refused, 404, "inspection_not_found")
    refused = shared.post("/api/acceptance-links", json={"inspections": [done], "days": 366})
    assert_error(refused, 422, "invalid_request")


def order(server: Client, key: str | None = None, **body: Any) -> httpx.Response:
    headers = {} if key is None else {"Idempotency-Key": key}
    return server.post(ORDERS, json=body, headers=headers)


def test_the_same_request_under_a_key_is_one_order(shared: Client) -> None:
    sent = {"number": "K", "asset_id": "KEY-1", "asset_data": {"project": "Keys"}}
    first = order(shared, "a key", **sent)
    assert (first.status_code, first.json()["project"]) == (201, "Keys")
    assert order(shared, "a key", **sent).json() == first.json()
    other = order(shared, "a key", **sent | {"reason": "x"})
    assert_error(other, 422, "idempotency_key_reused")
    assert_error(order(shared, **sent), 409, "work_order_exists")
    assert_error(order(shared, number="K", asset_id="KEY-2"), 404, "asset_not_found")
    wrong = order(shared, number="K", asset_id="KEY-1", due_on="2026-02-30")
    assert_error(wrong, 422, "invalid_request")
    path = f"{ORDERS}/{first.json()['id']}"
    assert shared.put(f"{path}/state", json={"state": "cancelled"}).json()["state"] == "cancelled"
    assert_error(shared.put(f"{path}/state", json={"state": "closed"}), 409, "work_order_ended")
    assert_error(shared.get(f"{ORDERS}/{'0' * 32}"), 404, "work_order_not_found")


def test_a_table_adds_what_has_no_fault(shared: Client) -> None:
    def take(text: str, **query: Any) -> dict[str, Any]:
        answer = shared.post(f"{ORDERS}/import", params=query, content=text.encode("cp1252"))
        assert answer.status_code == 200, answer.text
        return dict(answer.json())

    shared.put("/api/register/assets/TAB-1", json={"project": "Tables", "header": {}})
    text = "Auftrag;Haltung;Grund;Projekt\nT;TAB-1;Überflutung;\nT;TAB-2;;New\nU;TAB-1;;Other\n"
    found = take(text, dry_run=True)
    assert (found["added"], [fault["reason"] for fault in found["faults"]]) == (
        1,
        ["asset", "project"],
    )
    assert take(text, add_assets=True)["new_assets"] == 1
    assert shared.get("/api/register/assets/TAB-2").json()["project"] == "New"
    again = take(text.replace("Überflutung", "=1+1"))
    assert (again["added"], again["changed"], again["same"]) == (0, 1, 1)
    orders = shared.get(ORDERS, params={"number": "T"}).json()["orders"]
    assert {(one["asset_id"], one["reason"]) for one in orders} == {
        ("TAB-1", "=1+1"),
        ("TAB-2", ""),
    }


def test_the_state_of_an_order_follows_and_is_told(
    shared: Client, survey: Survey, receiver: Receiver
) -> None:
    body = {"number": "WO-1", "asset_id": "FOL-1", "due_on": "2020-01-01", "reason": "Flood"}
    made = order(shared, **body, asset_data={"project": None}).json()
    path, cursor = f"{ORDERS}/{made['id']}", made["changed"]
    section = shared.get("/api/work", params={"orders": "overdue"}).json()["sections"][0]
    assert (section["asset"], section["state"]) == ("FOL-1", "to_do")
    assert (section["order"]["number"], section["order"]["is_overdue"]) == ("WO-1", True)

    def until(state: str) -> dict[str, Any]:
        def reached() -> dict[str, Any] | None:
            found = dict(shared.get(path).json())
            return found if found["state"] == state else None

        return wait_until(reached)

    def touch(inspection: str) -> None:
        """What was put beside the server is indexed at once."""
        shared.tag(inspection, code="BAB")

    inspected = another(survey, shared, header={"asset_id": "FOL-1"})
    touch(inspected)
    assert until("inspected")["inspection_id"] == inspected
    changed = shared.get(ORDERS, params={"since": cursor}).json()
    assert [one["id"] for one in changed["orders"]] == [made["id"]]
    delivery = Delivery(shared, inspected)
    until("delivered")
    assert delivery.say("accepted").status_code == 303
    until("accepted")
    touch(inspected)  # another version
    until("delivered")
    assert shared.put(f"{path}/state", json={"state": "closed"}).json()["state"] == "closed"

    def told() -> list[str]:
        messages = [one.message for one in receiver.received]
        own = [one["work_order"] for one in messages if one["event"] == "work_order.changed"]
        return [one["state"] for one in own if one["id"] == made["id"]]

    wait_until(lambda: "closed" in told())
    assert told() == ["inspected", "delivered", "accepted", "delivered", "closed"]
