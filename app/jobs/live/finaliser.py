"""The process that finalises an ended recording for review: complete, and playable if possible.

Browsers play H.264 in MP4, so the packets are copied unchanged into an MP4, at the same times. If
the codec or a lack of room prevents that, the recording itself is the video.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.messages import Limits

if TYPE_CHECKING:  # loaded under the limits
    from vo_core.video_info import VideoInfo

_PLAYED_IN_MP4 = "h264"


class FinaliseRequest(msgspec.Struct, frozen=True):
    """Finalise a recording; the answer is the `VideoInfo` of the film.

    The film is `target` if its container is MP4, else the recording.
    """

    recording: str
    target: str | None
    """MP4 file to write if the recording can be played in MP4; None if there is no room."""
    limits: Limits


def _finalise(request: FinaliseRequest, _parent: Parent) -> VideoInfo:
    from app.jobs.live.recording import Recording
    from vo_core.sources import VideoFile

    path = Path(request.recording)
    with Recording.reopen(path) as recording:  # cuts off a packet that a crash left incomplete
        recording.finish()
        frames, codec = recording.packets, recording.coding.codec
    video_path = path
    if request.target is not None and codec == _PLAYED_IN_MP4:
        target = Path(request.target)
        video_path = target if _remuxed(path, target) else path
    with VideoFile(video_path) as video:
        next(iter(video))  # raises unless a picture can be decoded
        return replace(video.info, frames=frames)


def _remuxed(path: Path, target: Path) -> bool:
    """Copy the packets of `path` to the MP4 file `target`; return whether each has its time
    there.
    """
    target.unlink(missing_ok=True)
    try:
        _remux(path, target)
        is_same = _times_ms(path) == _times_ms(target)
    except (OSError, ValueError):  # the disk is full, or MP4 does not take these packets
        is_same = False
    if not is_same:
        target.unlink(missing_ok=True)
    return is_same


def _remux(path: Path, target: Path) -> None:
    import av

    from vo_core.containers import checked_stream

    with (
        av.open(str(path), container_options={"protocol_whitelist": "file"}) as source,
        av.open(str(target), "w", options={"movflags": "faststart"}) as sink,
    ):
        stream = checked_stream(source, path.name)
        copy = sink.add_stream_from_template(stream)
        copy.codec_context.codec_tag = "avc1"
        for packet in source.demux(stream):
            if packet.size:
                packet.stream = copy
                sink.mux(packet)
    with target.open("rb+") as file:
        os.fsync(file.fileno())


def _times_ms(path: Path) -> list[int]:
    """Return the presentation times of all packets."""
    import av

    with av.open(str(path), container_options={"protocol_whitelist": "file"}) as container:
        stream = container.streams.video[0]
        return [
            round(1000 * packet.pts * packet.time_base)
            for packet in container.demux(stream)
            if packet.size and packet.pts is not None and packet.time_base is not None
        ]


if __name__ == "__main__":
    serve(
        FinaliseRequest,
        _finalise,
        named="Finalising the recording",
        writes=lambda request: [str(Path(request.recording).parent)],
    )
