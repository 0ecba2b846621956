"""The client is notified of a severity 5: signed, repeatedly, and without delaying anybody."""

from __future__ import annotations

import hashlib
import hmac
import logging
import sqlite3
import time
import uuid
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from builders import STEP_MM, Client, assert_error, serving, wait_until
from prometheus_client.parser import text_string_to_metric_families
from receivers import Receiver, certificate, receiving
from surveys import Survey

from app.alerts.webhook import next_try
from app.storage.database.tables import Alert

SECRET = "a secret of sixteen or more"  # noqa: S105
NOW = datetime(2026, 9, 14, 9, 42, tzinfo=UTC)


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    with receiving() as running:
        yield running


def notifying(data: Path, url: str, **settings: Any) -> Any:
    return serving(data, webhook_url=url, webhook_secret=SECRET, **settings)


@pytest.fixture
def notifying_server(survey: Survey, tmp_path: Path, receiver: Receiver) -> Iterator[Client]:
    public_url, data = "https://culverts.example/", survey.copied_to(tmp_path / "data")
    with notifying(data, receiver.url, public_url=public_url) as client:
        yield client


def alerts(client: Client, inspection_id: str) -> list[dict[str, Any]]:
    answer = client.get(f"/api/inspections/{inspection_id}/alerts").json()
    assert answer["is_configured"]
    return list(answer["alerts"])


def wait_for(client: Client, inspection_id: str, state: str) -> dict[str, Any]:
    """Until the last alert is in this state."""

    def last() -> dict[str, Any] | None:
        found = alerts(client, inspection_id)
        return found[-1] if found and found[-1]["state"] == state else None

    return wait_until(last)


def wait_for_error(client: Client, inspection_id: str) -> str:
    return str(wait_until(lambda: alerts(client, inspection_id)[-1]["error"]))


def test_the_client_is_notified_where_what_and_by_whom(
    notifying_server: Client, receiver: Receiver, done: str
) -> None:
    began_at = datetime.now(UTC).replace(microsecond=0)
    tag = notifying_server.tag(
        done, code="BAC", char1="C", severity=5, clock_from=9, remark="wall fällt; =1+1"
    ).json()
    (first,) = wait_until(lambda: receiver.received)
    message = first.message
    assert first.path == "/hook/a-secret-place?x=1"
    assert (message["event"], uuid.UUID(message["id"]).version) == ("observation.severity_5", 4)
    assert message["url"] == f"https://culverts.example/inspections/{done}"
    assert message["inspection"] == {"id": done, "name": "Culvert 7", "asset": "CUL-0041"}
    label = next(
        row["label"] for row in notifying_server.get("/api/codes").json()
        if (row["code"], row["char1"]) == ("BAC", "C")
    )  # fmt: skip
    assert message["observation"] == {
        "id": tag["id"], "distance_m": pytest.approx(10 * STEP_MM / 1000, abs=0.002),
        "distance_u95_m": pytest.approx(tag["distance_u95_m"], abs=1e-3), "code": "BAC",
        "label": label, "clock": 9, "remark": "wall fällt; =1+1", "severity": 5,
        "tagged_by": "server", "tagged_at": message["observation"]["tagged_at"],
    }  # fmt: skip
    tagged_at, sent_at = (
        datetime.fromisoformat(instant)
        for instant in (message["observation"]["tagged_at"], message["sent_at"])
    )
    assert began_at <= tagged_at <= sent_at <= datetime.now(UTC)
    # Who knows the secret can verify that it is genuine.
    at, found = first.headers["X-Chainage-Signature"].split(",")
    signed = f"{at.removeprefix('t=')}.".encode() + first.body
    assert found == f"v1={hmac.new(SECRET.encode(), signed, hashlib.sha256).hexdigest()}"
    assert int(at.removeprefix("t=")) >= int(began_at.timestamp())
    assert first.headers["Content-Type"] == "application/json"


def test_once_for_each_time_that_it_becomes_severe_and_metrics_count_it(
    notifying_server: Client, receiver: Receiver, done: str
) -> None:
    name = notifying_server.tag(done, severity=4).json()["id"]
    for severity in (5, 5, 4, 5):
        notifying_server.tag(done, name, severity=severity, remark=str(time.time_ns()))
        wait_until(
            lambda: all(each["state"] != "waiting" for each in alerts(notifying_server, done))
        )
    path = f"/api/inspections/{done}/observations/{name}"
    notifying_server.delete(path)
    notifying_server.post(f"{path}/restore")  # the client was notified of it, and it is the same
    notifying_server.tag(done, severity=5)
    wait_until(lambda: len(receiver.received) == 3)
    ids = [each.message["id"] for each in receiver.received]
    assert len(set(ids)) == 3
    assert [each["id"] for each in alerts(notifying_server, done)] == ids
    path = f"/api/inspections/{done}/events"
    notified = [
        event for event in notifying_server.get(path).json()["events"] if event["action"] == "told"
    ]
    assert {event["who"] for event in notified} == {"Chainage"}
    assert len(notified) == 3
    receiver.statuses = [500] * 50
    notifying_server.tag(done, severity=5)
    found = {
        sample.labels["state"]: sample.value
        for family in text_string_to_metric_families(notifying_server.get("/metrics").text)
        if family.name == "chainage_webhook_alerts"
        for sample in family.samples
    }
    assert found == {"waiting": 1, "told": 3, "withdrawn": 0, "given_up": 0}


