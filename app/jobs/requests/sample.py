"""The process that renders the sample inspection into a folder and reports its progress."""

from __future__ import annotations

import traceback
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec

from app.jobs import limits
from app.jobs.messages import Done, Failed, Rendered, SampleRequest, encode
from app.jobs.process import connection_from_arguments


def main() -> None:
    """Handle the one request on the pipe, then end."""
    with connection_from_arguments() as connection:
        request = msgspec.msgpack.decode(connection.recv_bytes(), type=SampleRequest)
        limits.apply(request.limits)
        try:
            _render(request, connection)
        except BrokenPipeError:
            return  # the server has gone
        except Exception as error:
            failure = Failed("sample_failed", str(error), traceback.format_exc())
            connection.send_bytes(encode(failure))


def _render(request: SampleRequest, connection: Connection) -> None:
    # Imported here so that the encoder is loaded under the limits.
    from app.lab.simulation import simulate
    from app.lab.simulation.sample import SAMPLE

    def report(done: int, total: int) -> None:
        connection.send_bytes(encode(Rendered(done, total)))

    simulate(SAMPLE.shortened(request.length_mm), Path(request.folder), report)
    connection.send_bytes(encode(Done(None)))


if __name__ == "__main__":
    main()
