"""The one process that opens media files for the server: started when the first one is opened,
replaced when it dies or hangs.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import msgspec

from app.errors import Busy, MediaFailed, MediaTimeout
from app.jobs.messages import (
    Failed,
    FirstPicture,
    FirstPictureRequest,
    FromMedia,
    Limits,
    MediaAnswer,
    MediaRequest,
    Picture,
    PictureRequest,
    Probed,
    ProbeRequest,
    ReduceRequest,
)
from app.jobs.process import Child, describe_exit
from vo_core.errors import UnreadableVideo

logger = logging.getLogger(__name__)

PHOTO_JPEG_QUALITY = 92
_ANSWER_TIMEOUT_S = 30.0
_WAIT_FOR_TURN_S = 60.0
Answer = TypeVar("Answer", bound=MediaAnswer)


class Media:
    """Probes files and extracts pictures, one at a time."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self.restarts = 0
        """Number of times that the process was replaced."""
        self._turn = threading.Lock()
        self._answers = msgspec.msgpack.Decoder(FromMedia)
        self._child: Child | None = None
        """None until the first request."""

    def close(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.kill()

    def is_alive(self) -> bool:
        """Return whether the process runs; if not, the next request starts one."""
        return self._child is not None and self._child.is_alive()

    def probe(self, path: Path, name: str) -> Probed:
        """Return the properties of a video file whose first picture was decoded; messages call it
        `name`.

        Raises:
            UnreadableVideo: The file cannot be used; the text says why.
        """
        with _called(path, name):
            return self._ask(ProbeRequest(str(path)), Probed)

    def first_picture(self, path: Path, name: str) -> FirstPicture:
        """Return the first picture of a video file; messages call it `name`.

        Raises:
            UnreadableVideo: The file has no picture; the text says why.
        """
        with _called(path, name):
            return self._ask(FirstPictureRequest(str(path), PHOTO_JPEG_QUALITY), FirstPicture)

    def picture(
        self,
        path: Path,
        t_s: float,
        jpeg_quality: int = PHOTO_JPEG_QUALITY,
        *,
        may_begin_anew: bool = False,
    ) -> bytes:
        """Return the frame shown at presentation time `t_s`, as JPEG with square pixels.

        Args:
            path: The video file.
            t_s: The time of the frame.
            jpeg_quality: 0 to 100.
            may_begin_anew: Whether time stamps of the film may begin anew, see `vo_core.timeline`.
        """
        request = PictureRequest(str(path), t_s, jpeg_quality, may_begin_anew)
        return self._ask(request, Picture).jpeg

    def reduced(self, jpeg: bytes, width: int, jpeg_quality: int) -> bytes:
        """Return a picture with this width as JPEG; a smaller one is returned as it is.

        Raises:
            UnreadableVideo: It cannot be decoded.
        """
        return self._ask(ReduceRequest(jpeg, width, jpeg_quality), Picture).jpeg

    def _ask(self, request: MediaRequest, expected: type[Answer]) -> Answer:
        if not self._turn.acquire(timeout=_WAIT_FOR_TURN_S):
            raise Busy("Too many pictures are being read from videos; try again in a moment.")
        try:
            child = self._running()
            return self._checked(child, self._exchange(child, request), expected)
        finally:
            self._turn.release()

    def _running(self) -> Child:
        if self._child is None:
            self._child = self._start()
        elif not self._child.is_alive():
            logger.warning("The media process had ended; another is started.")
            self._replace(self._child)
        return self._child

    def _exchange(self, child: Child, request: MediaRequest) -> bytes:
        try:
            child.send(request)
            return child.receive(_ANSWER_TIMEOUT_S)
        except TimeoutError as error:
            self._replace(child)
            raise MediaTimeout(
                f"Reading the video took more than {_ANSWER_TIMEOUT_S:g} s and was stopped."
            ) from error
        except (EOFError, OSError) as error:
            how = describe_exit(self._replace(child))
            raise MediaFailed(f"The media process died over this video: {how}.") from error

    def _checked(self, child: Child, answer: bytes, expected: type[Answer]) -> Answer:
        try:
            message = self._answers.decode(answer)
        except msgspec.MsgspecError as error:
            self._replace(child)
            raise MediaFailed("The media process gave an invalid answer.") from error
        if isinstance(message, expected):
            return message
        if isinstance(message, Failed) and message.code == "unreadable_video":
            raise UnreadableVideo(message.detail)
        detail = message.detail if isinstance(message, Failed) else "an answer of another kind"
        logger.error("Media process: %s %s", detail, getattr(message, "trace", ""))
        raise MediaFailed(detail)

    def _replace(self, child: Child) -> int:
        """Start another process; return the exit code of this one."""
        code = child.kill() if child.is_alive() else child.end()
        self._child = self._start()
        self.restarts += 1
        return code

    def _start(self) -> Child:
        child = Child("app.jobs.requests.media")
        child.send(self._limits)
        return child


@contextmanager
def _called(path: Path, name: str) -> Iterator[None]:
    """Make messages about a file call it `name`."""
    try:
        yield
    except UnreadableVideo as error:
        raise UnreadableVideo(str(error).replace(path.name, name)) from error
