"""Chainage as the meter counter of other software: a real TCP server on loopback hears and asks."""

from __future__ import annotations

import csv
import json
import queue
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from builders import PATIENCE_S, Client, serving, wait_until
from cameras import MjpegCamera

CHANGE = "CHANGE_METER_COUNTER_VALUE_REQ"
STATUS = "METER_COUNTER_STATUS_IND"
CENTIMETRE_M = 0.006
"""By which a distance to the centimetre may differ."""
CHANGES_HZ = 5
"""At most so many of a peer count."""


class OtherSoftware:
    """Listens as ProTouch does; what it hears can be waited for."""

    def __init__(self, port: int = 0) -> None:
        self._server = socket.create_server(("127.0.0.1", port))
        self.port = self._server.getsockname()[1]
        self.heard: queue.Queue[dict[str, Any]] = queue.Queue()
        self.connections: list[socket.socket] = []
        self._thread = threading.Thread(target=self._accept, daemon=True)
        self._thread.start()

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._server.accept()
            except OSError:  # closed
                return
            self.connections.append(connection)
            threading.Thread(target=self._listen, args=(connection,), daemon=True).start()

    def _listen(self, connection: socket.socket) -> None:
        try:
            with connection.makefile("rb") as lines:
                for line in lines:
                    self.heard.put(json.loads(line))
        except OSError:
            return

    def next(self, name: str | None = None) -> tuple[dict[str, Any], dict[str, Any]]:
        """Header and payload of the next message, or of the next with this name."""
        while True:
            message = self.heard.get(timeout=PATIENCE_S)
            if name in (None, message["header"]["messageName"]):
                return message["header"], message["payload"]

    def ask(self, message_id: object, value: object, unit: str = "m", name: str = CHANGE) -> None:
        header = {"messageId": message_id, "messageType": "CONTROL", "messageName": name}
        self.send(
            json.dumps({"header": header, "payload": {"value": value, "unit": unit}}).encode()
        )

    def send(self, content: bytes) -> None:
        self.connections[-1].sendall(content + b"\n")

    def hang_up(self) -> None:
        self.connections[-1].shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()
        for connection in self.connections:
            with suppress(OSError):  # the other side was faster
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()
        self._thread.join()


@contextmanager
def other_software(port: int = 0) -> Iterator[OtherSoftware]:
    running = OtherSoftware(port)
    try:
        yield running
    finally:
        running.close()


@pytest.fixture
def other() -> Iterator[OtherSoftware]:
    with other_software() as running:
        yield running


@pytest.fixture
def counting(tmp_path: Path, other: OtherSoftware) -> Iterator[Client]:
    settings = {"camera_networks": ("127.0.0.0/8",), "meter_counter": f"127.0.0.1:{other.port}"}
    with serving(tmp_path / "data", **settings) as client:
        yield client


@pytest.fixture
def camera() -> Iterator[MjpegCamera]:
    with MjpegCamera(rate_hz=15) as running:
        yield running


def answer(other: OtherSoftware) -> tuple[object, dict[str, Any]]:
    header, payload = other.next("CHANGE_METER_COUNTER_VALUE_RESP")
    return header["messageId"], payload


def refused(other: OtherSoftware, number: int, value: object, unit: str = "m") -> dict[str, Any]:
    """The refusal of a change, asked again while it comes too soon after another."""
    while True:
        other.ask(number, value, unit)
        message_id, refusal = answer(other)
        assert (message_id, refusal["status"]) == (number, False)
        if not refusal["error"].startswith("Too many changes"):
            return refusal


