"""Cameras on loopback: an MJPEG server and an RTSP server that can drop out and come back."""

from __future__ import annotations

import asyncio
import base64
import struct
import threading
import time
from collections.abc import Callable, Coroutine
from contextlib import suppress
from fractions import Fraction
from typing import Any

import av
import cv2
import numpy as np
from builders import BLOCK, HEIGHT, STEP_PX, WIDTH, blocks
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
_CLOCK_HZ = 90_000
_MOST_PAYLOAD = 1400


def floor(number: int) -> Picture:
    """Draw frame `number` of the floor of `builders.make_clip`, driven back and forth, numbered on
    top.
    """
    position = number % (2 * _TURN)
    left = STEP_PX * (position if position < _TURN else 2 * _TURN - position)
    picture = _FLOOR[:, left : left + WIDTH].copy()
    picture[:BLOCK] = blocks(number)
    return picture


_TURN = 3000
"""Frames from one end of the floor to the other: longer than a busy machine takes to start a server
and to connect, so that the robot is on its way forward then."""


def _made_floor() -> Picture:
    rng = np.random.default_rng(7)
    noise = rng.integers(0, 256, (HEIGHT, WIDTH + STEP_PX * _TURN), np.uint8)
    grey = cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 2), None, 30, 225, cv2.NORM_MINMAX)
    return grey.astype(np.uint8)


_FLOOR = _made_floor()


