"""Temporary folders, which also go when the process that uses them is killed."""

from __future__ import annotations

import fcntl
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from app.storage.folder.files import delete_tree

_LOCK = "lock"
"""File in the folder, locked as long as it is used."""


@contextmanager
def temporary_folder(prefix: str, parent: Path | None = None) -> Iterator[Path]:
    """Make a folder, and delete it after the block; delete first what killed processes left.

    Args:
        prefix: Beginning of its name, which no other files beside it have.
        parent: Where to make it; None for the usual place.
    """
    sweep(prefix, parent)
    with (
        tempfile.TemporaryDirectory(prefix=prefix, dir=parent) as name,
        Path(name, _LOCK).open("wb") as lock,
    ):
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield Path(name)


def sweep(prefix: str, parent: Path | None = None) -> None:
    """Delete the folders of this prefix that nobody uses any more."""
    for folder in (parent or Path(tempfile.gettempdir())).glob(f"{prefix}*"):
        with suppress(OSError), (folder / _LOCK).open("rb") as lock:  # still used, or not ours
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            delete_tree(folder)
