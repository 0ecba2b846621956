"""The camera process: captures, records and tracks one live source until it must stop.

It writes only the recording and its marks.
"""

from __future__ import annotations

import time
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import msgspec

from app.jobs import limits
from app.jobs.confinement import confine
from app.jobs.failures import failure_of
from app.jobs.messages import (
    CameraState,
    Done,
    Failed,
    LiveRequest,
    StopCapture,
    ToCamera,
    encode,
)
from app.jobs.process import connection_from_arguments
from app.jobs.track import parts

if TYPE_CHECKING:
    from app.jobs.live.capture import Capture
    from app.jobs.track.follow import Follower
    from app.jobs.track.parts import Mark

PREVIEW_WIDTH_PX = 640
"""Every frame of a camera is shown; encoding a small picture takes half a millisecond."""
_WAIT_S = 0.1
_STATE_S = 0.5
_ROUNDING_S = 5e-4
"""Rounding of times in recordings, which count milliseconds."""


def main() -> None:
    """Handle the one request on the pipe, then end."""
    with connection_from_arguments() as connection:
        request = _Commands(connection).next()
        assert isinstance(request, LiveRequest)  # noqa: S101  (the parent's first message)
        limits.apply(request.limits)
        _confine(request)
        serve(request, connection)


def serve(request: LiveRequest, connection: Connection) -> None:
    """Capture, record and track until the parent, or the source, ends it."""
    try:
        _run(request, connection)
    except (ConnectionError, EOFError):
        return  # the server has gone; it will find the closed recording when it is back
    except Exception as error:
        connection.send_bytes(encode(failure_of(error, "Tracking")))


def _confine(request: LiveRequest) -> None:
    """Confine the process to the recording and the camera's device, file, pipe or port."""
    camera, port = request.camera, None
    writes = [str(Path(request.recording).parent)]
    if camera.peer is not None:
        port = urlsplit(camera.location).port
    elif camera.kind != "file":  # opened for writing, though nothing is written
        writes.append(camera.location)
    confine(reads=[camera.location.removeprefix("file:")], writes=writes, port=port)


class _Commands:
    """Commands of the parent."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._decoder: msgspec.msgpack.Decoder[ToCamera] = msgspec.msgpack.Decoder(ToCamera)

    def next(self) -> ToCamera:
        """Wait for the next command."""
        return self._decoder.decode(self._connection.recv_bytes())

    def is_to_stop(self) -> bool:
        """Return whether the parent has sent a stop."""
        return self._connection.poll() and isinstance(self.next(), StopCapture)


def _run(request: LiveRequest, connection: Connection) -> None:
    # Imported here so that the decoders are loaded under the limits.
    from app.jobs.live.capture import Capture
    from app.jobs.live.film import Film
    from app.jobs.track.follow import Follower
    from vo_core import Rig

    rig = Rig.parse(request.rig)
    path, marks_path = Path(request.recording), Path(request.marks_file)
    kept = parts.read(marks_path)
    pending = [mark for mark in request.left_out if mark not in kept]
    follower = Follower(
        rig, start=request.last, between=request.between, preview_width_px=PREVIEW_WIDTH_PX
    )
    film = Film(path, marks_path, pending, request.reserve_bytes)
    capture = Capture(
        request.camera,
        (rig.camera.width, rig.camera.height),
        film,
        first_index=_catch_up(follower, request, [*kept, *pending], connection),
        zero_s=request.zero_s,
    )
    capture.start()
    try:
        _follow(capture, follower, connection)
    finally:
        capture.stop()
        capture.waiting.close()
        capture.join()
    end = Failed(*capture.failure) if capture.failure else Done(capture.problem)
    connection.send_bytes(encode(end))


def _catch_up(
    follower: Follower, request: LiveRequest, marks: list[Mark], connection: Connection
) -> int:
    """Track frames that an earlier process recorded but whose rows were lost.

    The track continues from the last known frame, which is processed again, unless a new part
    begins after it or it is not recorded.

    Returns:
        Number of the first frame that is not recorded yet.
    """
    from vo_core.errors import UnreadableVideo
    from vo_core.sources import VideoFile

    path, last = Path(request.recording), request.last
    is_seen_again = last is not None and not (
        request.between or any(mark.frame == last.frame for mark in marks)
    )
    index = 0 if last is None else last.frame + (not is_seen_again)
    if not path.exists():
        return index
    from_s = 0.0 if last is None else last.time_s + (-_ROUNDING_S if is_seen_again else _ROUNDING_S)
    with suppress(UnreadableVideo), VideoFile(path) as video:
        video.seek(max(from_s, 0.0))
        frames = (frame for frame in video if frame.t_s >= from_s)
        for found in parts.numbered(frames, marks, index):
            follower.add(found.frame, found.left_out)
            batch = follower.batch()
            assert batch is not None  # noqa: S101  (there is a frame)
            if is_seen_again and found.frame.index == index:  # its row is known
                batch = msgspec.structs.replace(batch, rows=[], health=[])
            connection.send_bytes(encode(batch))
            index, is_seen_again = found.frame.index + 1, False
    return index


def _follow(capture: Capture, follower: Follower, connection: Connection) -> None:
    commands = _Commands(connection)
    sent: CameraState | None = None
    sent_s = 0.0
    while not capture.waiting.is_over:
        captured = capture.waiting.take(_WAIT_S)
        state = _state(capture)  # before the picture, which shows that the camera is there
        if time.monotonic() - sent_s >= _STATE_S or _has_news(state, sent):
            connection.send_bytes(encode(state))
            sent, sent_s = state, time.monotonic()
        if captured is not None:
            follower.add(captured.frame, captured.skipped)
            batch = follower.batch()
            assert batch is not None  # noqa: S101  (there is a frame)
            connection.send_bytes(
                encode(msgspec.structs.replace(batch, captured_s=captured.captured_s))
            )
        if commands.is_to_stop():
            capture.stop()
    follower.finish()
    rest = follower.batch()
    if rest is not None:
        connection.send_bytes(encode(rest))


def _state(capture: Capture) -> CameraState:
    return CameraState(
        capture.is_connected,
        capture.reconnects,
        capture.waiting.dropped,
        capture.recorded_s,
        capture.zero_s,
        capture.detail,
        not capture.film.is_full,
        capture.film.news(),
    )


def _has_news(state: CameraState, sent: CameraState | None) -> bool:
    if sent is None or state.left_out:
        return True
    return (state.connected, state.detail, state.is_recording) != (
        sent.connected,
        sent.detail,
        sent.is_recording,
    )


if __name__ == "__main__":
    main()
