"""The media process: probes video files and extracts single pictures."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import msgspec

from app.jobs.child import answer, connection_to_parent
from app.jobs.confinement import confine, set_limits
from app.jobs.messages import Limits

if TYPE_CHECKING:  # loaded under the limits
    from vo_core.types import ByteImage
    from vo_core.video_info import VideoInfo


class ProbeRequest(msgspec.Struct, frozen=True, tag="probe"):
    """Answer with the `VideoInfo` of this file, whose first picture can be decoded."""

    video: str


class PictureRequest(msgspec.Struct, frozen=True, tag="picture"):
    """Answer with the frame shown at this time, as JPEG."""

    video: str
    t_s: float
    jpeg_quality: int
    may_begin_anew: bool = False
    """Whether time stamps of the film may begin anew."""


class ReduceRequest(msgspec.Struct, frozen=True, tag="reduce"):
    """Answer with a JPEG of this width, or as it is if it is smaller."""

    jpeg: bytes
    width: int
    jpeg_quality: int


class FirstPictureRequest(msgspec.Struct, frozen=True, tag="first_picture"):
    """Answer with the `FirstPicture`."""

    video: str
    jpeg_quality: int


class FirstPicture(msgspec.Struct, frozen=True):
    """The first picture of a video."""

    jpeg: bytes
    width: int
    height: int
    pixel_aspect: float
    axis_uv: tuple[float, float] | None
    """Pixel of the axis of the pipe along which the camera looks; None if it does not show."""


MediaRequest = ProbeRequest | PictureRequest | FirstPictureRequest | ReduceRequest


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

    import vo_core.image.axis
    import vo_core.sources  # noqa: F401


def result_of(request: MediaRequest) -> VideoInfo | FirstPicture | bytes:
    """Return the answer to a request."""
    if isinstance(request, ProbeRequest):
        return _probe(request)
    if isinstance(request, FirstPictureRequest):
        return _first_picture(request)
    if isinstance(request, ReduceRequest):
        return _reduced(request)
    from vo_core.frames_at import read_frame

    frame = read_frame(request.video, request.t_s, may_begin_anew=request.may_begin_anew)
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
