"""Converts an exception of a child into a message to its parent."""

from __future__ import annotations

import traceback

from app.jobs.messages import Failed

_OUT_OF_MEMORY = "The video needs more memory than a tracking process may use."
_CV2_NO_MEMORY = -4
"""`cv2.Error.StsNoMem`."""
_TOLD_PLAINLY = {"UnreadableVideo": "unreadable_video", "InvalidRig": "invalid_rig"}


def failure_of(error: Exception, work: str) -> Failed:
    """Return code and sentence about some work; unexpected exceptions carry a trace for the log."""
    # By name and number: when memory is too short even to load a module, its classes do not exist.
    code = _TOLD_PLAINLY.get(type(error).__name__)
    if code is not None:
        return Failed(code, str(error))
    # FFmpeg's converter reports EAGAIN when a thread's stack does not fit.
    is_short = isinstance(error, MemoryError | BlockingIOError)
    if is_short or getattr(error, "code", None) == _CV2_NO_MEMORY:
        return Failed("out_of_memory", _OUT_OF_MEMORY)
    detail = f"{work} failed because of a fault in the program; it is in the log."
    return Failed("tracking_failed", detail, traceback.format_exc())
