"""What a child reports to its parent of an exception."""

from __future__ import annotations

import traceback

from app.jobs.messages import Failed

_OUT_OF_MEMORY = "The video needs more memory than a tracking process may use."
_CV2_NO_MEMORY = -4
"""`cv2.Error.StsNoMem`."""
_TOLD_PLAINLY = {"UnreadableVideo": "unreadable_video", "InvalidRig": "invalid_rig"}


def failure_of(error: Exception) -> Failed:
    """Code and sentence; what was not foreseen goes to the log."""
    # By name and number: when memory is too short even to load a module, its classes are not there.
    code = _TOLD_PLAINLY.get(type(error).__name__)
    if code is not None:
        return Failed(code, str(error))
    # FFmpeg's converter says EAGAIN when there is no room for the stack of a thread.
    is_short = isinstance(error, MemoryError | BlockingIOError)
    if is_short or getattr(error, "code", None) == _CV2_NO_MEMORY:
        return Failed("out_of_memory", _OUT_OF_MEMORY)
    detail = "Tracking met an unexpected fault; it is in the log."
    return Failed("tracking_failed", detail, traceback.format_exc())
