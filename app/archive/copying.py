"""Copies a film of this machine into the data folder, if it is still the file that was added."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import BinaryIO

from app.archive.folders import modified_at
from app.errors import FilmChanged, FilmMissing
from app.storage.folder.files import full_disk_reported

_BLOCK = 4 * 2**20


def copy_film(
    source: Path,
    target: Path,
    size: int,
    modified: datetime,
    on_progress: Callable[[int], None],
) -> None:
    """Copy a film; when this returns, the copy is on the disk.

    Args:
        source: Resolved path of the film.
        target: The copy; it is replaced.
        size, modified: Of the film as it was added.
        on_progress: Called with the number of bytes so far; it may raise to end the copy.
    Raises:
        FilmMissing: The file is not there any more, or cannot be read.
        FilmChanged: It is not the file that was added, or it changes.
        DiskFull: There is no room for the copy.
    """
    with _opened(source) as film:
        _require_same(film, size, modified)
        with full_disk_reported(), target.open("wb") as copy:
            done = 0
            while block := _read(film, source):
                copy.write(block)
                done += len(block)
                on_progress(done)
            copy.flush()
            os.fsync(copy.fileno())
        _require_same(film, size, modified)


def _opened(source: Path) -> BinaryIO:
    """Open a film; a link that has taken its place, or that of a folder above, is not followed."""
    try:
        # A pipe in its place would block without O_NONBLOCK.
        handle = os.open(source, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        film = open(handle, "rb", buffering=0)  # noqa: PTH123, SIM115
    except OSError as error:
        raise FilmMissing(f"The film cannot be read: {error.strerror}.") from error
    is_file = stat.S_ISREG(os.fstat(film.fileno()).st_mode)
    if not is_file or Path(os.path.realpath(source)) != source:
        film.close()
        raise FilmChanged("There is a link or something else in place of the film.")
    return film


def _require_same(film: BinaryIO, size: int, modified: datetime) -> None:
    status = os.fstat(film.fileno())
    now = modified_at(status)
    if (status.st_size, now) != (size, modified):
        raise FilmChanged(
            f"The film has changed since it was added: it had {size} bytes of {modified:%F %T}, "
            f"now {status.st_size} of {now:%F %T} (UTC). Retry takes it as it is now."
        )


def _read(film: BinaryIO, source: Path) -> bytes:
    try:
        return film.read(_BLOCK)
    except OSError as error:
        raise FilmMissing(f"The film cannot be read: {error.strerror}.") from error
