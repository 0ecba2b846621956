"""The process that turns a finished film back into a recording, so that a camera can continue it.

The packets are converted back to the form that `recording` appends to, each at its time.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.messages import Limits


class ReopenRequest(msgspec.Struct, frozen=True):
    """Make a recording of a film; the answer is None."""

    video: str
    recording: str
    """File to make; an existing one is replaced."""
    limits: Limits


def _reopen(request: ReopenRequest, _parent: Parent) -> None:
    import av

    from app.jobs.live.recording import Coding, Recording
    from vo_core.containers import checked_stream

    target = Path(request.recording)
    target.unlink(missing_ok=True)  # left by an attempt that failed
    with av.open(request.video, container_options={"protocol_whitelist": "file"}) as source:
        stream = checked_stream(source, Path(request.video).name)
        codec = stream.codec_context
        coding = Coding(codec.name, codec.width, codec.height, bytes(codec.extradata or b""))
        with Recording(target, coding) as recording:
            for packet in source.demux(stream):
                if packet.size and packet.pts is not None and packet.time_base is not None:
                    time_ms = round(1000 * packet.pts * packet.time_base)
                    recording.append(time_ms, packet.is_keyframe, bytes(packet))
            recording.finish()


if __name__ == "__main__":
    serve(
        ReopenRequest,
        _reopen,
        named="Going on with the recording",
        reads=lambda request: [request.video],
        writes=lambda request: [str(Path(request.recording).parent)],
    )
