"""The media process: probes video files and extracts single pictures."""

from __future__ import annotations

import traceback
from dataclasses import asdict
from typing import TYPE_CHECKING

import msgspec

from app.jobs import limits
from app.jobs.confinement import confine
from app.jobs.messages import (
    Failed,
    FirstPicture,
    FirstPictureRequest,
    FromMedia,
    Limits,
    MediaRequest,
    Picture,
    PictureRequest,
    Probed,
    ProbeRequest,
    ReduceRequest,
    ToMedia,
    encode,
)
from app.jobs.process import connection_from_arguments

if TYPE_CHECKING:
    from vo_core.types import ByteImage  # NumPy is loaded under the limits


def main() -> None:
    """Answer requests until the pipe closes."""
    with connection_from_arguments() as connection:
        decoder = msgspec.msgpack.Decoder(ToMedia)
        while True:
            try:
                request = decoder.decode(connection.recv_bytes())
            except EOFError:
                return
            if isinstance(request, Limits):
                limits.apply(request)
                confine(reads=request.reads)
                _warm_up()
            else:
                connection.send_bytes(encode(_answer(request)))


def _warm_up() -> None:
    """Load the decoders before the first request."""
    import cv2  # noqa: F401

    import vo_core.image.axis
    import vo_core.sources  # noqa: F401


def _answer(request: MediaRequest) -> FromMedia:
    from vo_core.errors import UnreadableVideo

    try:
        if isinstance(request, ProbeRequest):
            return _probe(request)
        if isinstance(request, FirstPictureRequest):
            return _first_picture(request)
        if isinstance(request, ReduceRequest):
            return _reduced(request)
        return _picture(request)
    except UnreadableVideo as error:
        return Failed("unreadable_video", str(error))
    except (MemoryError, BlockingIOError):  # see `failures`
        return Failed("out_of_memory", "The video needs more memory than the media process has.")
    except Exception:
        detail = "Reading the video failed because of a fault in the program; it is in the log."
        return Failed("media_failed", detail, traceback.format_exc())


def _probe(request: ProbeRequest) -> Probed:
    from vo_core.sources import VideoFile

    with VideoFile(request.video) as video:
        next(iter(video))  # raises unless a picture can be decoded
        return Probed(**asdict(video.info))


def _picture(request: PictureRequest) -> Picture:
    from vo_core.frames_at import read_frame

    frame = read_frame(request.video, request.t_s, may_begin_anew=request.may_begin_anew)
    return Picture(_jpeg(frame.to_square_bgr(), request.jpeg_quality))


def _reduced(request: ReduceRequest) -> Picture:
    import cv2
    import numpy as np

    from vo_core.errors import UnreadableVideo

    picture = cv2.imdecode(np.frombuffer(request.jpeg, np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        raise UnreadableVideo("The photo cannot be decoded.")
    height, width = picture.shape[:2]
    if width <= request.width:
        return Picture(request.jpeg)
    size_wh = (request.width, max(round(height * request.width / width), 1))
    reduced = cv2.resize(picture, size_wh, interpolation=cv2.INTER_AREA)
    return Picture(_jpeg(reduced.astype(np.uint8), request.jpeg_quality))


def _first_picture(request: FirstPictureRequest) -> FirstPicture:
    from vo_core.image.axis import AxisFinder
    from vo_core.sources import VideoFile

    with VideoFile(request.video) as video:
        frame = next(iter(video))
        height, width = frame.image.shape
        axis = AxisFinder((width, height))(frame.image)
        return FirstPicture(
            _jpeg(frame.to_square_bgr(), request.jpeg_quality),
            width,
            height,
            video.info.pixel_aspect,
            None if axis is None else axis.pixel_uv,
        )


def _jpeg(picture: ByteImage, quality: int) -> bytes:
    import cv2

    _, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return jpeg.tobytes()


if __name__ == "__main__":
    main()
