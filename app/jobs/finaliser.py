"""The process that makes an ended recording fit for review: whole, and playable if it can be.

Browsers play H.264 in MP4, so the packets are put into one as they are, at the same times.  If that
cannot be, for its codec or for want of room, the recording itself is the video.
"""

from __future__ import annotations

import os
from dataclasses import asdict
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec

from app.jobs import one_request
from app.jobs.messages import Finalised, FinaliseRequest, Probed, encode

_PLAYED_IN_MP4 = "h264"


def _finalise(request: FinaliseRequest, connection: Connection) -> None:
    from app.jobs.recording import Recording
    from vo_core.sources import VideoFile

    path = Path(request.recording)
    with Recording.reopen(path) as recording:  # cuts off half a packet that a crash has left
        recording.finish()
        frames, codec = recording.packets, recording.coding.codec
    video_path = path
    if request.target is not None and codec == _PLAYED_IN_MP4:
        target = Path(request.target)
        video_path = target if _remuxed(path, target) else path
    with VideoFile(video_path) as video:
        next(iter(video))  # raises unless there is a picture to be had
        probed = Probed(**asdict(video.info))
    connection.send_bytes(encode(Finalised(msgspec.structs.replace(probed, frames=frames))))


def _remuxed(path: Path, target: Path) -> bool:
    """Whether the packets of `path` are now in the MP4 file `target`, each at its time."""
    target.unlink(missing_ok=True)
    try:
        _remux(path, target)
        is_same = _times_ms(path) == _times_ms(target)
    except (OSError, ValueError):  # the disk is full, or the packets are not such as MP4 takes
        is_same = False
    if not is_same:
        target.unlink(missing_ok=True)
    return is_same


def _remux(path: Path, target: Path) -> None:
    import av

    from vo_core.sources import checked_stream

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
    """Presentation times of all packets."""
    import av

    with av.open(str(path), container_options={"protocol_whitelist": "file"}) as container:
        stream = container.streams.video[0]
        return [
            round(1000 * packet.pts * packet.time_base)
            for packet in container.demux(stream)
            if packet.size and packet.pts is not None and packet.time_base is not None
        ]


if __name__ == "__main__":
    one_request.serve(FinaliseRequest, _finalise)
