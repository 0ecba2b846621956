"""What cameras send: MJPEG over HTTP in all its forms, and what cannot be read."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders import HEIGHT, WIDTH
from camera_sessions import LOOPBACK, session
from cameras import MJPEG_HEAD, MjpegCamera, Picture, RtspCamera, floor, mjpeg_part

from app.jobs.live.cameras import CameraFault, opened
from app.jobs.messages import Failed

JPEG = cv2.imencode(".jpg", floor(0))[1].tobytes()


def typed(*lines: str, end: bytes = b"\r\n") -> Callable[[bytes], bytes]:
    """Parts with these lines in their heads."""

    def part(jpeg: bytes) -> bytes:
        head = "".join(f"{line}\r\n" for line in ("--picture", *lines, ""))
        return head.replace("SIZE", str(len(jpeg))).encode() + jpeg + end

    return part


def head_of(content_type: str | None, *lines: str, status: str = "HTTP/1.1 200 OK") -> bytes:
    more = [] if content_type is None else [f"Content-Type: {content_type}"]
    return "\r\n".join([status, *more, *lines, "", ""]).encode()


def chunked(jpeg: bytes) -> bytes:
    part = mjpeg_part(jpeg)
    halves = part[:1000], part[1000:]
    return b"".join(b"%x\r\n%b\r\n" % (len(each), each) for each in halves)


FORMS: dict[str, tuple[bytes, Callable[[bytes], bytes]]] = {
    "no boundary before the first": (
        MJPEG_HEAD,
        lambda jpeg: b"Content-Type: image/jpeg\r\n\r\n" + jpeg + b"\r\n--picture\r\n",
    ),
    "image/jpg": (MJPEG_HEAD, typed("Content-Type: image/jpg", "Content-Length: SIZE")),
    "parameters": (MJPEG_HEAD, typed("Content-Type: image/jpeg; charset=utf-8")),
    "no type": (MJPEG_HEAD, typed("Content-Length: SIZE")),
    "no head of a part": (MJPEG_HEAD, typed()),
    "no line end": (MJPEG_HEAD, typed("Content-Type: image/jpeg", end=b"")),
    "lower case": (MJPEG_HEAD, typed("content-type: image/jpeg", "content-length: SIZE")),
    "length too short": (MJPEG_HEAD, typed("Content-Length: 99")),
    "length too long": (MJPEG_HEAD, typed("Content-Length: 99999999")),
    "more lines": (MJPEG_HEAD, typed("X-Timestamp: 1.25", "Content-Type: image/jpeg")),
    "dashes in the head": (
        head_of("multipart/x-mixed-replace;boundary=--picture"), mjpeg_part,
    ),
    "quoted": (head_of('multipart/x-mixed-replace; boundary="picture"'), mjpeg_part),
    "another boundary": (head_of("multipart/x-mixed-replace; boundary=other"), mjpeg_part),
    "no boundary": (head_of("multipart/x-mixed-replace"), mjpeg_part),
    "no header": (head_of(None, status="HTTP/1.0 200"), mjpeg_part),
    "line feeds alone": (
        MJPEG_HEAD.replace(b"\r", b""),
        lambda jpeg: b"--picture\nContent-Type: image/jpeg\n\n" + jpeg + b"\n",
    ),
    "a piece of a picture first": (MJPEG_HEAD + JPEG[:300], mjpeg_part),
    "preamble": (MJPEG_HEAD + b"This is a multi-part message.\r\n\r\n", mjpeg_part),
    "pictures alone": (head_of("video/x-motion-jpeg"), bytes),
    "chunks": (
        head_of("multipart/x-mixed-replace; boundary=picture", "Transfer-Encoding: chunked"),
        chunked,
    ),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_pictures_come_in_whatever_form_a_camera_sends_them(form: str) -> None:
    head, part = FORMS[form]
    with MjpegCamera(rate_hz=200, head=head, part=part) as camera:
        found = LOOPBACK.resolve(camera.url, (WIDTH, HEIGHT)).camera
        with opened(found) as source:
            pictures = [bytes(packet) for packet in islice(source.packets, 5)]
        assert (source.codec.name, source.codec.width, source.codec.height) == (
            "mjpeg", WIDTH, HEIGHT,
        )  # fmt: skip
    seen = [cv2.imdecode(np.frombuffer(each, np.uint8), cv2.IMREAD_GRAYSCALE) for each in pictures]
    assert all(each.startswith(b"\xff\xd8") and each.endswith(b"\xff\xd9") for each in pictures)
    assert [each.shape for each in seen] == 5 * [(HEIGHT, WIDTH)]


@pytest.mark.parametrize(
    ("content_type", "body", "said"),
    [("image/jpeg", JPEG, "a snapshot"), ("text/html", b"<html>Log in</html>", "a web page")],
)
def test_an_address_without_a_stream_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content_type: str, body: bytes, said: str
) -> None:
    monkeypatch.setattr("app.jobs.live.capture.UNREACHABLE_AFTER_S", 0.1)
    head = head_of(content_type, f"Content-Length: {len(body)}")
    with MjpegCamera(head=head, part=lambda _: body) as camera:
        live = session(camera.url, tmp_path).until_end()
    assert isinstance(live.end, Failed)
    assert live.end.code == "camera_unreachable"
    assert said in live.end.detail
    assert not (tmp_path / "recording.mkv").exists()


@pytest.mark.parametrize(("encoding", "said"), [("H265", "no whole picture"), ("X", "no video")])
def test_a_stream_whose_picture_size_stays_unknown_is_named(encoding: str, said: str) -> None:
    def first(number: int) -> Picture:
        if number > 5:
            raise ConnectionError  # nobody waits for the rest
        return floor(number)

    with RtspCamera(encoding=encoding, picture=first) as camera:
        found = LOOPBACK.resolve(camera.url, (WIDTH, HEIGHT)).camera
        with pytest.raises(CameraFault, match=said), opened(found):
            pass
