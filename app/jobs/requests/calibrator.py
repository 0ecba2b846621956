"""The process that measures a camera by the film of a board, then ends."""

from __future__ import annotations

from collections.abc import Iterator
from multiprocessing.connection import Connection

from app.jobs import one_request
from app.jobs.messages import (
    Calibrated,
    CalibrationRequest,
    Failed,
    FromCalibrator,
    encode,
)
from vo_core.types import ByteImage

STEP_S = 0.5
"""Time between two pictures that are searched for the board."""

MOST_PICTURES = 60
"""More pictures make no better camera, and each takes some tenths of a second."""


def _calibrate(request: CalibrationRequest, connection: Connection) -> None:
    connection.send_bytes(encode(_answer(request)))


def _answer(request: CalibrationRequest) -> FromCalibrator:
    # Imported here so that OpenCV is loaded under the limits.
    from app.lab.calibration import Board, UnusableBoards, calibrate, find_boards
    from vo_core.errors import UnreadableVideo

    filmed = request.board
    try:
        board = Board(filmed.columns, filmed.rows, filmed.square_mm, filmed.marker_mm)
        found = calibrate(find_boards(_pictures(request.video), board), filmed.model)
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


def main() -> None:
    """Handle the one request on the pipe, then end."""
    one_request.serve(
        CalibrationRequest,
        _calibrate,
        named="The calibration",
        reads=lambda request: [request.video],
    )


if __name__ == "__main__":
    main()
