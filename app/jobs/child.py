"""A child's side of the pipe: it limits and confines itself, then answers its parent."""

from __future__ import annotations

import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import partial
from multiprocessing.connection import Connection
from typing import Protocol, TypeVar

import msgspec

from app.jobs.confinement import confine, set_limits
from app.jobs.messages import Answer, Failed, Limits, Part, encode, raw

_CV2_NO_MEMORY = -4
"""`cv2.Error.StsNoMem`."""
_SIGN_S = 1.0
_REPORTED_CODES = {
    "UnreadableVideo": "unreadable_video",
    "InvalidRig": "invalid_rig",
    "NoWallInView": "no_wall_in_view",
    "InvalidImport": "invalid_import",
    "InvalidPack": "invalid_pack",
    "InvalidCalibration": "invalid_calibration",
    "InvalidDetector": "invalid_detector",
}


class Limited(Protocol):
    """A request that says under which limits it is handled."""

    @property
    def limits(self) -> Limits:
        """Limits that the process sets for itself."""


Result = TypeVar("Result")


class Parent:
    """The parent, while a request is handled."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._sending = threading.Lock()

    def send(self, part: object) -> None:
        """Send a result before the answer, or progress; any thread may."""
        message = encode(Part(raw(part)))
        with self._sending:
            self._connection.send_bytes(message)

    def wait_for(self, work: Callable[[], Result], sign: object) -> Result:
        """Do work that takes long, and send a sign of life every second."""
        with ThreadPoolExecutor(1) as thread:
            doing = thread.submit(work)
            while wait([doing], _SIGN_S).not_done:
                self.send(sign)
            return doing.result()

    def asks_to_stop(self) -> bool:
        """Whether the parent has sent anything after the request."""
        return self._connection.poll()


Request = TypeVar("Request", bound=Limited)


def serve(
    kind: type[Request],
    work: Callable[[Request, Parent], object],
    *,
    named: str,
    reads: Callable[[Request], Sequence[str]] = lambda request: (),
    writes: Callable[[Request], Sequence[str]] = lambda request: (),
    port: Callable[[Request], int | None] = lambda request: None,
) -> None:
    """Receive a request, handle it under its limits, and end.

    Args:
        kind: Type of the parent's request.
        work: Handles the request and returns the answer; `Failed` is sent if it raises. What it
            needs beyond the standard library it imports itself, under the limits.
        named: The work, as the beginning of a sentence that says that it failed.
        reads: Returns the files to read, and folders with their content.
        writes: Returns the files to change, and folders in which files may be made and deleted.
        port: Returns the TCP port to connect to, if any.
    """
    with connection_to_parent() as connection:
        request = msgspec.msgpack.decode(connection.recv_bytes(), type=kind)
        set_limits(request.limits)
        confine(reads=reads(request), writes=writes(request), port=port(request))
        answer(connection, partial(work, request, Parent(connection)), named)


def connection_to_parent() -> Connection:
    """Return the child's end of the pipe."""
    return Connection(int(sys.argv[1]))


def answer(connection: Connection, work: Callable[[], object], named: str) -> None:
    """Send the result of the work, or why it failed."""
    try:
        connection.send_bytes(encode(Answer(raw(work()))))
    except (ConnectionError, EOFError):
        return  # nobody wants the result any more
    except Exception as error:
        connection.send_bytes(encode(_failure(error, named)))


def _failure(error: Exception, work: str) -> Failed:
    """Return code and sentence; unexpected exceptions carry a trace for the log."""
    # By name and number: when memory is too short even to load a module, its classes do not exist.
    code = _REPORTED_CODES.get(type(error).__name__) or getattr(error, "code", None)
    if isinstance(code, str):
        return Failed(code, str(error))
    # FFmpeg's converter reports EAGAIN when a thread's stack does not fit.
    is_short = isinstance(error, MemoryError | BlockingIOError)
    if is_short or code == _CV2_NO_MEMORY:
        return Failed("out_of_memory", f"{work} needs more memory than its process may use.")
    detail = f"{work} failed because of a fault in the program; it is in the log."
    return Failed("tracking_failed", detail, traceback.format_exc())
