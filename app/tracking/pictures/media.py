"""The one process that opens media files for the server: started when the first one is opened,
replaced when it has died or hung.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from app.jobs.messages import Limits
from app.jobs.permits import Permits
from app.jobs.process import Child, ask_about_media
from app.jobs.requests.media import (
    AxisFound,
    AxisRequest,
    CutRequest,
    MediaRequest,
    PictureRequest,
    ProbeRequest,
    ReduceRequest,
)
from vo_core.errors import UnreadableVideo
from vo_core.video_info import VideoInfo

logger = logging.getLogger(__name__)

PHOTO_JPEG_QUALITY = 92
_ANSWER_TIMEOUT_S = 30.0
Result = TypeVar("Result")


class Media:
    """Probes files and extracts pictures, one at a time."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self.restarts = 0
        """Number of times that the process was replaced."""
        self._permits = Permits(
            "Too many pictures are being read from videos; try again in a moment."
        )
        self._child: Child | None = None
        """None until the first request."""

    def close(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.kill()

    def is_alive(self) -> bool:
        """Return whether the process runs; if not, the next request starts one."""
        return self._child is not None and self._child.is_alive()

    def probe(self, path: Path, name: str) -> VideoInfo:
        """Return the properties of a video file whose first picture was decoded; messages call it
        `name`.

        Raises:
            UnreadableVideo: The file cannot be used; the text says why.
        """
        with called(path, name):
            return self._ask(ProbeRequest(str(path)), VideoInfo)

    def axis(self, path: Path, t_s: float | None, *, may_begin_anew: bool = False) -> AxisFound:
        """Find the axis of the pipe in the frame shown at `t_s`, or where the film shows it best.

        Raises:
            UnreadableVideo: The file has no picture, or ends before that time.
        """
        return self._ask(AxisRequest(str(path), t_s, may_begin_anew), AxisFound)

    def picture(
        self,
        path: Path,
        t_s: float | None,
        jpeg_quality: int = PHOTO_JPEG_QUALITY,
        *,
        may_begin_anew: bool = False,
    ) -> bytes:
        """Return the frame shown at presentation time `t_s`, as JPEG with square pixels.

        Args:
            path: The video file.
            t_s: The time of the frame; None for the first one.
            jpeg_quality: 0 to 100.
            may_begin_anew: Whether time stamps of the film may begin anew, see `vo_core.timeline`.
        """
        return self._ask(PictureRequest(str(path), t_s, jpeg_quality, may_begin_anew), bytes)

    def reduced(self, jpeg: bytes, width: int, jpeg_quality: int) -> bytes:
        """Return a picture with this width as JPEG; a smaller one is returned as it is.

        Raises:
            UnreadableVideo: It cannot be decoded.
        """
        return self._ask(ReduceRequest(jpeg, width, jpeg_quality), bytes)

    def cut(self, request: CutRequest) -> bytes:
        """Return a piece of the unrolled wall with a line on it, as JPEG."""
        return self._ask(request, bytes)

    def _ask(self, request: MediaRequest, kind: type[Result]) -> Result:
        with self._permits:
            return ask_about_media(
                self._running(),
                request,
                kind,
                work="Reading the video",
                stall_s=_ANSWER_TIMEOUT_S,
            )

    def _running(self) -> Child:
        if self._child is not None and not self._child.is_alive():
            logger.warning("The media process had ended; another is started.")
            self._child.end()
            self._child = None
            self.restarts += 1
        if self._child is None:
            self._child = Child("app.jobs.requests.media")
            self._child.send(self._limits)
        return self._child


@contextmanager
def called(path: Path, name: str) -> Iterator[None]:
    """Make messages about a file call it `name`."""
    try:
        yield
    except UnreadableVideo as error:
        raise UnreadableVideo(str(error).replace(path.name, name)) from error
