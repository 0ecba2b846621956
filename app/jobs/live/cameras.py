"""Opens a live source within limits, and explains in words why it delivers no picture."""

from __future__ import annotations

import os
import select
import socket
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import cast

import av
from av.codec.context import CodecContext
from av.container import InputContainer
from av.error import (
    EOFError as EndOfStream,
)
from av.error import (
    ExitError,
    FFmpegError,
    HTTPClientError,
    HTTPForbiddenError,
    HTTPNotFoundError,
    HTTPUnauthorizedError,
    InvalidDataError,
)
from av.packet import Packet
from av.video.codeccontext import VideoCodecContext
from av.video.stream import VideoStream

from app.jobs.live.jpegs import JpegReader
from app.jobs.live.messages import CameraInput
from app.jobs.live.recording import CODECS
from vo_core.containers import MAX_PIXELS, checked_stream
from vo_core.errors import UnreadableVideo

QUIET_S = 3.0
"""A file that has not grown, or a pipe that has been silent, for this long has ended."""
_TIMEOUTS_S = {
    "rtsp": (5.0, 2.0),
    "mjpeg": (5.0, 2.0),
    "usb": (5.0, 2.0),
    "file": (2.0, QUIET_S),
    "pipe": (QUIET_S, QUIET_S),
}
"""Timeouts to open and to read. A file that is not growing is opened with its present content."""
_FORMATS = {"rtsp": "rtsp", "mjpeg": "data", "usb": "v4l2"}
"""FFmpeg's demuxer of MJPEG over HTTP accepts few of the forms in which cameras send it, so the
pictures are found here."""
_QUICK = {"fpsprobesize": "0", "analyzeduration": "1", "probesize": "32"}
"""By default FFmpeg reads for seconds to guess a frame rate that is not used."""
_THOROUGH = {"fpsprobesize": "0", "analyzeduration": "2000000", "probesize": "5000000"}
_PIECES = _QUICK | {"raw_packet_size": str(2**16)}
"""What has come of an MJPEG stream is read without waiting, at most so many bytes at once."""
_PROBES = {"file": [_THOROUGH], "pipe": [_THOROUGH], "mjpeg": [_PIECES]}
_LARGEST_PICTURE = 3 * MAX_PIXELS
"""Most bytes of a JPEG picture: those of the largest one uncoded."""
_MOST_DAMAGED = 10
"""Most damaged pictures before the first whole one."""
_NAME = "The camera's video"
_LATE = "It does not answer in time."
_NO_PICTURES = (
    "It sends no JPEG pictures, and over HTTP only an MJPEG stream is read. "
    "Give the address of that, not of a web page, or the camera's rtsp:// address."
)
_SNAPSHOT = (
    "It sends a single picture and ends the connection: this is the address of a snapshot. "
    "Give that of its MJPEG stream."
)


class CameraFault(Exception):
    """A sentence that says why there is no picture; another try may help."""


class NoPictures(CameraFault):
    """No other try will help; `code` is that of the API."""

    def __init__(self, code: str, detail: str) -> None:
        super().__init__(detail)
        self.code = code


class WrongPictures(NoPictures):
    """The source delivers unusable pictures."""


@dataclass(frozen=True)
class Opened:
    """A source that delivers."""

    codec: VideoCodecContext
    """How its pictures are coded, and their size."""
    packets: Iterator[Packet[VideoStream]]
    stream: VideoStream | None
    """The stream of the packets; None for pictures that were found between other bytes."""


@contextmanager
def opened(camera: CameraInput) -> Iterator[Opened]:
    """Open the source.

    Raises:
        CameraFault: The source cannot be opened.
        WrongPictures: It has no video of a supported codec and size.
    """
    with _place(camera) as (location, options):
        options = {**camera.options, **options}
        with _container(camera, location, options) as container:
            if camera.kind == "mjpeg":
                yield _opened_pictures(container)
                return
            if not _says_its_size(container):
                raise CameraFault("It is connected, but has sent no whole picture in time.")
            try:
                stream = checked_stream(container, _NAME)
            except UnreadableVideo as error:
                raise WrongPictures("unreadable_video", str(error)) from error
            codec = stream.codec_context
            if codec.name not in CODECS:
                raise WrongPictures(
                    "unreadable_video", f"{_NAME} is coded as {codec.name}, which is not recorded."
                )
            yield Opened(codec, container.demux(stream), stream)


def _opened_pictures(container: InputContainer) -> Opened:
    """Begin with the first picture that is whole: a camera may begin within one."""
    packets = _pictures(container)
    codec = CodecContext.create("mjpeg", "r")
    assert isinstance(codec, VideoCodecContext)  # noqa: S101  (MJPEG is video)
    codec.options = {"max_pixels": str(MAX_PIXELS)}
    codec.thread_count = 1
    with plain_errors():
        for packet in islice(packets, _MOST_DAMAGED):
            with suppress(InvalidDataError):
                codec.decode(packet)
                return Opened(codec, chain([packet], packets), None)
    raise CameraFault(f"Its pictures are damaged, or have more than {MAX_PIXELS} px.")


