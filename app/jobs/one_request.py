"""A process that does one request on the files of a recording, then ends."""

from __future__ import annotations

from collections.abc import Callable
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


def serve(kind: type[Request], work: Callable[[Request, Connection], None]) -> None:
    """Receive a request and do it under its limits, with no file open to writing but its folder's.

    Args:
        kind: Type of the request that the parent sends.
        work: Does the request and sends the answer; a `Failed` is sent for what it raises.
    """
    with connection_from_arguments() as connection:
        request = msgspec.msgpack.decode(connection.recv_bytes(), type=kind)
        limits.apply(request.limits)
        confine(writes=[str(Path(request.recording).parent)])
        try:
            work(request, connection)
        except BrokenPipeError:
            return  # the server has gone; all this is done again when it is back
        except Exception as error:
            connection.send_bytes(encode(failure_of(error)))
