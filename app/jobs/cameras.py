"""Opens a live source within limits, and explains in words why it delivers no picture."""

from __future__ import annotations

import os
import select
import socket
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import av
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
from av.video.stream import VideoStream

from app.jobs.messages import CameraInput
from app.jobs.recording import CODECS
from vo_core.errors import UnreadableVideo
from vo_core.sources import checked_stream

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
_FORMATS = {"rtsp": "rtsp", "mjpeg": "mpjpeg", "usb": "v4l2"}
_QUICK = {"fpsprobesize": "0", "analyzeduration": "1", "probesize": "32"}
"""By default FFmpeg reads for seconds to guess a frame rate that is not used."""
_THOROUGH = {"fpsprobesize": "0", "analyzeduration": "2000000", "probesize": "5000000"}
_NAME = "The camera's video"


class CameraFault(Exception):
    """A sentence that says why there is no picture; another try may help."""


class WrongPictures(CameraFault):
    """The source delivers unusable pictures; `code` is that of the API."""

    def __init__(self, code: str, detail: str) -> None:
        super().__init__(detail)
        self.code = code


@contextmanager
def opened(camera: CameraInput) -> Iterator[tuple[InputContainer, VideoStream]]:
    """Open the source and return it with its video stream.

    Raises:
        CameraFault: The source cannot be opened.
        WrongPictures: It has no video of a supported codec and size.
    """
    with _place(camera) as (location, options):
        options = {**camera.options, **options}
        with _container(camera, location, options) as container:
            try:
                stream = checked_stream(container, _NAME)
            except UnreadableVideo as error:
                raise WrongPictures("unreadable_video", str(error)) from error
            if stream.codec_context.name not in CODECS:
                raise WrongPictures(
                    "unreadable_video",
                    f"{_NAME} is coded as {stream.codec_context.name}, which is not recorded.",
                )
            yield container, stream


def _container(camera: CameraInput, location: str, options: dict[str, str]) -> InputContainer:
    """Open the source, reading ahead just enough to know the picture size."""
    probes = [_THOROUGH] if camera.kind in ("file", "pipe") else [_QUICK, _THOROUGH]
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
    return any(stream.codec_context.width for stream in container.streams.video)


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
            return "It does not answer in time."
        case PermissionError():
            return "It may not be opened, or it redirects to an address that may not."
        case EndOfStream():
            return "It ended the connection."
        case FileNotFoundError():
            return "It is not there."
        case InvalidDataError():
            return "What it sends is not a video that can be read, or it has stopped sending."
    return f"It cannot be read ({error.strerror})."
