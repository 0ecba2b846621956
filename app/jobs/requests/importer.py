"""The process that reads one file of another program, or an archive file, then ends.

The reader works under limits, so that no file can use up the server's memory or time.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.messages import MAX_MESSAGE_BYTES, Limits
from app.jobs.track import parts

if TYPE_CHECKING:
    from app.imports.moved.whole_inspection import WholeInspection


class ImportRequest(msgspec.Struct, frozen=True):
    """Read a file; the answer is a message of `app.imports.wire`."""

    limits: Limits
    content: bytes = b""
    archive: str | None = None
    """Path of an archive file, in place of a content."""


def _read(request: ImportRequest, _parent: Parent) -> bytes:
    # Imported here so that the readers are loaded under the limits.
    from app.errors import InvalidImport
    from app.imports import any_file, wire
    from app.imports.moved import archive_file

    if request.archive is None:
        packed = wire.pack(any_file.read(request.content))
    else:
        inspection = archive_file.read(Path(request.archive))
        _require_tables(inspection)
        packed = wire.pack(inspection)
    if len(packed) > MAX_MESSAGE_BYTES - 1024:
        raise InvalidImport(
            "The file holds more than surveys do. Export it again, in several files."
        )
    return packed


def _require_tables(inspection: WholeInspection) -> None:
    """Read what is known of the film once, so that the server never finds it invalid."""
    from app.burnt_in.readings import CounterReadings
    from app.errors import InvalidImport
    from app.imports.moved.archive_manifest import PARTS, READINGS

    def read_readings(text: str) -> object:
        return CounterReadings.from_csv(text, None)

    for name, read in ((READINGS, read_readings), (PARTS, parts.parsed)):
        file = inspection.files.get(name)
        if file is None or file.content is None:
            continue
        try:
            read(file.content.decode("ascii"))
        except (ValueError, msgspec.MsgspecError) as error:
            raise InvalidImport(f"{name} is not what Chainage writes: {error}") from error


def main() -> None:
    """Answer the one request."""
    serve(
        ImportRequest,
        _read,
        named="Reading the file",
        reads=lambda request: [] if request.archive is None else [request.archive],
    )


if __name__ == "__main__":
    main()
