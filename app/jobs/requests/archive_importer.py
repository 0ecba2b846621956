"""The process that reads one archive file from its path, then ends; limited like the importer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from app.jobs import limits
from app.jobs.confinement import confine
from app.jobs.messages import Limits
from app.jobs.process import connection_from_arguments
from app.jobs.requests.importer import answer
from app.jobs.track import parts

if TYPE_CHECKING:
    from app.imports.whole_inspection import WholeInspection


def main() -> None:
    """Receive limits, whose only file to read is the archive file; send its content, then end."""
    with connection_from_arguments() as connection:
        allowed = msgspec.msgpack.decode(connection.recv_bytes(), type=Limits)
        limits.apply(allowed)
        confine(reads=allowed.reads)
        connection.send_bytes(answer(lambda: _read(Path(allowed.reads[0]))))


def _read(path: Path) -> WholeInspection:
    # Imported here so that the readers are loaded under the limits.
    from app.imports import archive_file

    inspection = archive_file.read(path)
    _require_tables(inspection)
    return inspection


def _require_tables(inspection: WholeInspection) -> None:
    """Read what is known of the film once, so that the server never finds it invalid."""
    from app.burnt_in.counter import CounterReadings
    from app.errors import InvalidImport
    from app.imports.archive_manifest import PARTS, READINGS

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


if __name__ == "__main__":
    main()