def _pictures(container: InputContainer) -> Iterator[Packet[VideoStream]]:
    """Yield the JPEG pictures of an MJPEG stream, or raise CameraFault if they are none."""
    reader, limit_s = JpegReader(), _TIMEOUTS_S["mjpeg"][1]
    came_s, count = time.monotonic(), 0
    for piece in container.demux():
        for picture in reader.feed(bytes(piece)):
            packet = cast("Packet[VideoStream]", Packet(picture))
            packet.is_keyframe = True
            yield packet
            came_s, count = time.monotonic(), count + 1
        is_endless = reader.held_bytes > _LARGEST_PICTURE
        if is_endless or time.monotonic() - came_s > limit_s:
            raise CameraFault(_LATE if count else _NO_PICTURES)
    if count < 2:
        raise CameraFault(_SNAPSHOT if count else _NO_PICTURES)


def _container(camera: CameraInput, location: str, options: dict[str, str]) -> InputContainer:
    """Open the source, reading ahead just enough to know the picture size."""
    probes = _PROBES.get(camera.kind, [_QUICK, _THOROUGH])
    for probe in probes:
        with plain_errors():
            container = av.open(
                location,
                format=_FORMATS.get(camera.kind),
                timeout=_TIMEOUTS_S[camera.kind],
                container_options={**options, **probe},
            )
        try:
            if camera.peer is not None:
                _require_peer(camera.peer)
        except BaseException:
            container.close()
            raise
        if probe is probes[-1] or _says_its_size(container):
            break
        container.close()
    return container


def _says_its_size(container: InputContainer) -> bool:
    """Return whether the picture size is known, or never will be."""
    # PyAV gives a stream without a decoder for codecs that FFmpeg does not know.
    codecs = [stream.codec_context for stream in container.streams.video]
    return not codecs or any(codec is None or codec.width for codec in codecs)


@contextmanager
def plain_errors() -> Iterator[None]:
    """Turn FFmpeg's errors, which may contain the address with its password, into sentences."""
    try:
        yield
    except FFmpegError as error:
        raise CameraFault(_reason(error)) from None


@contextmanager
def _place(camera: CameraInput) -> Iterator[tuple[str, dict[str, str]]]:
    if camera.kind != "pipe":
        yield camera.location, {}
        return
    # Opened for writing too, so that opening does not wait for a writer and the end of one writer
    # is not taken for the end; non-blocking, so that reading can be given up.
    try:
        pipe = os.open(camera.location, os.O_RDWR | os.O_NONBLOCK | os.O_NOFOLLOW)
    except OSError as error:
        raise CameraFault("The pipe cannot be opened.") from error
    try:
        if not stat.S_ISFIFO(os.fstat(pipe).st_mode):
            raise CameraFault("It is not a pipe any more.")
        if not select.select([pipe], [], [], QUIET_S)[0]:
            raise CameraFault("Nothing is written into the pipe.")
        yield "fd:", {"fd": str(pipe)}
    finally:
        os.close(pipe)


def _require_peer(address: str) -> None:
    """Check that every connection leads to the camera: FFmpeg follows redirections of RTSP servers.

    Raises:
        CameraFault: A connection leads elsewhere.
    """
    for name in Path("/proc/self/fd").iterdir():
        number = int(name.name)
        with suppress(OSError):  # it was that of the listing itself, or is not connected
            # Checked before it is duplicated: a duplicate that is no socket would stay open.
            if not stat.S_ISSOCK(os.fstat(number).st_mode):
                continue
            with socket.socket(fileno=os.dup(number)) as connection:
                if connection.family in (socket.AF_INET, socket.AF_INET6):
                    peer = connection.getpeername()[0]
                    if peer != address:
                        raise CameraFault("It redirects to another address, which is refused.")


def _reason(error: FFmpegError) -> str:
    match error:
        case HTTPUnauthorizedError() | HTTPForbiddenError():
            return "It refuses the user name or the password."
        case HTTPNotFoundError():
            return "It has nothing at this address."
        case HTTPClientError():
            return "It refuses the request."
        case ConnectionRefusedError():
            return "It refuses the connection."
        case ExitError() | TimeoutError():
            return _LATE
        case PermissionError():
            return "It may not be opened, or it redirects to an address that may not."
        case EndOfStream():
            return "It ended the connection."
        case FileNotFoundError():
            return "It is not there."
        case InvalidDataError():
            return "What it sends is not a video that can be read, or it has stopped sending."
    return f"It cannot be read ({error.strerror})."
