"""The process that cuts a few seconds out of a film, as an MP4 that every browser plays, then ends.

Frames are chosen by their presentation time and keep it, so that the clip is as slow or as uneven
as the film. It is coded anew: a copy of the packets could begin at key frames only.
"""

from __future__ import annotations

import io
import itertools
from fractions import Fraction

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.messages import Limits

MOST_PX = 1280
"""Longest side of the picture: a clip is for looking at, and is sent by mail."""
MOST_FRAMES = 1200
_TICK_S = Fraction(1, 90_000)
_OPTIONS = {"preset": "veryfast", "crf": "21"}


class ClipRequest(msgspec.Struct, frozen=True):
    """Cut this clip; the answer is an MP4 file."""

    video: str
    start_s: float
    """Presentation time of the first frame, or of one shortly before it."""
    end_s: float
    """Presentation time that no frame of the clip exceeds."""
    limits: Limits
    may_begin_anew: bool = False
    """Whether time stamps of the film may begin anew."""


def _cut(request: ClipRequest, _parent: Parent) -> bytes:
    # Imported here so that the decoders are loaded under the limits.
    import av

    from vo_core.errors import UnreadableVideo
    from vo_core.frames_at import frames_between

    out = io.BytesIO()
    with av.open(out, "w", format="mp4") as container:
        stream = None
        first_s = 0.0
        frames = frames_between(
            request.video,
            request.start_s,
            request.end_s,
            may_begin_anew=request.may_begin_anew,
        )
        for frame in itertools.islice(frames, MOST_FRAMES):
            shown = frame.to_square_bgr()
            height, width = shown.shape[:2]
            scale = min(1.0, MOST_PX / max(width, height))
            size_wh = _even(width * scale), _even(height * scale)
            if stream is None:
                first_s = frame.t_s
                stream = container.add_stream("libx264", options=_OPTIONS)
                stream.width, stream.height = size_wh
                stream.pix_fmt = "yuv420p"
                stream.thread_count = 1
                stream.codec_context.time_base = _TICK_S
            picture = av.VideoFrame.from_ndarray(shown, format="bgr24")
            coded = picture.reformat(*size_wh, format="yuv420p")
            coded.pts = round((frame.t_s - first_s) / _TICK_S)
            coded.time_base = _TICK_S
            container.mux(stream.encode(coded))
        if stream is None:
            raise UnreadableVideo(f"The film has no frame at {request.start_s:.2f} s.")
        container.mux(stream.encode())
    return out.getvalue()


def _even(px: float) -> int:
    """Return the nearest even number: H.264 halves the colours in both directions."""
    return max(2, 2 * round(px / 2))


if __name__ == "__main__":
    serve(ClipRequest, _cut, named="Cutting the clip", reads=lambda request: [request.video])
