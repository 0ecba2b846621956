import json
import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from builders import (
    PATIENCE_S,
    Client,
    assert_error,
    frame_number,
    wait_until,
)
from websockets.exceptions import ConnectionClosedError
from websockets.sync.client import ClientConnection

from app.tracking.live import Progress
from app.web.changes import EVERY_S
from vo_core import Estimate

PICTURES, MOST_KEPT_BYTES = 700, 20 * 2**20
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


def test_pose_and_picture_of_a_message_are_of_the_same_frame(
    server: Client, long_clip: Path
) -> None:
    inspection_id = server.inspect(long_clip)
    seen = []
    with live(server, inspection_id) as socket:
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
    assert last["progress"]["frames_done"] > last["frame"]
    assert last["progress"]["frames_total"] == 1500
    assert {
        "time_s", "x_mm", "y_mm", "yaw_deg", "sigma_distance_mm", "quality", "status",
    } <= last.keys()  # fmt: skip


def test_slow_reader_gets_newest_pose(server: Client, long_clip: Path) -> None:
    inspection_id = server.inspect(long_clip)
    server.wait(inspection_id, "running")
    with live(server, inspection_id) as socket:
        first, second = receive(socket)[0], receive(socket)[0]
        wait_until(
            lambda: (
                server.inspection(inspection_id)["progress"]["frames_done"]
                > (second["frame"] or 0) + 100
            )
        )
        with pytest.raises(TimeoutError):
            socket.recv(0.2)
        acknowledge(socket, first)
        newest = receive(socket)[0]
        assert newest["seq"] > second["seq"] + 2, "what came between was left out"
        assert newest["frame"] > second["frame"] + 50


def test_who_reads_nothing_holds_up_nobody_and_takes_no_memory(server: Client, done: str) -> None:
    published = server.server.app.state.services.live.publish
    noise = np.random.default_rng(3).integers(0, 256, (480, 640), np.uint8)
    jpeg = cv2.imencode(".jpg", noise, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    pose = Estimate(39, 1.56, 62.4, 0.0, 0.0, 62.4, 0.1, 1.0, "ok", 0.1)
    with live(server, done, max_queue=1) as deaf, live(server, done) as reader:
        acknowledge(reader, receive(reader)[0])
        before = memory_bytes()
        for n in range(PICTURES):
            published(done, "running", Progress(n, None, 20.0, None), (pose,), jpeg)
            deaf.send(json.dumps({"type": "ack", "seq": 2**53}))
            header, shown = receive(reader)
            acknowledge(reader, header)
            assert (header["progress"]["frames_done"], shown) == (n, jpeg)
        assert PICTURES * len(jpeg) > 10 * MOST_KEPT_BYTES
        assert memory_bytes() - before < MOST_KEPT_BYTES


def memory_bytes() -> int:
    """Of this process, in which the server runs too."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_the_end_is_reported_to_those_who_watch(server: Client, clip: Path) -> None:
    inspection_id = server.inspect(clip)
    with live(server, inspection_id) as socket:
        states = []
        while not states or states[-1] != "done":
            header, _ = receive(socket)
            acknowledge(socket, header)
            states.append(header["state"])
    assert header["progress"]["frames_done"] == 40


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
        with pytest.raises(TimeoutError):
            socket.recv(0.3)


@pytest.mark.parametrize(
    "message", ["{", "[]", '{"type": "x"}', '{"type": "show", "frame": -1}', b"\0\1"]
)
def test_a_message_that_makes_no_sense_ends_the_connection(
    shared: Client, done: str, message: str | bytes
) -> None:
    with live(shared, done) as socket:
        receive(socket)
        socket.send(message)
        body = json.loads(socket.recv(PATIENCE_S))
        assert body.keys() == {"code", "detail"}
        with pytest.raises(ConnectionClosedError) as closed:
            socket.recv(PATIENCE_S)
    assert closed.value.rcvd.code == 1011


def expect_text(socket: ClientConnection, *skipped: str) -> dict[str, Any]:
    """The next text message, whatever pictures and skipped types come before it."""
    while True:
        message = socket.recv(PATIENCE_S)
        if isinstance(message, str):
            found: dict[str, Any] = json.loads(message)
            if found["type"] not in skipped:
                return found


def test_pages_of_an_inspection_learn_of_each_other_and_of_changes(
    server: Client, done: str
) -> None:
    with (
        live(server, done, page="1" * 32) as first,
        live(server, done, page="2" * 32) as second,
        live(server, done) as program,
    ):
        for socket in (first, second, program):
            receive(socket)
        first.send(json.dumps({"type": "here", "editing": None}))
        assert expect_text(first) == {"type": "people", "others": []}
        # Who says nothing hears of the others, but is not one of them.
        there = {"type": "people", "others": [{"name": "server", "editing": None}]}
        assert expect_text(second) == there
        began_s = time.monotonic()
        for name in "abcdefgh":
            server.put(f"/api/inspections/{done}/labels", json={"labels": [name]})
        most = 2 + (time.monotonic() - began_s) / EVERY_S
        notes = []
        with suppress(TimeoutError):
            while True:
                notes.append(first.recv(1.5 * EVERY_S))
        assert set(notes) == {'{"type":"changed"}'}
        assert len(notes) <= most
        tag = server.tag(done, frame=3).json()["id"]
        for socket in (first, second):
            assert expect_text(socket) == {"type": "changed"}
        second.send(json.dumps({"type": "here", "editing": tag}))
        there["others"][0]["editing"] = tag  # type: ignore[index]
        assert expect_text(first, "changed") == there  # the photo of the tag changes it again
        began_s = time.monotonic()
        for editing in "abcdefgh":
            second.send(json.dumps({"type": "here", "editing": editing}))
            second.send(json.dumps({"type": "ping", "t": 0}))
            assert expect_text(second, "changed", "people") == {"type": "pong", "t": 0}
        second.close()
        most = 2 + (time.monotonic() - began_s) / EVERY_S
        notes = [expect_text(first, "changed")]
        while notes[-1] != {"type": "people", "others": []}:
            notes.append(expect_text(first, "changed"))
        assert len(notes) <= most
        server.patch(f"/api/inspections/{done}", json={"header": {"client": "JKR"}})
        assert expect_text(first) == {"type": "changed"}
        program.send(json.dumps({"type": "ping", "t": 1}))
        assert expect_text(program) == {"type": "pong", "t": 1}  # the first text that it gets


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
