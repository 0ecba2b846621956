"""The media process: probes video files and extracts single pictures."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import msgspec

from app.jobs.child import answer, connection_to_parent
from app.jobs.confinement import confine, set_limits
from app.jobs.messages import Limits

if TYPE_CHECKING:  # loaded under the limits
    from vo_core.image.axis import Axis
    from vo_core.image.sure_axis import SureAxis
    from vo_core.sources import Frame
    from vo_core.types import ByteImage
    from vo_core.video_info import VideoInfo


_LOOKED_AT = (12, 36)
"""Number of pictures, spread over a film, in which the axis is searched, and where it is certain in
none of them."""


_SHOWN_PX, _MOST_ENLARGED = 800, 4.0
"""Longest side of a piece of the wall, and the largest factor by which it is enlarged."""
_AROUND_LINE_PX = 31
_NO_WALL = 44
_CUT_JPEG_QUALITY = 85


class ProbeRequest(msgspec.Struct, frozen=True, tag="probe"):
    """Answer with the `VideoInfo` of this file, whose first picture can be decoded."""

    video: str


class PictureRequest(msgspec.Struct, frozen=True, tag="picture"):
    """Answer with the frame shown at this time, as JPEG."""

    video: str
    t_s: float | None
    """None: the first one."""
    jpeg_quality: int
    may_begin_anew: bool = False
    """Whether time stamps of the film may begin anew."""


class ReduceRequest(msgspec.Struct, frozen=True, tag="reduce"):
    """Answer with a JPEG of this width, or as it is if it is smaller."""

    jpeg: bytes
    width: int
    jpeg_quality: int


class CutRequest(msgspec.Struct, frozen=True, tag="cut"):
    """Answer with a piece of the unrolled wall and a line on it, as JPEG."""

    tiles: dict[int, bytes]
    """JPEGs of the same size; a missing one is grey."""
    tile_px: int
    """Width of a tile: tile k begins at column k * `tile_px`."""
    columns: tuple[int, int]
    """First, and the one after the last; of rows likewise."""
    rows: tuple[int, int]
    line: list[tuple[float, float]]
    """Column and row in the piece."""
    is_closed: bool


class AxisRequest(msgspec.Struct, frozen=True, tag="axis"):
    """Answer with the `AxisFound` in the frame shown at this time, or where it shows best."""

    video: str
    t_s: float | None
    may_begin_anew: bool = False


class AxisFound(msgspec.Struct, frozen=True):
    """A picture of a film, and the axis of the pipe in it."""

    width: int
    height: int
    pixel_aspect: float
    duration_s: float | None
    t_s: float
    axis_uv: tuple[float, float] | None
    """Pixel of the axis; None unless it is certain."""
    sigma_px: float | None
    """Its standard deviation along each side of the picture."""
    looked_at: int
    """Number of pictures that were looked at, and of those that show the axis for certain."""
    sure: int


MediaRequest = ProbeRequest | PictureRequest | AxisRequest | ReduceRequest | CutRequest


def main() -> None:
    """Receive limits, then answer requests until the pipe closes."""
    with connection_to_parent() as connection:
        limits = msgspec.msgpack.decode(connection.recv_bytes(), type=Limits)
        set_limits(limits)
        confine(reads=limits.reads)
        warm_up()
        requests: msgspec.msgpack.Decoder[MediaRequest] = msgspec.msgpack.Decoder(MediaRequest)
        while True:
            try:
                request = requests.decode(connection.recv_bytes())
            except EOFError:
                return
            answer(connection, partial(result_of, request), "Reading the video")


def warm_up() -> None:
    """Load the decoders before the first request."""
    import cv2  # noqa: F401

    import vo_core.image.sure_axis
    import vo_core.sources  # noqa: F401


def result_of(request: MediaRequest) -> VideoInfo | AxisFound | bytes:
    """Return the answer to a request."""
    if isinstance(request, ProbeRequest):
        return _probe(request)
    if isinstance(request, AxisRequest):
        return _axis(request)
    if isinstance(request, ReduceRequest):
        return _reduced(request)
    if isinstance(request, CutRequest):
        return _cut(request)
    frame = _frame(request.video, request.t_s, may_begin_anew=request.may_begin_anew)
    return _jpeg(frame.to_square_bgr(), request.jpeg_quality)


def _probe(request: ProbeRequest) -> VideoInfo:
    from vo_core.sources import VideoFile

    with VideoFile(request.video) as video:
        next(iter(video))  # raises unless a picture can be decoded
        return video.info


def _reduced(request: ReduceRequest) -> bytes:
    import cv2
    import numpy as np

    from vo_core.errors import UnreadableVideo

    picture = cv2.imdecode(np.frombuffer(request.jpeg, np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        raise UnreadableVideo("The photo cannot be decoded.")
    height, width = picture.shape[:2]
    if width <= request.width:
        return request.jpeg
    size_wh = (request.width, max(round(height * request.width / width), 1))
    reduced = cv2.resize(picture, size_wh, interpolation=cv2.INTER_AREA)
    return _jpeg(reduced.astype(np.uint8), request.jpeg_quality)


def _cut(request: CutRequest) -> bytes:
    import cv2
    import numpy as np

    first, last = request.columns
    top, bottom = request.rows
    piece = np.full((bottom - top, last - first, 3), _NO_WALL, np.uint8)
    for index, jpeg in request.tiles.items():
        tile = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        begin = index * request.tile_px
        here = slice(max(first, begin), min(last, begin + request.tile_px))
        if tile is None or here.start >= here.stop or tile.shape[1] != request.tile_px:
            continue
        part = tile[top:bottom, here.start - begin : here.stop - begin]
        piece[: len(part), here.start - first : here.stop - first] = part
    factor = min(_SHOWN_PX / max(piece.shape[:2]), _MOST_ENLARGED)
    how = cv2.INTER_AREA if factor < 1 else cv2.INTER_CUBIC
    shown = cv2.resize(piece, None, fx=factor, fy=factor, interpolation=how)
    outlines = [np.rint(np.array(request.line) * factor).astype(np.int32)]
    if not request.is_closed:  # around a line, which is to be seen itself
        mask = np.zeros(shown.shape[:2], np.uint8)
        cv2.polylines(mask, outlines, isClosed=False, color=1, thickness=_AROUND_LINE_PX)
        found, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        outlines = [each.astype(np.int32) for each in found]
    for colour, width in (((0, 0, 0), 3), ((60, 220, 255), 1)):
        cv2.polylines(shown, outlines, isClosed=True, color=colour, thickness=width)
    return _jpeg(shown.astype(np.uint8), _CUT_JPEG_QUALITY)


def _frame(video: str, t_s: float | None, *, may_begin_anew: bool) -> Frame:
    from vo_core.frames_at import read_frame
    from vo_core.sources import VideoFile

    if t_s is not None:
        return read_frame(video, t_s, may_begin_anew=may_begin_anew)
    with VideoFile(video) as film:
        return next(iter(film))


def _axis(request: AxisRequest) -> AxisFound:
    from vo_core.frames_at import spread_frames
    from vo_core.image.sure_axis import SureAxis
    from vo_core.sources import VideoFile

    with VideoFile(request.video) as video:
        info = video.info
    anew, find = request.may_begin_anew, SureAxis((info.width, info.height))
    if request.t_s is None:
        for count in _LOOKED_AT:
            frames = spread_frames(request.video, count, may_begin_anew=anew)
            looked = [_looked_at(frame, find) for frame in frames]
            if any(axis for _, axis, _ in looked):
                break
    else:
        frame = _frame(request.video, request.t_s, may_begin_anew=anew)
        looked = [(frame.t_s, find(frame.image), None)]
    sure = [(axis.sigma_px, t_s, axis) for t_s, axis, _ in looked if axis is not None]
    likely = [(axis.sigma_px, t_s, None) for t_s, _, axis in looked if axis is not None]
    _, t_s, axis = min(sure or likely or [(0.0, looked[len(looked) // 2][0], None)])
    return AxisFound(
        info.width,
        info.height,
        info.pixel_aspect,
        info.duration_s,
        t_s,
        None if axis is None else axis.pixel_uv,
        None if axis is None else axis.sigma_px,
        len(looked),
        len(sure),
    )


def _looked_at(frame: Frame, find: SureAxis) -> tuple[float, Axis | None, Axis | None]:
    """Return the time of a frame, its axis if that is certain, and where it probably is."""
    likely = find.likely(frame.image)
    sure = None if likely is None else find.confirmed(frame.image, likely)
    return frame.t_s, sure, likely


def _jpeg(picture: ByteImage, quality: int) -> bytes:
    import cv2

    _, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return jpeg.tobytes()


if __name__ == "__main__":
    main()
