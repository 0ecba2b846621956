"""Measures a camera by an uploaded film of a calibration board, in a child process."""

from __future__ import annotations

import logging
import threading

import msgspec

from app.errors import Busy, InvalidCalibration, MediaFailed, MediaTimeout
from app.inspections.uploads import Uploads
from app.jobs.messages import (
    Calibrated,
    CalibrationRequest,
    FilmedBoard,
    FromCalibrator,
    Limits,
)
from app.jobs.process import Child, describe_exit

logger = logging.getLogger(__name__)

CPU_S = 240
"""Processor time limit; sixty pictures of 1920 x 1080 px take some 30 s."""
_ANSWER_TIMEOUT_S = 300.0
_WAIT_FOR_TURN_S = 60.0


class Lenses:
    """Calibrates one camera at a time."""

    def __init__(self, uploads: Uploads, limits: Limits) -> None:
        self._uploads = uploads
        self._limits = limits
        self._turn = threading.Lock()
        self._answers = msgspec.msgpack.Decoder(FromCalibrator)

    def calibrate(self, upload_id: str, board: FilmedBoard) -> Calibrated:
        """Measure the camera that filmed a board.

        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            InvalidCalibration: The film does not determine a camera; the text says what to do.
            MediaTimeout, MediaFailed: It took too long, or its process died.
            Busy: Another camera is being calibrated.
        """
        if not self._turn.acquire(timeout=_WAIT_FOR_TURN_S):
            raise Busy("Another camera is being calibrated; try again in a moment.")
        try:
            with self._uploads.held(upload_id) as (path, _):
                return self._measured(CalibrationRequest(str(path), board, self._limits))
        finally:
            self._turn.release()

    def _measured(self, request: CalibrationRequest) -> Calibrated:
        child = Child("app.jobs.requests.calibrator")
        try:
            child.send(request)
            answer = self._answers.decode(child.receive(_ANSWER_TIMEOUT_S))
        except TimeoutError as error:
            raise MediaTimeout("The calibration took too long; send a shorter film.") from error
        except (EOFError, OSError, msgspec.MsgspecError) as error:
            logger.warning("The process that calibrated died: %s.", describe_exit(child.end()))
            raise MediaFailed("The calibration was stopped; send a shorter film.") from error
        finally:
            child.kill()
        if isinstance(answer, Calibrated):
            return answer
        if answer.code == "invalid_calibration":
            raise InvalidCalibration(answer.detail.rstrip(".") + ".")
        logger.error("Calibration: %s %s", answer.detail, answer.trace)
        raise MediaFailed(answer.detail)
