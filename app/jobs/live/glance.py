"""The process that takes one picture of a camera, to be looked at before a recording."""

from __future__ import annotations

import time

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.live.camera import place_of, port_of
from app.jobs.live.messages import CameraInput
from app.jobs.messages import Limits

_WITHIN_S = 10.0
"""A camera that is still starting may need some seconds for its first key frame."""
_JPEG_QUALITY = 92


class GlanceRequest(msgspec.Struct, frozen=True):
    """Answer with a picture of this camera, as JPEG."""

    camera: CameraInput
    limits: Limits


def _glance(request: GlanceRequest, _parent: Parent) -> bytes:
    # Imported here so that the decoders are loaded under the limits.
    import cv2
    from av.error import FFmpegError

    from app.jobs.live.cameras import CameraFault, NoPictures, opened, plain_errors

    until_s = time.monotonic() + _WITHIN_S
    fault = "It sends no picture that can be shown."
    try:
        with opened(request.camera) as source, plain_errors():
            for packet in source.packets:
                try:
                    pictures = source.codec.decode(packet)
                except FFmpegError:  # before the first key frame, or damaged
                    pictures = []
                for picture in pictures:
                    bgr = picture.to_ndarray(format="bgr24")
                    _, jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
                    return jpeg.tobytes()
                if time.monotonic() > until_s:
                    break
    except NoPictures:
        raise
    except CameraFault as error:
        fault = str(error)
    raise NoPictures("camera_unreachable", f"The camera gives no picture. {fault}")


if __name__ == "__main__":
    serve(
        GlanceRequest,
        _glance,
        named="Taking a picture",
        reads=lambda request: [place_of(request.camera)],
        writes=lambda request: (
            []
            if request.camera.peer is not None or request.camera.kind == "file"
            else [request.camera.location]
        ),
        port=lambda request: port_of(request.camera),
    )
