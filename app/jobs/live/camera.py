"""The camera process: captures, records and tracks one live source until it must stop.

It writes only the recording and its marks.
"""

from __future__ import annotations

import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.live.load import Load
from app.jobs.live.messages import CameraInput, CameraState, CameraStatus, LiveRequest, shown
from app.jobs.messages import Problem
from app.jobs.track import parts

if TYPE_CHECKING:
    from app.jobs.live.capture import Capture
    from app.jobs.track.batches import Batch
    from app.jobs.track.follow import Follower
    from app.jobs.track.parts import Mark
    from vo_core import Estimate

PREVIEW_WIDTH_PX = 640
"""Every frame of a camera is shown; encoding a small picture takes half a millisecond."""
_WAIT_S = 0.1
_STATE_S = 0.5
_SPARE_PICTURE_S = 0.2
"""Time between two pictures on a machine that leaves pictures out."""
_ROUNDING_S = 5e-4
"""Rounding of times in recordings, which count milliseconds."""


def place_of(camera: CameraInput) -> str:
    """Return the file or pipe of a camera."""
    return camera.location.removeprefix("file:")


def _changed_places(request: LiveRequest) -> list[str]:
    """Return the folder of the recording, and a device or pipe, which is opened for writing though
    nothing is written.
    """
    camera, folder = request.camera, str(Path(request.recording).parent)
    is_file_or_far = camera.peer is not None or camera.kind == "file"
    return [folder] if is_file_or_far else [folder, camera.location]


def port_of(camera: CameraInput) -> int | None:
    """Return the port of a camera in the network."""
    return None if camera.peer is None else urlsplit(camera.location).port


def record(request: LiveRequest, parent: Parent) -> Problem:
    """Capture, record and track until the parent, or the source, ends it."""
    # Imported here so that the decoders are loaded under the limits.
    from app.jobs.live.capture import Capture
    from app.jobs.live.film import Film
    from app.jobs.track.follow import Follower
    from vo_core import Estimate, Rig

    rig = Rig.parse(request.rig)
    last = None if request.last is None else Estimate(**request.last)
    path, marks_path = Path(request.recording), Path(request.marks_file)
    kept = parts.read(marks_path)
    pending = [mark for mark in request.left_out if mark not in kept]
    film = Film(path, marks_path, pending, request.reserve_bytes)
    with Follower(
        rig, start=last, between=request.between, preview_width_px=PREVIEW_WIDTH_PX
    ) as follower:
        capture = Capture(
            request.camera,
            (rig.camera.width, rig.camera.height),
            film,
            first_index=_catch_up(follower, request, last, [*kept, *pending], parent),
            zero_s=request.zero_s,
        )
        capture.start()
        try:
            _follow(capture, follower, parent)
        finally:
            capture.stop()
            capture.waiting.close()
            capture.join()
    if capture.failure is not None:
        raise capture.failure
    return Problem(capture.problem)


def _catch_up(
    follower: Follower,
    request: LiveRequest,
    last: Estimate | None,
    marks: list[Mark],
    parent: Parent,
) -> int:
    """Track frames that an earlier process recorded but whose rows were lost.

    The track continues from the last known frame, which is processed again, unless a new part
    begins after it or it is not recorded.

    Returns:
        Number of the first frame that is not recorded yet.
    """
    from vo_core.errors import UnreadableVideo
    from vo_core.sources import VideoFile

    path = Path(request.recording)
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
            is_known = is_seen_again and found.frame.index == index
            follower.hand_on(partial(_send_without_row, parent) if is_known else parent.send)
            index, is_seen_again = found.frame.index + 1, False
    return index


def _follow(capture: Capture, follower: Follower, parent: Parent) -> None:
    from app.jobs.track.batches import Batch

    sent: CameraState | None = None
    sent_s = 0.0
    load = Load()
    while not capture.waiting.is_over:
        captured = capture.waiting.take(_WAIT_S)
        load.note(capture.captured, capture.waiting.dropped, time.monotonic())
        follower.spare(
            paints_wall="wall" not in load.shed,
            picture_every_s=_SPARE_PICTURE_S if "pictures" in load.shed else 0.0,
        )
        state = _state(capture, load)  # before the picture, which shows that the camera is there
        if time.monotonic() - sent_s >= _STATE_S or _has_news(state, sent):
            parent.send(state)
            sent, sent_s = state, time.monotonic()
        if captured is not None:
            follower.add(captured.frame, captured.skipped)
            follower.hand_on(partial(_send_captured, parent, captured.captured_s))
        if parent.asks_to_stop():
            capture.stop()
    follower.finish()
    follower.hand_on(parent.send)
    for batch in parent.wait_for(follower.smoothed, Batch([])):
        parent.send(batch)


def _send_without_row(parent: Parent, batch: Batch) -> None:
    """Send the results of a frame whose row is known."""
    parent.send(msgspec.structs.replace(batch, estimates=[], health=[]))


def _send_captured(parent: Parent, captured_s: float, batch: Batch) -> None:
    parent.send(msgspec.structs.replace(batch, captured_s=captured_s))


def _state(capture: Capture, load: Load) -> CameraState:
    status = CameraStatus(
        capture.is_connected,
        capture.reconnects,
        capture.waiting.dropped,
        capture.recorded_s,
        capture.detail,
        not capture.film.is_full,
        load.skipped_share,
        load.shed,
    )
    return CameraState(status, capture.zero_s, capture.film.news())


def _has_news(state: CameraState, sent: CameraState | None) -> bool:
    if sent is None or state.left_out:
        return True
    return shown(state.status) != shown(sent.status)


if __name__ == "__main__":
    serve(
        LiveRequest,
        record,
        named="Tracking",
        reads=lambda request: [place_of(request.camera)],
        writes=_changed_places,
        port=lambda request: port_of(request.camera),
    )
