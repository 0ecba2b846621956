"""Broken and malicious files: each ends clearly, nobody else notices, also through a server."""

from __future__ import annotations

import ctypes
import os
import socket
import struct
import threading
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from builders import Client, assert_error, serving, wait_until
from hostile import FRAMES, RIG, SIZE_WH, copy_packets, write_clip
from ready_tracker import ReadyTracker

from app.jobs.live.recording import Coding, Recording
from app.jobs.messages import Limits
from app.tracking.pictures.media import Media
from vo_core.errors import UnreadableVideo

_IN_OPEN = 0x20


class Listener:
    """Somebody whom nobody should call."""

    def __init__(self) -> None:
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        self.calls = 0
        self._thread = threading.Thread(target=self._accept, daemon=True)
        self._thread.start()

    def _accept(self) -> None:
        while True:
            try:
                self._socket.accept()[0].close()
            except OSError:
                return
            self.calls += 1

    def close(self) -> None:
        self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()
        self._thread.join()


class Canary:
    """A whole video that the kernel watches for whoever opens it."""

    def __init__(self, path: Path) -> None:
        self.path = write_clip(path)
        libc = ctypes.CDLL(None, use_errno=True)
        self._events = libc.inotify_init1(os.O_NONBLOCK)
        assert libc.inotify_add_watch(self._events, os.fsencode(path), _IN_OPEN) >= 0

    def was_opened(self) -> bool:
        try:
            return bool(os.read(self._events, 4096))
        except BlockingIOError:
            return False

    def close(self) -> None:
        os.close(self._events)


@dataclass
class Place:
    """The media process, the tracker, and those who must not notice what they are given."""

    folder: Path
    media: Media
    tracker: ReadyTracker
    listener: Listener
    canary: Canary

    def assert_unnoticed(self, by: str) -> None:
        assert not self.canary.was_opened(), by
        assert self.listener.calls == 0, by


@pytest.fixture
def place(tmp_path: Path) -> Iterator[Place]:
    folder = tmp_path / "uploads"
    folder.mkdir()
    canary, listener = Canary(folder / "neighbour.mp4"), Listener()
    media = Media(Limits(768 * 2**20, reads=(str(folder),)))
    with ReadyTracker(RIG) as tracker:
        yield Place(folder, media, tracker, listener, canary)
    media.close()
    listener.close()
    canary.close()


def test_who_opens_the_canary_or_calls_the_listener_is_seen(tmp_path: Path) -> None:
    canary, listener = Canary(tmp_path / "canary.mp4"), Listener()
    assert not canary.was_opened()
    canary.path.read_bytes()
    assert canary.was_opened()
    socket.create_connection(("127.0.0.1", listener.port)).close()
    wait_until(lambda: listener.calls)
    listener.close()
    canary.close()


# What leads elsewhere: {file} and {port} are the canary and the listener.

PLAYLIST = (
    "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nhttp://127.0.0.1:{port}/a.ts\n"
    "#EXTINF:1,\nfile://{file}\n#EXTINF:1,\nconcat:{file}|{file}\n#EXT-X-ENDLIST\n"
)
MASTER = (
    "#EXTM3U\n#EXT-X-MEDIA:TYPE=SUBTITLES,GROUP-ID='s',NAME='s',URI='http://127.0.0.1:{port}/s'\n"
    "#EXT-X-STREAM-INF:BANDWIDTH=1,SUBTITLES='s'\nhttp://127.0.0.1:{port}/b.m3u8\n"
)
KEYED = (
    "#EXTM3U\n#EXT-X-KEY:METHOD=AES-128,URI='http://127.0.0.1:{port}/key'\n"
    "#EXTINF:1,\nneighbour.mp4\n#EXT-X-ENDLIST\n"
)
CONCAT = "ffconcat version 1.0\nfile neighbour.mp4\nfile 'http://127.0.0.1:{port}/x'\n"
CONCAT_ABSOLUTE = "ffconcat version 1.0\nfile '{file}'\n"
SDP = (
    "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\n"
    "m=video {port} TCP/RTP/AVP 96\na=rtpmap:96 H264/90000\n"
)
DASH = (
    "<?xml version='1.0'?><MPD xmlns='urn:mpeg:dash:schema:mpd:2011' type='static'><Period>"
    "<BaseURL>http://127.0.0.1:{port}/</BaseURL><AdaptationSet mimeType='video/mp4'>"
    "<Representation id='1' bandwidth='1'/></AdaptationSet></Period></MPD>"
)
SUBTITLES = "1\n00:00:01,000 --> 00:00:02,000\n<img src='http://127.0.0.1:{port}/'>\n"


LINKS = (PLAYLIST, MASTER, KEYED, CONCAT, CONCAT_ABSOLUTE, SDP, DASH, SUBTITLES)


# Files that are no video, or no whole one.


