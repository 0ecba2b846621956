"""The process that reads one archive file from its path, then ends; limited like the importer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from app.jobs import limits
from app.jobs.confinement import confine
from app.jobs.importer import answer
from app.jobs.messages import Limits
from app.jobs.process import connection_from_arguments

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
    from app.imports import archive_file  # under the limits

    return archive_file.read(path)


if __name__ == "__main__":
    main()
