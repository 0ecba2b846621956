"""Frames of a video file by their presentation time."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from vo_core.errors import UnreadableVideo
from vo_core.sources import Frame, VideoFile

_SEEK_BACK_S = (0.0, 1.0, 4.0, 16.0, math.inf)
"""Seconds to seek before the frame, one after the other: without an index (MPEG-TS) a seek may end
after it."""

_ROUNDING_S = 1e-5
"""Tolerance of times, which come from track files with six decimals."""


def read_frame(path: Path | str, t_s: float, *, may_begin_anew: bool = False) -> Frame:
    """Read the frame shown at presentation time `t_s`; its number counts from the place of a seek.

    Args:
        path: The file.
        t_s: The time of a frame of the whole film, see `VideoFile`.
        may_begin_anew: Whether time stamps of the film may begin anew, also after the frame. Where
            they do, seeking by them leads to another part, so the packets show the place.
    Raises:
        UnreadableVideo: The file cannot be opened, or ends before that time.
    """
    with VideoFile(path) as video:
        seek = video.seek_part if may_begin_anew else video.seek
        for back_s in _SEEK_BACK_S:
            seek(max(t_s - back_s, 0.0))
            if (frame := _from_here(video, t_s)) is not None:
                return frame
    raise UnreadableVideo(f"The video has no frame at {t_s:.3f} s.")


def frames_between(
    path: Path | str, start_s: float, end_s: float, *, may_begin_anew: bool = False
) -> Iterator[Frame]:
    """Yield the frames shown from `start_s` to `end_s` in order; none if there are none.

    Their numbers count from the place of the seek; see `read_frame` for `may_begin_anew`.

    Raises:
        UnreadableVideo: The file cannot be opened.
    """
    with VideoFile(path) as video:
        seek = video.seek_part if may_begin_anew else video.seek
        for back_s in _SEEK_BACK_S:
            seek(max(start_s - back_s, 0.0))
            frames = _decodable(video)
            first = next(frames, None)
            is_late = first is not None and first.t_s > start_s + _ROUNDING_S
            if first is None or (is_late and back_s < math.inf):
                continue
            for frame in itertools.chain((first,), frames):
                if frame.t_s > end_s + _ROUNDING_S:
                    return
                if frame.t_s >= start_s - _ROUNDING_S:
                    yield frame
            return


def spread_frames(path: Path | str, count: int, *, may_begin_anew: bool = False) -> Iterator[Frame]:
    """Yield at most `count` frames that are spread over a film, for a look at it.

    They are key frames where these are near enough, so that little is decoded. Of a film whose
    duration is not stated only the first frame is known to be there.

    Raises:
        UnreadableVideo: The file cannot be opened, or no picture can be decoded.
    """
    with VideoFile(path) as video:
        first = next(iter(video))
        yield first
        seek = video.seek_part if may_begin_anew else video.seek
        last_s, duration_s = first.t_s, video.info.duration_s or 0.0
        for place_s in (duration_s * (n + 0.5) / count for n in range(1, count)):
            seek(place_s)
            near_s = place_s - duration_s / count / 2
            for frame in _decodable(video):
                if frame.t_s >= max(near_s, last_s + _ROUNDING_S):
                    yield frame
                    last_s = frame.t_s
                    break


def _decodable(video: VideoFile) -> Iterator[Frame]:
    """Yield frames from the current position on; none where none can be decoded, though perhaps
    from an earlier position.
    """
    with suppress(UnreadableVideo):
        yield from video


def _from_here(video: VideoFile, t_s: float) -> Frame | None:
    """Read on to the first frame at or after `t_s`; None if the source is already after it."""
    is_first = True
    for frame in _decodable(video):
        if is_first and frame.t_s > t_s + _ROUNDING_S:
            return None
        if frame.t_s >= t_s - _ROUNDING_S:
            return frame
        is_first = False
    return None