def _zip(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.mp4", b"x" * 1000)


def _jpeg(path: Path) -> None:
    path.write_bytes(cv2.imencode(".jpg", np.zeros((64, 96), np.uint8))[1].tobytes())


def _sound(path: Path) -> None:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("aac", rate=8000)
        frame = av.AudioFrame.from_ndarray(
            np.zeros((1, 1024), np.float32), format="fltp", layout="mono"
        )
        frame.sample_rate, frame.pts = 8000, 0
        container.mux(stream.encode(frame))
        container.mux(stream.encode())


def _bomb(path: Path) -> None:
    """An AVI of PNG pictures of 16000x16000 in a few kilobytes."""
    side = 16_000
    rows = zlib.compress(bytes(side * (side // 8 + 1)), 9)
    head = struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)
    chunks = (b"IHDR", head), (b"IDAT", rows), (b"IEND", b"")
    png = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in chunks
    )
    with av.open(str(path), "w") as container:
        stream = container.add_stream("png", rate=25)
        assert isinstance(stream, av.VideoStream)
        stream.width, stream.height, stream.pix_fmt = side, side, "monob"
        for n in range(3):
            packet = av.Packet(png)
            packet.stream, packet.pts, packet.dts = stream, n, n
            packet.time_base = Fraction(1, 25)
            container.mux(packet)


def _huge_jpeg(path: Path) -> None:
    """Pictures whose own header says 65500x65500."""
    content = write_clip(path, "mjpeg").read_bytes()
    size = struct.pack(">HH", *reversed(SIZE_WH))
    path.write_bytes(content.replace(b"\x08" + size, b"\x08" + struct.pack(">HH", 65500, 65500)))


def _stated(path: Path, width: int, height: int) -> None:
    """A size in the container's header that the pictures do not have."""
    content = bytearray(write_clip(path, "mpeg4").read_bytes())
    at = content.index(b"strf") + 12
    content[at : at + 8] = struct.pack("<II", width, height)
    path.write_bytes(content)


NO_VIDEO: dict[str, Callable[[Path], object]] = {
    "empty.mp4": lambda path: path.write_bytes(b""),
    "noise.mp4": lambda path: path.write_bytes(np.random.default_rng(1).bytes(100_000)),
    "noise.ts": lambda path: path.write_bytes(b"\x47" + np.random.default_rng(2).bytes(100_000)),
    "zeros.avi": lambda path: path.write_bytes(bytes(100_000)),
    "archive.mp4": _zip,
    "page.mp4": lambda path: path.write_bytes(b"<!doctype html><title>Video</title>" * 100),
    "photo.mp4": _jpeg,
    "sound.mp4": _sound,
    "bomb.avi": _bomb,
    "huge.avi": _huge_jpeg,
    "tiny.mp4": lambda path: write_clip(path, size_wh=(16, 16)),
    "large.mp4": lambda path: write_clip(path, size_wh=(4096, 4096), frames=2),
}


def test_what_is_no_video_or_names_other_files_or_addresses_is_refused(place: Place) -> None:
    def link(text: str) -> Callable[[Path], object]:
        told = text.format(port=place.listener.port, file=place.canary.path)
        return lambda path: path.write_text(told)

    made = NO_VIDEO | {
        f"{n}.{kind}": link(text) for n, text in enumerate(LINKS) for kind in ("mp4", "m3u8")
    }
    failures = []
    for name, make in made.items():
        path = place.folder / f"stored.{name}"
        make(path)
        try:
            failures.append(f"{name}: {place.media.probe(path, name)}")
        except UnreadableVideo as refused:
            if str(place.folder) in str(refused) or not str(refused).endswith("."):
                failures.append(str(refused))
        place.assert_unnoticed(name)
    assert not failures, "\n".join(failures)
    assert place.media.restarts == 0


# Videos that are tracked as far as they go, and what is said of them.


def _cut(name: str, encoder: str, share: float, **options: str) -> Callable[[Path], None]:
    def make(path: Path) -> None:
        whole = write_clip(path, encoder, frames=100, **options).read_bytes()
        path.write_bytes(whole[: round(share * len(whole))])

    return make


def _size_changes(path: Path, size_wh: tuple[int, int]) -> None:
    first = write_clip(path).read_bytes()
    after = write_clip(path, size_wh=size_wh, times=lambda n: 512 * (n + FRAMES), frames=6)
    path.write_bytes(first + after.read_bytes())


def _faststart(path: Path) -> None:
    whole = write_clip(path.with_name("whole.mp4"), frames=100)
    copy_packets(whole, path, movflags="faststart")
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


def _stated_frames(path: Path) -> None:
    content = bytearray(write_clip(path, "mpeg4").read_bytes())
    content[(at := content.index(b"avih") + 24) : at + 4] = struct.pack("<I", 10**9)
    content[(at := content.index(b"strh") + 40) : at + 4] = struct.pack("<I", 10**9)
    path.write_bytes(content)


def _times_ms(times: list[int]) -> Callable[[Path], None]:
    """A Matroska file with these time stamps, whatever they are."""

    def make(path: Path) -> None:
        with av.open(str(write_clip(path.with_name("whole.mkv"), "mjpeg"))) as source:
            packets = [bytes(packet) for packet in source.demux(video=0) if packet.size]
        with Recording(path, Coding("mjpeg", *SIZE_WH, b"")) as recording:
            for time_ms, packet in zip(times, packets, strict=True):
                recording.append(time_ms, True, packet)

    return make


def _no_rate(path: Path) -> None:
    content = bytearray(write_clip(path, "mpeg4").read_bytes())
    content[(at := content.index(b"avih") + 8) : at + 4] = bytes(4)
    content[(at := content.index(b"strh") + 28) : at + 8] = bytes(8)
    path.write_bytes(content)


def _encrypted(path: Path) -> None:
    copy_packets(
        write_clip(path.with_name("whole.mp4")),
        path,
        encryption_scheme="cenc-aes-ctr",
        encryption_key="00112233445566778899aabbccddeeff",
        encryption_kid="a7e61c373e219033c21091fa607bf3b8",
    )


PARTIAL: dict[str, tuple[Callable[[Path], object], str]] = {
    "cut.mkv": (_cut("cut.mkv", "libx264", 0.5), "ends at"),
    "cut.avi": (_cut("cut.avi", "mpeg4", 0.5), "of 100 frames"),
    "faststart.mp4": (_faststart, "frames could be decoded"),
    "larger.ts": (lambda path: _size_changes(path, (320, 240)), "changes to 320x240"),
    "smaller.ts": (lambda path: _size_changes(path, (64, 48)), "changes to 64x48"),
    "too_large.ts": (lambda path: _size_changes(path, (4096, 4096)), "damaged packets"),
    "stated_frames.avi": (_stated_frames, "16 of 1000000000 frames"),
    "decreasing.mkv": (_times_ms([1000 - 40 * n for n in range(FRAMES)]), "damaged packets"),
    "jumping.mkv": (_times_ms([40 * n if n % 2 else 2**50 for n in range(FRAMES)]), ""),
    "far_apart.mkv": (_times_ms([n * 2**44 for n in range(FRAMES)]), ""),
    "no_rate.avi": (_no_rate, ""),
    "stated_small.avi": (lambda path: _stated(path, 1, 1), ""),
    "stated_large.avi": (lambda path: _stated(path, 100_000, 100_000), ""),
    "encrypted.mp4": (_encrypted, ""),
}
"""What makes it, and what its warning says; "" where a clear failure or a whole track is right."""


def test_what_can_be_used_is_and_the_rest_is_said(place: Place, *, is_long: bool) -> None:
    failures = []
    for name, (make, said) in list(PARTIAL.items())[:: 1 if is_long else 3]:
        path = place.folder / name
        make(path)
        verdict = place.tracker.verdict(path)
        is_used = verdict.end in ("whole", "partial") and verdict.frames > 0
        is_clear = verdict.end == "unreadable_video" and not said
        if not (is_used or is_clear) or said not in verdict.said:
            failures.append(f"{name}: {verdict}")
        place.assert_unnoticed(name)
    assert not failures, "\n".join(failures)


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with serving(tmp_path_factory.mktemp("hostile")) as running:
        yield running


def test_through_the_server_a_broken_file_is_refused_or_tracked_as_far_as_it_goes(
    client: Client, tmp_path: Path
) -> None:
    (tmp_path / "x.mp4").write_text(CONCAT_ABSOLUTE.format(file="/etc/passwd"))
    refused = assert_error(client.create(tmp_path / "x.mp4", rig=RIG), 422, "unreadable_video")
    assert "x.mp4" in refused
    assert "passwd" not in refused
    PARTIAL["cut.mkv"][0](tmp_path / "cut.mkv")
    ended = client.wait(client.inspect(tmp_path / "cut.mkv", rig=RIG))
    assert ended["status"] == "done"
    assert "ends at" in ended["warning"]
    track = client.get(f"/api/inspections/{ended['id']}/track?format=json&raw=true")
    columns = track.json()["columns"]
    assert len(columns["frame"]) == ended["progress"]["frames_done"] > 0
    assert np.all(np.diff(columns["time_s"]) > 0)
    assert np.isfinite(columns["distance_mm"]).all()


def test_a_name_that_ffmpeg_would_follow_is_only_a_name(client: Client, tmp_path: Path) -> None:
    content = write_clip(tmp_path / "whole.mp4").read_bytes()
    for name in (f"concat:{tmp_path}/a|b", f"subfile,,start,0,end,0,,:{tmp_path}/a",
                 "http://127.0.0.1:9/x.mp4", "../neighbour.mp4", "%03d.mp4"):  # fmt: skip
        upload_id = client.upload(content, name)
        body = {"name": "x", "source": {"kind": "upload", "upload_id": upload_id}, "rig": RIG}
        created = client.post("/api/inspections", json=body | {"counter": {"is_present": False}})
        assert created.status_code == 201, created.text
        assert created.json()["source"]["filename"] == name.rsplit("/", 1)[-1]
        folder = client.data / "inspections" / created.json()["id"]
        assert (folder / "video.mp4").read_bytes() == content
        client.post(f"/api/inspections/{created.json()['id']}/cancel")  # only the name matters