class Camera:
    """A camera that has been filming since it was created; a client sees the present picture."""

    def __init__(
        self,
        *,
        rate_hz: float = 15,
        size_wh: tuple[int, int] = (WIDTH, HEIGHT),
        picture: Callable[[int], Picture] = floor,
        host: str = "127.0.0.1",
        port: int = 0,
        location: str | None = None,
    ) -> None:
        """With a `location`, redirect every client there."""
        self.host, self.location = host, location
        self.rate_hz = rate_hz
        self.size_wh = size_wh
        self._picture = picture
        self._began_s = time.monotonic()
        self.connections = 0
        self.requests: list[bytes] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self._speaks = asyncio.Event()
        self._speaks.set()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._server: asyncio.Server | None = None
        self.port = port
        self._call(self._listen())

    def __enter__(self) -> Camera:
        return self

    def __exit__(self, *_error: object) -> None:
        self.drop_out()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    @property
    def url(self) -> str:
        raise NotImplementedError

    def drop_out(self) -> None:
        """Behave as if the cable were pulled: connections break, new ones are refused."""
        self._call(self._close())

    def come_back(self) -> None:
        """Listen again on the same port."""
        self._call(self._listen())

    def fall_silent(self) -> None:
        """Keep the connections, accept new ones, and send no pictures."""
        self._loop.call_soon_threadsafe(self._speaks.clear)

    def speak(self) -> None:
        """Send pictures again."""
        self._loop.call_soon_threadsafe(self._speaks.set)

    def picture(self, number: int) -> Picture:
        picture = self._picture(number)
        if (picture.shape[1], picture.shape[0]) != self.size_wh:
            picture = np.asarray(cv2.resize(picture, self.size_wh), np.uint8)
        return picture

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        raise NotImplementedError

    async def next_number(self, last: int) -> int:
        """Wait for the next picture; a camera that is not read skips some."""
        await self._speaks.wait()
        due = max(last + 1, int((time.monotonic() - self._began_s) * self.rate_hz))
        await asyncio.sleep(self._began_s + due / self.rate_hz - time.monotonic())
        return due

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections += 1
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        with suppress(ConnectionError, asyncio.IncompleteReadError, asyncio.CancelledError):
            await self.serve(reader, writer)
        self._tasks.discard(task)
        writer.transport.abort()

    async def _listen(self) -> None:
        self._server = await asyncio.start_server(self._connected, self.host, self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def _close(self) -> None:
        if self._server is not None:
            self._server.close()
            self._server = None
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _call(self, work: Coroutine[Any, Any, None]) -> None:
        asyncio.run_coroutine_threadsafe(work, self._loop).result(10)


MJPEG_HEAD = b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=picture\r\n\r\n"


def mjpeg_part(jpeg: bytes) -> bytes:
    """Return a part of an MJPEG stream as most cameras send it."""
    head = b"--picture\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(jpeg)
    return head + jpeg + b"\r\n"


class MjpegCamera(Camera):
    """JPEG after JPEG in one HTTP answer; with a password if one is given."""

    def __init__(
        self,
        *,
        login: str | None = None,
        head: bytes = MJPEG_HEAD,
        part: Callable[[bytes], bytes] = mjpeg_part,
        **kind: Any,
    ) -> None:
        """Send the head of the answer, then for each picture its part."""
        self.login = login
        self._head, self._part = head, part
        super().__init__(**kind)

    @property
    def url(self) -> str:
        login = f"{self.login}@" if self.login else ""
        return f"http://{login}{self.host}:{self.port}/video"

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        request = await reader.readuntil(b"\r\n\r\n")
        self.requests.append(request)
        if self.location:
            writer.write(f"HTTP/1.1 302 Found\r\nLocation: {self.location}\r\n\r\n".encode())
            await writer.drain()
            return
        wanted = base64.b64encode(self.login.encode()) if self.login else b""
        if self.login and b"Basic " + wanted not in request:
            writer.write(
                b'HTTP/1.1 401 Unauthorized\r\nWWW-Authenticate: Basic realm="camera"\r\n'
                b"Content-Length: 0\r\nConnection: close\r\n\r\n"
            )
            await writer.drain()
            return
        writer.write(self._head)
        number = -1
        while not writer.is_closing():
            number = await self.next_number(number)
            _, jpeg = cv2.imencode(".jpg", self.picture(number), [cv2.IMWRITE_JPEG_QUALITY, 85])
            writer.write(self._part(jpeg.tobytes()))
            await writer.drain()


class RtspCamera(Camera):
    """H.264 over RTP, interleaved in the RTSP connection; it may call it by another name."""

    def __init__(self, *, encoding: str = "H264", **kind: Any) -> None:
        self._encoding = encoding
        super().__init__(**kind)

    @property
    def url(self) -> str:
        return f"rtsp://{self.host}:{self.port}/stream"

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        encoder = _H264(self.size_wh, round(self.rate_hz))
        first = encoder.encode(self.picture(0), is_key=True)
        while True:
            request = await reader.readuntil(b"\r\n\r\n")
            self.requests.append(request)
            method = request.split(b" ", 1)[0].decode()
            sequence = next(
                line.split(b":")[1].strip().decode()
                for line in request.split(b"\r\n")
                if line.lower().startswith(b"cseq:")
            )
            if self.location is not None:
                writer.write(
                    f"RTSP/1.0 302 Moved\r\nCSeq: {sequence}\r\n"
                    f"Location: {self.location}\r\n\r\n".encode()
                )
                await writer.drain()
                return
            writer.write(_rtsp_answer(method, sequence, first, self._encoding))
            await writer.drain()
            if method == "PLAY":
                break
        await self._play(writer, encoder)

    async def _play(self, writer: asyncio.StreamWriter, encoder: _H264) -> None:
        number, sequence, is_key = -1, 0, True
        while not writer.is_closing():
            number = await self.next_number(number)
            units = encoder.encode(self.picture(number), is_key=is_key)
            is_key = number % 30 == 0
            timestamp = round(number * _CLOCK_HZ / self.rate_hz) & 0xFFFFFFFF
            for payload, is_last in _payloads(units):
                head = struct.pack(
                    ">BBHII", 0x80, 96 | (0x80 if is_last else 0), sequence, timestamp, 0x1234
                )
                packet = head + payload
                writer.write(b"$\0" + struct.pack(">H", len(packet)) + packet)
                sequence = (sequence + 1) & 0xFFFF
            await writer.drain()


class _H264:
    def __init__(self, size_wh: tuple[int, int], rate_hz: int) -> None:
        context = av.CodecContext.create("libx264", "w")
        assert isinstance(context, av.VideoCodecContext)
        context.width, context.height = size_wh
        context.pix_fmt = "yuv420p"
        context.time_base = Fraction(1, rate_hz)
        context.gop_size = 30
        context.options = {"preset": "ultrafast", "tune": "zerolatency", "crf": "20"}
        self._context = context
        self._count = 0

    def encode(self, grey: Picture, *, is_key: bool) -> list[bytes]:
        """Return the NAL units of a picture."""
        frame = av.VideoFrame.from_ndarray(grey, format="gray").reformat(format="yuv420p")
        frame.pts = self._count
        frame.pict_type = (
            av.video.frame.PictureType.I if is_key else av.video.frame.PictureType.NONE
        )
        self._count += 1
        data = b"".join(bytes(packet) for packet in self._context.encode(frame))
        return [unit for unit in data.replace(b"\0\0\0\1", b"\0\0\1").split(b"\0\0\1") if unit]


def _payloads(units: list[bytes]) -> list[tuple[bytes, bool]]:
    """RTP payloads of a picture (RFC 6184), with the mark of the last one."""
    found: list[bytes] = []
    for unit in units:
        if len(unit) <= _MOST_PAYLOAD:
            found.append(unit)
            continue
        pieces = [unit[i : i + _MOST_PAYLOAD] for i in range(1, len(unit), _MOST_PAYLOAD)]
        for n, piece in enumerate(pieces):
            start, end = n == 0, n == len(pieces) - 1
            fragment = bytes((unit[0] & 0xE0 | 28, start << 7 | end << 6 | unit[0] & 0x1F))
            found.append(fragment + piece)
    return [(payload, n == len(found) - 1) for n, payload in enumerate(found)]


def _rtsp_answer(method: str, sequence: str, first: list[bytes], encoding: str) -> bytes:
    head = f"RTSP/1.0 200 OK\r\nCSeq: {sequence}\r\n"
    if method == "OPTIONS":
        return f"{head}Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN\r\n\r\n".encode()
    if method == "DESCRIBE":
        sets = ",".join(base64.b64encode(unit).decode() for unit in first if unit[0] & 31 in (7, 8))
        body = (
            "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=camera\r\nt=0 0\r\n"
            f"m=video 0 RTP/AVP 96\r\na=rtpmap:96 {encoding}/90000\r\n"
            f"a=fmtp:96 packetization-mode=1;sprop-parameter-sets={sets}\r\na=control:track1\r\n"
        )
        return (
            f"{head}Content-Type: application/sdp\r\nContent-Length: {len(body)}\r\n\r\n{body}"
        ).encode()
    if method == "SETUP":
        return (
            f"{head}Transport: RTP/AVP/TCP;unicast;interleaved=0-1\r\nSession: 1\r\n\r\n".encode()
        )
    return f"{head}Session: 1\r\n\r\n".encode()