def test_it_sends_its_version_and_the_distance_as_it_changes_and_its_zero_is_set(
    counting: Client, other: OtherSoftware, camera: MjpegCamera
) -> None:
    header, payload = other.next()
    assert (header["messageName"], payload) == ("CHOOSE_API_VERSION", {"value": 2})
    wait_until(lambda: counting.get("/api/meter-counter").json()["is_connected"])
    inspection_id = counting.record(camera.url)
    received = [other.heard.get(timeout=PATIENCE_S) for _ in range(8)]
    assert {message["header"]["messageName"] for message in received} == {STATUS}
    ids = [message["header"]["messageId"] for message in received]
    assert ids == list(range(2, 10))
    values = [message["payload"]["value"] for message in received]
    assert len(set(values)) > 1
    assert all(a != b for a, b in pairwise(values))
    before_m = counting.inspection(inspection_id)["distance_m"]
    while (value := other.next(STATUS)[1]["value"]) < before_m - CENTIMETRE_M:
        pass
    assert value < counting.inspection(inspection_id)["distance_m"] + CENTIMETRE_M
    other.ask(20, 328.084, "ft")
    assert answer(other) == (20, {"status": True, "errorCode": 0, "error": ""})
    value = other.next(STATUS)[1]["value"]
    path = f"/api/inspections/{inspection_id}"
    zero = counting.get(f"{path}/corrections").json()["stated"]["zero"]
    assert zero["offset_m"] == pytest.approx(100, abs=1e-3)
    lines = counting.get(f"{path}/track").text.splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    driven = [float(row["distance_mm"]) / 1000 for row in rows][zero["frame"] :]
    assert driven[0] == pytest.approx(100, abs=1e-3)
    assert min(abs(value - distance_m) for distance_m in driven) < CENTIMETRE_M
    event = counting.get(f"{path}/events").json()["events"][0]
    assert (event["action"], event["who"]) == ("corrected", "Meter counter")
    assert event["after"]["zero"] == zero
    # A peer that asks without end fills no history.
    began_s = time.monotonic()
    for number in range(300):
        other.ask(number, float(number))
    answers = [answer(other) for _ in range(300)]
    assert [message_id for message_id, _ in answers] == list(range(300))
    done = [payload for _, payload in answers if payload["status"]]
    events = counting.get(f"{path}/events").json()["events"]
    corrected = [event for event in events if event["action"] == "corrected"]
    most = CHANGES_HZ * (time.monotonic() - began_s) + 1
    assert 1 <= len(done) == len(corrected) - 1 <= most


def test_it_refuses_in_a_sentence_and_does_not_answer_what_it_does_not_know(
    counting: Client, other: OtherSoftware, camera: MjpegCamera
) -> None:
    other.next()
    other.ask(1, 8000, name="START_VIDEO_STREAMING_REQ")
    other.send(b"\xff\x00{{{[" + b"x" * 100_000)
    other.ask("a-2", 0.0)
    message_id, refusal = answer(other)
    assert (message_id, refusal["status"]) == ("a-2", False)
    assert refusal["error"] == "No live inspection runs."
    inspection_id = counting.record(camera.url)
    other.next(STATUS)
    for number, (value, unit) in enumerate([("1", "m"), (1, "yard"), (1e9, "m")]):
        refusal = refused(other, number, value, unit)
        assert "not a length" in refusal["error"]
    counting.post(f"/api/inspections/{inspection_id}/cancel")
    counting.wait(inspection_id)
    assert refused(other, 9, 0.0)["error"] == "No live inspection runs."


def test_it_connects_again_after_the_other_side_was_away(
    tmp_path: Path, camera: MjpegCamera
) -> None:
    with other_software() as gone:
        port = gone.port
    settings = {"camera_networks": ("127.0.0.0/8",), "meter_counter": str(port)}
    with serving(tmp_path / "data", **settings) as client:
        state = wait_until(lambda: _with_detail(client))
        assert state == {
            "peer": f"127.0.0.1:{port}", "is_connected": False,
            "detail": "No program listens there.",
        }  # fmt: skip
        with other_software(port) as other:
            client.record(camera.url)
            other.next(STATUS)
            other.hang_up()
            assert _with_detail_of(client, "It has ended the connection.")
            assert other.next("CHOOSE_API_VERSION")[1] == {"value": 2}
            other.next(STATUS)  # the newest at once, changed or not


def test_the_server_stops_while_the_peer_takes_nothing(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        with serving(tmp_path / "data", meter_counter=f"127.0.0.1:{port}") as client:
            wait_until(lambda: client.get("/api/meter-counter").json()["is_connected"])


def test_it_is_off_unless_it_is_configured(shared: Client) -> None:
    assert shared.get("/api/meter-counter").json() == {
        "peer": None, "is_connected": False, "detail": None,
    }  # fmt: skip


def _with_detail(client: Client) -> dict[str, Any] | None:
    state = dict(client.get("/api/meter-counter").json())
    return state if state["detail"] else None


def _with_detail_of(client: Client, detail: str) -> bool:
    return wait_until(lambda: client.get("/api/meter-counter").json()["detail"] == detail)
