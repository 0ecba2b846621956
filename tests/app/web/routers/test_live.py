import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from builders import PATIENCE_S, Client, assert_error, frame_number, serving, wait_until
from websockets.exceptions import ConnectionClosedError, InvalidStatus
from websockets.sync.client import ClientConnection

from app.tracking.live import Live, Progress, Update
from app.web import middleware
from app.web.routers.inspection import live as live_route
from vo_core import Estimate

PICTURES, MOST_KEPT_BYTES = 280, 20 * 2**20
"""What a reader does not take stays in the buffers of its connection, some MiB at the most."""


def live(
    client: Client, inspection_id: str, page: str | None = None, **options: Any
) -> ClientConnection:
    query = "" if page is None else f"?page={page}"
    return client.socket(f"/api/inspections/{inspection_id}/live{query}", **options)


def receive(socket: ClientConnection) -> tuple[dict[str, Any], bytes]:
    message = socket.recv(PATIENCE_S)
    assert isinstance(message, bytes)
    length = int.from_bytes(message[:4], "big")
    return json.loads(message[4 : 4 + length]), message[4 + length :]


def acknowledge(socket: ClientConnection, header: dict[str, Any]) -> None:
    socket.send(json.dumps({"type": "ack", "seq": header["seq"]}))


def test_a_page_that_watches_a_run_gets_poses_with_their_pictures_and_the_newest_first(
    tmp_path: Path, long_clip: Path
) -> None:
    with serving(tmp_path, pace=1.0) as client:
        inspection_id = client.inspect(long_clip)
        seen: list[dict[str, Any]] = []
        with live(client, inspection_id) as socket:
            while len(seen) < 12:
                header, jpeg = receive(socket)
                acknowledge(socket, header)
                if jpeg:
                    assert frame_number(jpeg) == header["frame"]
                    seen.append(header)
        assert [h["seq"] for h in seen] == sorted({h["seq"] for h in seen})
        assert [h["frame"] for h in seen] == sorted({h["frame"] for h in seen})
        last = seen[-1]
        assert last["state"] == "running"
        assert last["distance_mm"] == pytest.approx(1.6 * last["frame"], abs=2)
        assert last["progress"]["frames_total"] > last["progress"]["frames_done"] > last["frame"]
        assert {
            "time_s", "x_mm", "y_mm", "yaw_deg", "sigma_distance_mm", "quality", "status",
        } <= last.keys()  # fmt: skip
        columns = client.get(f"/api/inspections/{inspection_id}/health").json()["columns"]
        for name, values in columns.items():
            published, kept = last["health"][name], values[last["frame"]]
            if name == "complaints":
                assert " ".join(published) == kept
            else:  # what was kept in a file has been rounded once more
                assert published == pytest.approx(kept, abs=0.0011)

        with live(client, inspection_id) as slow:
            first, second = receive(slow)[0], receive(slow)[0]
            seen_until = (second["frame"] or 0) + 100
            wait_until(lambda: client.frames_done(inspection_id) > seen_until)
            assert pong(slow) == [], "two are on their way"
            acknowledge(slow, first)
            newest = receive(slow)[0]
            assert newest["seq"] > second["seq"] + 2, "what came between was left out"
            assert newest["frame"] > second["frame"] + 50
        client.post(f"/api/inspections/{inspection_id}/cancel")


