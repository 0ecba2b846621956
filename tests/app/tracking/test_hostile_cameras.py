"""Cameras that send rubbish, and where the password of a camera does not appear."""

from __future__ import annotations

import logging
import os
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Client, assert_error, children, clip_rig, serving, wait_until
from camera_sessions import session
from cameras import MjpegCamera

from app.jobs.messages import Failed

CAMERA = "app.jobs.live.camera"
MEMORY_BYTES = 768 * 2**20
"""The least that an operator may set."""
_PIECE, _PAUSE_S = 2**16, 0.005
"""Some 10 MB a second: what an endless answer sends without keeping the machine busy."""
OK = b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=picture\r\n"
PART = b"--picture\r\nContent-Type: image/jpeg\r\n"

Send = Callable[[bytes], None]


class Rubbish:
    """Answers whoever connects with what a function sends, as long as he listens."""

    def __init__(self, scheme: str, answer: Callable[[Send], None]) -> None:
        self._answer = answer
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.url = f"{scheme}://127.0.0.1:{self._socket.getsockname()[1]}/video"
        self._closing = threading.Event()
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                connection, _ = self._socket.accept()
                threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        def send(piece: bytes) -> None:
            if self._closing.is_set():
                raise ConnectionError
            connection.sendall(piece)
            self._closing.wait(_PAUSE_S)

        with closing(connection), suppress(OSError):
            connection.settimeout(30)
            connection.recv(4096)
            self._answer(send)

    def close(self) -> None:
        self._closing.set()
        self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()


def forever(piece: bytes) -> Callable[[Send], None]:
    def answer(send: Send) -> None:
        while True:
            send(piece)

    return answer


def after(head: bytes, rest: Callable[[Send], None]) -> Callable[[Send], None]:
    def answer(send: Send) -> None:
        send(head)
        rest(send)

    return answer


def silence(send: Send) -> None:
    while True:
        send(b"")


NOISE = np.random.default_rng(1).bytes(_PIECE)
CHUNK = b"%x\r\n%b\r\n" % (_PIECE, NOISE)
HUGE = b"\xff\xd8\xff\xc0\x00\x11\x08\xff\xdc\xff\xdc\x03\x01\x22\x00\x02\x11\x01\x03\x11\x01"
SDP = b"v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=x\r\nt=0 0\r\n" + b"m=video 0 RTP/AVP 96\r\n" * 500
RUBBISH: dict[str, tuple[str, Callable[[Send], None]]] = {
    "noise": ("http", forever(NOISE)),
    "silence": ("http", silence),
    "silence after the head": ("http", after(OK + b"\r\n", silence)),
    "endless headers": ("http", after(OK, forever(b"X-More: " + b"y" * 4000 + b"\r\n"))),
    "endless header": ("http", after(OK + b"X: ", forever(b"y" * _PIECE))),
    "noise for pictures": ("http", after(OK + b"\r\n", forever(PART + b"\r\n" + NOISE))),
    "never-ending picture": (
        "http",
        after(OK + b"\r\n" + PART + b"Content-Length: 2000000000\r\n\r\n\xff\xd8", forever(NOISE)),
    ),
    "never-ending part": ("http", after(OK + b"\r\n" + PART + b"\r\n", forever(bytes(_PIECE)))),
    "never-ending chunk": (
        "http",
        after(OK + b"Transfer-Encoding: chunked\r\n\r\n" + b"7fffffff\r\n", forever(NOISE)),
    ),
    "chunks": ("http", after(OK + b"Transfer-Encoding: chunked\r\n\r\n", forever(CHUNK))),
    "huge picture": (
        "http",
        after(
            OK + b"\r\n",
            forever(
                PART + b"Content-Length: %d\r\n\r\n%b\r\n" % (len(HUGE) + 99, HUGE + bytes(99))
            ),
        ),
    ),
    "rtsp noise": ("rtsp", forever(NOISE)),
    "rtsp silence": ("rtsp", silence),
    "rtsp endless description": (
        "rtsp",
        after(b"RTSP/1.0 200 OK\r\nCSeq: 1\r\nContent-Length: 2000000000\r\n\r\n", forever(SDP)),
    ),
    "rtsp interleaved": ("rtsp", forever(b"$\x07\xff\xff" + NOISE[:0xFFFF])),
}


