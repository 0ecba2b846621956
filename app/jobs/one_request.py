"""A process that handles one request on the files of a recording, then ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TypeVar

import msgspec

from app.jobs import limits
from app.jobs.confinement import confine
from app.jobs.failures import failure_of
from app.jobs.messages import FinaliseRequest, ReopenRequest, encode
from app.jobs.process import connection_from_arguments

Request = TypeVar("Request", FinaliseRequest, ReopenRequest)


def serve(
    kind: type[Request],
    work: Callable[[Request, Connection], None],
    *,
    reads: Callable[[Request], Sequence[str]] = lambda request: (),
) -> None:
    """Receive a request and handle it under its limits; only the recording's folder is writable.

    Args:
        kind: Type of the parent's request.
        work: Handles the request and sends the answer; `Failed` is sent if it raises.
        reads: Returns further files to read.
    """
    with connection_from_arguments() as connection:
        request = msgspec.msgpack.decode(connection.recv_bytes(), type=kind)
        limits.apply(request.limits)
        confine(reads=reads(request), writes=[str(Path(request.recording).parent)])
        try:
            work(request, connection)
        except BrokenPipeError:
            return  # the server has gone; the work is repeated when it is back
        except Exception as error:
            connection.send_bytes(encode(failure_of(error)))