def test_an_alert_of_which_no_message_can_be_made_keeps_no_other_from_being_sent(
    notifying_server: Client, receiver: Receiver, done: str
) -> None:
    receiver.statuses = [500] * 50  # until it was seen
    notifying_server.tag(done, severity=5)
    wait_for_error(notifying_server, done)
    with closing(sqlite3.connect(notifying_server.data / "chainage.db")) as other, other:
        other.execute("UPDATE observations SET fields = '[]', edited_at = created_at")
    wait_until(lambda: "could not be made" in wait_for_error(notifying_server, done))
    receiver.statuses, refused = [], len(receiver.received)
    notifying_server.tag(done, severity=5)
    wait_until(lambda: len(receiver.received) > refused)


NOT_TAKEN = (
    (500, "answered", {"status": "500"}),
    (0, "broken_off", {}),
    (307, "redirected", {"status": "307"}),
)


def test_what_is_not_taken_is_sent_again_with_the_same_id_and_no_secret_is_shown(
    notifying_server: Client, receiver: Receiver, done: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG)
    receiver.location = f"http://127.0.0.1:{receiver.port}/elsewhere"
    for number, (status, code, values) in enumerate(NOT_TAKEN):
        receiver.statuses = [status] * 50  # until it was seen
        notifying_server.tag(done, severity=5)
        failed = wait_until(
            lambda: [each for each in alerts(notifying_server, done)[number:] if each["error"]]  # noqa: B023
        )
        assert failed[0]["reason"] == {"code": code, "values": values}
        receiver.statuses = []
        assert wait_for(notifying_server, done, "told")["tries"] >= 2
        first, second = receiver.received[-2:]
        assert first.message["id"] == second.message["id"]
        assert first.path == second.path
    path = f"/api/inspections/{done}"
    shown = [notifying_server.get(f"{path}/{part}").text for part in ("alerts", "events")]
    assert "could not be notified" in caplog.text
    for text in (caplog.text, *shown):
        assert SECRET not in text
        assert "a-secret-place" not in text
    # Nor does one that never ends its answer keep anybody from tagging.
    receiver.drips, before = True, len(receiver.received)
    notifying_server.tag(done, severity=5)
    wait_until(lambda: len(receiver.received) > before)
    assert notifying_server.tag(done, severity=4).status_code == 200  # before the answer ends
    error = wait_for_error(notifying_server, done)
    assert error == "It did not answer within 5 s."
    receiver.drips = False
    assert wait_for(notifying_server, done, "told")["tries"] == 2


def test_what_was_not_sent_is_sent_after_a_restart(tmp_path: Path, survey: Survey) -> None:
    data, inspection_id = survey.copied_to(tmp_path / "data"), survey.id
    with receiving() as gone:
        port, url = gone.port, gone.url
    with notifying(data, url) as client:
        client.tag(inspection_id, severity=5)
        assert "refused" in wait_for_error(client, inspection_id)
        waiting = alerts(client, inspection_id)[0]
    with receiving(port) as receiver, notifying(data, url) as client:
        alert = wait_for(client, inspection_id, "told")
        assert (
            [each.message["id"] for each in receiver.received] == [waiting["id"]] == [alert["id"]]
        )
        assert (alert["error"], alert["next_at"]) == (None, None)


def test_the_server_stops_at_once_while_a_client_hangs(
    tmp_path: Path, receiver: Receiver, survey: Survey
) -> None:
    receiver.hangs.set()
    with notifying(survey.copied_to(tmp_path / "data"), receiver.url) as client:
        client.tag(survey.id, severity=5)
        wait_until(lambda: receiver.received)
    # No try has failed: the server has not waited until this one did.
    with sqlite3.connect(tmp_path / "data" / "chainage.db") as database:
        assert database.execute("SELECT state, tries FROM alerts").fetchall() == [("waiting", 0)]


def test_a_mistake_that_is_taken_back_in_time_is_not_sent(tmp_path: Path, survey: Survey) -> None:
    inspection_id = survey.id
    with receiving() as gone:
        port, url = gone.port, gone.url
    with notifying(survey.copied_to(tmp_path / "data"), url) as client:
        lowered, deleted = (client.tag(inspection_id, severity=5).json()["id"] for _ in range(2))
        client.tag(inspection_id, lowered, severity=2)
        path = f"/api/inspections/{inspection_id}/observations/{deleted}"
        client.delete(path)
        wait_until(lambda: {a["state"] for a in alerts(client, inspection_id)} == {"withdrawn"})
        with receiving(port) as receiver:
            client.post(f"{path}/restore")
            (only,) = wait_until(lambda: receiver.received)
            assert only.message["observation"]["id"] == deleted


def test_a_certificate_that_nobody_trusts_gets_nothing(tmp_path: Path, survey: Survey) -> None:
    data = survey.copied_to(tmp_path / "data")
    with (
        receiving(certificate=certificate(tmp_path)) as receiver,
        notifying(data, receiver.url) as client,
    ):
        client.tag(survey.id, severity=5)
        error = wait_for_error(client, survey.id)
        assert error.startswith("Its certificate is not trusted: self-signed certificate")
        assert receiver.received == []


def test_without_a_client_nothing_is_put_by(shared: Client, done: str) -> None:
    shared.tag(done, severity=5)
    answer = shared.get(f"/api/inspections/{done}/alerts").json()
    assert answer == {"is_configured": False, "alerts": []}
    assert_error(shared.get(f"/api/inspections/{32 * '0'}/alerts"), 404, "inspection_not_found")


def test_pauses_grow_to_an_hour_and_end_after_a_day() -> None:
    alert, now, pauses = Alert(tries=0, created_at=NOW), NOW, []
    while following := next_try(alert, now):
        pauses.append((following - now).total_seconds())
        alert.tries, now = alert.tries + 1, following
    assert pauses[:4] == [2, 4, 8, 16]
    assert pauses[-1] == 3600
    assert timedelta(hours=22) < now - NOW < timedelta(days=1)
