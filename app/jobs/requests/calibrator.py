"""The process that measures a camera by the film of a board, then ends."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.messages import Limits

if TYPE_CHECKING:  # loaded under the limits
    from vo_core.types import ByteImage

STEP_S = 0.5
"""Time between two pictures that are searched for the board."""

MOST_PICTURES = 60
"""More pictures make no better camera, and each takes some tenths of a second."""


class FilmedBoard(msgspec.Struct, frozen=True):
    """The printed board of a film, and the lens that filmed it."""

    columns: int
    rows: int
    square_mm: float
    marker_mm: float | None
    """Side of a ChArUco board's markers; None for a checkerboard."""
    model: Literal["pinhole", "fisheye"]


class CalibrationRequest(msgspec.Struct, frozen=True):
    """Measure the camera that filmed a board."""

    video: str
    board: FilmedBoard
    limits: Limits


class Calibrated(msgspec.Struct, frozen=True):
    """The camera, and how well it is known."""

    camera: dict[str, Any]
    focal_percent: float
    """Standard uncertainty of the focal length in percent."""
    pictures: int
    rms_px: float
    coverage: float
    """Share of the picture that the boards covered."""
    weaknesses: list[str]
    """What to do better; empty for a good calibration."""


def _calibrate(request: CalibrationRequest, _parent: Parent) -> Calibrated:
    # Imported here so that OpenCV is loaded under the limits.
    from app.errors import InvalidCalibration
    from app.lab.calibration.boards import Board, UnusableBoards
    from app.lab.calibration.finding import find_boards
    from app.lab.calibration.fitting import calibrate
    from vo_core.errors import UnreadableVideo

    filmed = request.board
    try:
        board = Board(filmed.columns, filmed.rows, filmed.square_mm, filmed.marker_mm)
        found = calibrate(find_boards(_pictures(request.video), board), filmed.model)
    except (UnusableBoards, UnreadableVideo) as error:
        raise InvalidCalibration(f"{str(error).rstrip('.')}.") from error
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
    serve(
        CalibrationRequest,
        _calibrate,
        named="The calibration",
        reads=lambda request: [request.video],
    )
