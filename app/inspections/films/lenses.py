"""Measures a camera by an uploaded film of a calibration board, in a child process."""

from __future__ import annotations

from app.inspections.films.uploads import Uploads
from app.jobs.messages import Limits
from app.jobs.permits import Permits
from app.jobs.process import Child, ask_about_media
from app.jobs.requests.calibrator import Calibrated, CalibrationRequest, FilmedBoard

CPU_S = 240
"""Processor time limit; sixty pictures of 1920 x 1080 px take some 30 s."""
_ANSWER_TIMEOUT_S = 300.0


class Lenses:
    """Calibrates one camera at a time."""

    def __init__(self, uploads: Uploads, limits: Limits) -> None:
        self._uploads = uploads
        self._limits = limits
        self._permits = Permits("Another camera is being calibrated; try again in a moment.")

    def calibrate(self, upload_id: str, board: FilmedBoard) -> Calibrated:
        """Measure the camera that filmed a board.

        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            InvalidCalibration: The film does not determine a camera; the text says what to do.
            MediaTimeout, MediaFailed: It took too long, or its process died.
            Busy: Another camera is being calibrated.
        """
        with (
            self._permits,
            self._uploads.held(upload_id) as (path, _),
            Child("app.jobs.requests.calibrator") as child,
        ):
            return ask_about_media(
                child,
                CalibrationRequest(str(path), board, self._limits),
                Calibrated,
                work="The calibration",
                stall_s=_ANSWER_TIMEOUT_S,
            )
