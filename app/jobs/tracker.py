"""The tracking process: one video through the odometry, poses and small pictures back.

It writes no file and opens none but the video; its parent keeps the track.
"""

from __future__ import annotations

import time
import traceback
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

import msgspec

from app.jobs import limits
from app.jobs.messages import Batch, Done, Failed, Row, TrackRequest, encode
from app.jobs.process import connection_from_arguments

if TYPE_CHECKING:
    from vo_core.sources import Frame
    from vo_core.track import Estimate

BATCH_S = 1 / 15
"""A batch with a picture is sent at most this often."""
PREVIEW_WIDTH_PX = 960
PREVIEW_JPEG_QUALITY = 72
_LONGEST_PAUSE_S = 1.0
"""However far apart two frames are: silence is taken for a hang."""
_OUT_OF_MEMORY = "The video needs more memory than a tracking process may use."
_CV2_NO_MEMORY = -4
"""`cv2.Error.StsNoMem`."""
_TOLD_PLAINLY = {"UnreadableVideo": "unreadable_video", "InvalidRig": "invalid_rig"}


def main() -> None:
    """Do the one request on the pipe, then end."""
    with connection_from_arguments() as connection:
        request = msgspec.msgpack.decode(connection.recv_bytes(), type=TrackRequest)
        limits.apply(request.limits)
        try:
            _track(request, connection)
        except BrokenPipeError:
            return  # the server has gone; whatever was in the air is done again when it is back
        except MemoryError:
            connection.send_bytes(encode(Failed("out_of_memory", _OUT_OF_MEMORY)))
        except Exception as error:
            connection.send_bytes(encode(_failure(error)))


def _track(request: TrackRequest, connection: Connection) -> None:
    # Imported here so that the decoders are loaded under the limits.
    from vo_core import Odometry, Rig, VideoFile

    odometry = Odometry(Rig.parse(request.rig))
    rows: list[Row] = []
    started_at, sent_at = time.monotonic(), 0.0
    last: Frame | None = None
    with VideoFile(request.video) as video:
        for frame in video.read_ahead():
            rows.append(_row(odometry.step(frame.image, frame.t_s)))
            last = frame
            if time.monotonic() - sent_at >= BATCH_S:
                connection.send_bytes(encode(Batch(rows, _preview(frame))))
                rows, last, sent_at = [], None, time.monotonic()
            if request.pace is not None:
                ahead_s = frame.t_s / request.pace - (time.monotonic() - started_at)
                time.sleep(min(max(ahead_s, 0.0), _LONGEST_PAUSE_S))
        if last is not None:
            connection.send_bytes(encode(Batch(rows, _preview(last))))
        connection.send_bytes(encode(Done(video.problem)))


def _row(estimate: Estimate) -> Row:
    # Plain Python numbers: an odometry may compute in numpy scalars, which msgpack does not know.
    return Row(
        int(estimate.frame),
        float(estimate.time_s),
        float(estimate.x_mm),
        float(estimate.y_mm),
        float(estimate.yaw_deg),
        float(estimate.distance_mm),
        float(estimate.sigma_distance_mm),
        float(estimate.quality),
        estimate.status,
    )


def _preview(frame: Frame) -> bytes:
    import cv2

    picture = frame.to_bgr()
    height, width = picture.shape[:2]
    scale = min(1.0, PREVIEW_WIDTH_PX / width)
    size_wh = (round(width * scale), round(height * scale))
    small = cv2.resize(picture, size_wh, interpolation=cv2.INTER_AREA)
    _, jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, PREVIEW_JPEG_QUALITY])
    return jpeg.tobytes()


def _failure(error: Exception) -> Failed:
    # By name and number: when memory is too short even to load a module, its classes are not there.
    code = _TOLD_PLAINLY.get(type(error).__name__)
    if code is not None:
        return Failed(code, str(error))
    if getattr(error, "code", None) == _CV2_NO_MEMORY:
        return Failed("out_of_memory", _OUT_OF_MEMORY)
    detail = "Tracking met an unexpected fault; it is in the log."
    return Failed("tracking_failed", detail, traceback.format_exc())


if __name__ == "__main__":
    main()
