"""The process that reads one file of another program, then ends.

The reader works under limits, so that no file can use up the server's memory or time.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING

import msgspec

from app.jobs import limits
from app.jobs.confinement import confine
from app.jobs.messages import MAX_MESSAGE_BYTES, Failed, Limits, encode
from app.jobs.process import connection_from_arguments

if TYPE_CHECKING:
    from app.imports.survey import ImportedFile
    from app.imports.whole_inspection import WholeInspection

OUT_OF_MEMORY = (
    "Reading the file needs more memory than any survey takes, so it was stopped. Export it "
    "again, in several files if it is large."
)


def main() -> None:
    """Receive limits and the file, send its content, then end."""
    with connection_from_arguments() as connection:
        allowed = msgspec.msgpack.decode(connection.recv_bytes(), type=Limits)
        limits.apply(allowed)
        confine(reads=allowed.reads)
        content = connection.recv_bytes()
        connection.send_bytes(answer(lambda: _read(content)))


def _read(content: bytes) -> ImportedFile | WholeInspection:
    from app.imports import any_file  # under the limits

    return any_file.read(content)


def answer(read: Callable[[], ImportedFile | WholeInspection]) -> bytes:
    """Return what was read as a message, or why it cannot be read."""
    try:
        # Imported here so that the readers are loaded under the limits.
        from app.errors import InvalidImport
        from app.imports import wire
    except MemoryError:
        return encode(Failed("invalid_import", OUT_OF_MEMORY))
    try:
        packed = wire.pack(read())
    except InvalidImport as error:
        return encode(Failed("invalid_import", str(error)))
    except MemoryError:
        return encode(Failed("invalid_import", OUT_OF_MEMORY))
    except Exception:
        detail = (
            "Reading the file failed because of a fault in the program; it is in the server's log."
        )
        return encode(Failed("import_failed", detail, traceback.format_exc()))
    if len(packed) > MAX_MESSAGE_BYTES:
        detail = "The file holds more than surveys do. Export it again, in several files."
        return encode(Failed("invalid_import", detail))
    return packed


if __name__ == "__main__":
    main()