def test_who_reads_nothing_holds_up_nobody_and_takes_no_memory(shared: Client, own: str) -> None:
    published = shared.server.app.state.services[Live].publish
    noise = np.random.default_rng(3).integers(0, 256, (480, 640), np.uint8)
    jpeg = cv2.imencode(".jpg", noise, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    pose = Estimate(39, 1.56, 62.4, 0.0, 0.0, 62.4, 0.1, 1.0, "ok", 0.1)
    with live(shared, own, max_queue=1) as deaf, live(shared, own) as reader:
        acknowledge(reader, receive(reader)[0])
        before = memory_bytes()
        for n in range(PICTURES):
            published(Update(own, "running", Progress(n, None, 20.0), (pose,), jpeg))
            deaf.send(json.dumps({"type": "ack", "seq": 2**53}))
            header, shown = receive(reader)
            acknowledge(reader, header)
            assert (header["progress"]["frames_done"], shown) == (n, jpeg)
        assert PICTURES * len(jpeg) > 4 * MOST_KEPT_BYTES
        assert memory_bytes() - before < MOST_KEPT_BYTES


def memory_bytes() -> int:
    """Of this process, in which the server runs too."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_who_comes_late_sees_the_last_pose(shared: Client, done: str) -> None:
    with live(shared, done) as socket:
        header, jpeg = receive(socket)
    assert (header["state"], header["frame"], jpeg) == ("done", 39, b"")
    assert header["distance_mm"] == pytest.approx(62.4, abs=0.5)


def test_the_3d_view_takes_commands(shared: Client, done: str) -> None:
    with live(shared, done) as socket:
        receive(socket)
        for command in (
            {"type": "show", "frame": 3},
            {"type": "camera", "mode": "inside"},
            {"type": "show", "frame": None},
            {"type": "show", "frame": 10**6},
        ):
            socket.send(json.dumps(command))
        assert pong(socket) == []


def test_a_message_that_makes_no_sense_ends_the_connection(shared: Client, done: str) -> None:
    for message in ("{", "[]", '{"type": "x"}', '{"type": "show", "frame": -1}', b"\0\1"):
        with live(shared, done) as socket:
            receive(socket)
            socket.send(message)
            body = json.loads(socket.recv(PATIENCE_S))
            assert body.keys() == {"code", "detail"}, message
            with pytest.raises(ConnectionClosedError) as closed:
                socket.recv(PATIENCE_S)
        assert closed.value.rcvd.code == 1011, message


def expect_text(socket: ClientConnection, *skipped: str) -> dict[str, Any]:
    """The next text message, whatever pictures and skipped types come before it."""
    while True:
        message = socket.recv(PATIENCE_S)
        if isinstance(message, str):
            found: dict[str, Any] = json.loads(message)
            if found["type"] not in skipped:
                return found


def pong(socket: ClientConnection) -> list[str | bytes]:
    """What comes before the answer to a ping."""
    socket.send(json.dumps({"type": "ping", "t": 0}))
    came: list[str | bytes] = []
    while isinstance(message := socket.recv(PATIENCE_S), bytes) or "pong" not in message:
        came.append(message)
    assert json.loads(message) == {"type": "pong", "t": 0}
    return came


def test_pages_of_an_inspection_learn_of_each_other_and_of_changes(
    shared: Client, own: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_route, "EVERY_S", 0.0)
    with (
        live(shared, own, page="1" * 32) as first,
        live(shared, own, page="2" * 32) as second,
        live(shared, own) as program,
    ):
        for socket in (first, second, program):
            receive(socket)
        first.send(json.dumps({"type": "here", "editing": None}))
        assert expect_text(first) == {"type": "people", "others": []}
        # Who says nothing hears of the others, but is not one of them.
        there = {"type": "people", "others": [{"name": "server", "editing": None}]}
        assert expect_text(second) == there
        shared.patch(f"/api/inspections/{own}", json={"header": {"client": "JKR"}})
        for socket in (first, second):
            assert expect_text(socket) == {"type": "changed"}
        tag = shared.tag(own, frame=3).json()["id"]
        for socket in (first, second):
            assert expect_text(socket) == {"type": "changed"}
        second.send(json.dumps({"type": "here", "editing": tag}))
        there["others"][0]["editing"] = tag  # type: ignore[index]
        assert expect_text(first, "changed") == there  # the photo of the tag changes it again
        second.close()
        assert expect_text(first, "changed") == {"type": "people", "others": []}
        assert pong(program) == [], "it gets neither"


def test_of_many_changes_at_once_a_page_gets_one_note(
    shared: Client, own: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_route, "EVERY_S", 3600.0)
    with live(shared, own, page="1" * 32) as first, live(shared, own, page="2" * 32) as second:
        for socket in (first, second):
            receive(socket)
        first.send(json.dumps({"type": "here", "editing": None}))
        assert expect_text(first) == {"type": "people", "others": []}
        for name in "abcdefgh":
            second.send(json.dumps({"type": "here", "editing": name}))
            shared.put(f"/api/inspections/{own}/labels", json={"labels": [name]})
        pong(second)
        assert pong(first) == ['{"type":"changed"}']


def test_one_token_or_address_does_not_take_all_live_connections(
    shared: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(middleware, "MOST_SOCKETS", 2)
    path = f"/api/inspections/{done}/live"

    def opened(**options: Any) -> ClientConnection:
        """Those of earlier tests may still be ending."""
        found: list[ClientConnection] = []

        def can_open() -> bool:
            with suppress(InvalidStatus):
                found.append(shared.socket(path, **options))
            return bool(found)

        wait_until(can_open)
        return found[0]

    with opened(), opened():
        for other in ("127.0.0.1", "127.0.0.2"):  # of another address: the token has its share
            with pytest.raises(InvalidStatus) as refused:
                shared.socket(path, source_address=(other, 0))
            answer = refused.value.response
            assert (answer.status_code, json.loads(answer.body)["code"]) == (503, "busy")
    with opened(), opened():
        pass


def test_an_unknown_inspection_is_reported_and_closed(shared: Client) -> None:
    with live(shared, "0" * 32) as socket:
        assert json.loads(socket.recv(PATIENCE_S))["code"] == "inspection_not_found"
        with pytest.raises(ConnectionClosedError) as closed:
            socket.recv(PATIENCE_S)
    assert closed.value.rcvd.code == 4404


def test_the_3d_view_of_an_unknown_inspection_is_refused(shared: Client) -> None:
    assert_error(shared.get(f"/viewer/{'0' * 32}/"), 404, "inspection_not_found")


def test_the_3d_page_has_its_own_policy_and_is_not_sent_twice(shared: Client, done: str) -> None:
    path = shared.view_path(done)
    page = shared.get(path)
    assert page.status_code == 200
    assert "<title>" in page.text
    assert "frame-ancestors 'self'" in page.headers["Content-Security-Policy"]
    assert "X-Frame-Options" not in page.headers
    again = shared.get(path, headers={"If-None-Match": page.headers["ETag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert_error(shared.get("/viewer/none/"), 422, "invalid_request")


def test_the_3d_view_speaks_through_our_origin(shared: Client, done: str) -> None:
    with shared.view(done) as socket:
        assert socket.subprotocol == "viser-v1.1.1"
        assert len(socket.recv(PATIENCE_S)) > 100