@pytest.fixture(scope="module")
def field(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A server that may open cameras on loopback."""
    data = tmp_path_factory.mktemp("field")
    with serving(data, camera_networks=("127.0.0.0/8",), child_memory_bytes=MEMORY_BYTES) as client:
        yield client


def detail(client: Client, inspection_id: str) -> str | None:
    """Why there is no picture."""
    now = client.inspection(inspection_id)
    reason = now["live"]["detail"] if now["live"] else now["error"] and now["error"]["detail"]
    return str(reason) if reason else None


def test_a_camera_that_sends_rubbish_gives_a_plain_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, is_long: bool
) -> None:
    monkeypatch.setattr(
        "app.jobs.live.cameras._TIMEOUTS_S", dict.fromkeys(("rtsp", "mjpeg"), (1, 1))
    )
    begun = {}
    for name, (scheme, answer) in list(RUBBISH.items())[:: 1 if is_long else 3]:
        (tmp_path / name).mkdir()
        camera = Rubbish(scheme, answer)
        begun[name] = camera, session(camera.url, tmp_path / name)
    failures = []
    for name, (camera, live) in begun.items():
        live.until_said()
        camera.close()
        live.stop()
        reason = live.end.detail if isinstance(live.end, Failed) else live.states[-1].status.detail
        if live.rows or not reason or not reason.endswith(".") or "127.0.0.1" in reason:
            failures.append(f"{name}: {reason}, {len(live.rows)} pictures")
    assert not failures, "\n".join(failures)


PASSWORD, QUERY = "s3cret-of-the-camera", "hidden-in-the-query"


def test_the_password_of_a_camera_is_nowhere_to_be_found(
    field: Client, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    caplog.set_level(logging.DEBUG)
    seen: dict[str, Any] = {}
    with MjpegCamera(login=f"operator:{PASSWORD}") as camera:
        inspection_id = field.record(f"{camera.url}?pwd={QUERY}#{QUERY}")
        path = f"/api/inspections/{inspection_id}"
        wait_until(lambda: field.inspection(inspection_id)["progress"]["frames_done"] > 5)
        for pid in [*children(CAMERA), os.getpid()]:
            seen[f"command {pid}"] = Path(f"/proc/{pid}/cmdline").read_bytes()
            seen[f"environment {pid}"] = Path(f"/proc/{pid}/environ").read_bytes()
        field.tag(inspection_id, frame=3, code="BAF")
        camera.drop_out()
        wait_until(lambda: detail(field, inspection_id))
        seen["while it is gone"] = field.get(path).content
        camera.come_back()
        camera.login = "operator:changed"  # from now on it refuses the password
        wait_until(lambda: "password" in (detail(field, inspection_id) or ""))
        seen["refused"] = field.get(path).content
        field.post(f"{path}/finish", json={"end_condition": "complete"})
        field.wait(inspection_id)
    for address in (
        "/api/inspections", path, f"{path}/events", f"{path}/observations", f"{path}/track",
        f"{path}/track?format=json", f"{path}/exports/csv", f"{path}/exports/json", "/api/sources",
        "/", "/metrics", "/readyz",
    ):  # fmt: skip
        seen[address] = field.get(address).content
    for url in (
        f"rtsp://operator:{PASSWORD}@8.8.8.8/{QUERY}",
        f"rtsp://operator:{PASSWORD}@no.such.name.invalid/?{QUERY}",
        f"http://operator:{PASSWORD}@127.0.0.1:99999/?{QUERY}",
        f"http://operator:{PASSWORD}@[::1/?{QUERY}",
        f"ftp://operator:{PASSWORD}@127.0.0.1/?{QUERY}",
        f"{PASSWORD} {QUERY}",
        f"rtsp://{PASSWORD}:{QUERY}@127.0.0.1/{'x' * 2000}",
    ):
        body: dict[str, Any] = {"name": "x", "rig": clip_rig()}
        for source in ({"kind": "live", "url": url}, url):
            answer = field.post("/api/inspections", json=body | {"source": source})
            assert_error(answer, 422, answer.json()["code"])
            seen[f"error {url} {type(source)}"] = answer.content
    for file in field.data.rglob("*"):
        if file.is_file():
            seen[str(file)] = file.read_bytes()
    seen["log"] = caplog.text.encode()
    seen["printed"] = "".join(capfd.readouterr()).encode()
    assert "127.0.0.1" in caplog.text, "the address itself is in the log"
    for place, content in seen.items():
        assert PASSWORD.encode() not in content, place
        assert QUERY.encode() not in content, place
