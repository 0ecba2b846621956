"""The process that measures a camera by the film of a board, then ends."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec

from app.jobs import limits
from app.jobs.confinement import confine
from app.jobs.failures import failure_of
from app.jobs.messages import (
    Calibrated,
    CalibrationRequest,
    Failed,
    FromCalibrator,
    Limits,
    encode,
)
from app.jobs.process import connection_from_arguments
from vo_core.types import ByteImage

STEP_S = 0.5
"""Time between two pictures that are searched for the board."""

MOST_PICTURES = 60
"""More pictures make no better camera, and each takes some tenths of a second."""


def main() -> None:
    """Receive limits and the request, send the camera, then end."""
    with connection_from_arguments() as connection:
        allowed = msgspec.msgpack.decode(connection.recv_bytes(), type=Limits)
        request = msgspec.msgpack.decode(connection.recv_bytes(), type=CalibrationRequest)
        limits.apply(allowed)
        confine(reads=[*allowed.reads, request.video])
        try:
            answer = _answer(request)
        except Exception as error:
            answer = failure_of(error, "The calibration")
        connection.send_bytes(encode(answer))


def _answer(request: CalibrationRequest) -> FromCalibrator:
    # Imported here so that OpenCV is loaded under the limits.
    from app.lab.calibration import Board, UnusableBoards, calibrate, find_boards
    from vo_core.errors import UnreadableVideo

    try:
        board = Board(request.columns, request.rows, request.square_mm, request.marker_mm)
        found = calibrate(find_boards(_pictures(request.video), board), request.model)
    except (UnusableBoards, UnreadableVideo) as error:
        return Failed("invalid_calibration", str(error))
    return Calibrated(
        camera=found.camera.model_dump(mode="json"),
        focal_percent=found.fx_percent / 2,
        pictures=len(found.fits),
        rms_px=found.rms_px,
        coverage=float(found.covered.mean()),
        weaknesses=found.weaknesses(),
    )


def _pictures(video: str) -> Iterator[tuple[str, ByteImage]]:
    """Grey pictures, named after their times."""
    from vo_core.sources import VideoFile

    taken, next_s = 0, 0.0
    with VideoFile(video) as film:
        for frame in film:
            if frame.t_s < next_s:
                continue
            yield f"{frame.t_s:.1f} s", frame.image
            taken, next_s = taken + 1, frame.t_s + STEP_S
            if taken == MOST_PICTURES:
                return


if __name__ == "__main__":
    main()
