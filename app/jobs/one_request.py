"""A process that handles one request under its limits, then ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from typing import Protocol, TypeVar

import msgspec

from app.jobs import limits
from app.jobs.confinement import confine
from app.jobs.failures import failure_of
from app.jobs.messages import Limits, encode
from app.jobs.process import connection_from_arguments


class Limited(Protocol):
    """A message that says under which limits it is handled."""

    @property
    def limits(self) -> Limits:
        """Limits that the process sets for itself."""


Request = TypeVar("Request", bound=Limited)


def _none(_: object) -> Sequence[str]:
    return ()


def serve(
    kind: type[Request],
    work: Callable[[Request, Connection], None],
    *,
    named: str,
    reads: Callable[[Request], Sequence[str]] = _none,
    writes: Callable[[Request], Sequence[str]] = _none,
) -> None:
    """Receive a request, handle it under its limits, and end.

    Args:
        kind: Type of the parent's request.
        work: Handles the request and sends the answer; `Failed` is sent if it raises. What it
            needs beyond the standard library it imports itself, under the limits.
        named: The work, as the beginning of a sentence that says that it failed.
        reads: Returns the files to read, and folders with their content.
        writes: Returns the files to change, and folders in which files may be made and deleted.
    """
    with connection_from_arguments() as connection:
        request = msgspec.msgpack.decode(connection.recv_bytes(), type=kind)
        limits.apply(request.limits)
        confine(reads=reads(request), writes=writes(request))
        try:
            work(request, connection)
        except BrokenPipeError:
            return  # nobody wants the result any more
        except Exception as error:
            connection.send_bytes(encode(failure_of(error, named)))
