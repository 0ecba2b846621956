"""Scratch copies of blobs, for programs that need a file: bounded, and shared by processes."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from app.storage.folder.files import full_disk_reported

Content = Callable[[], Iterator[bytes]]
"""Yields the blocks of a new copy."""


class Scratch:
    """A folder of copies, which threads and processes share; those used longest ago go first.

    Whoever uses a copy holds a shared lock on it, which ends with the process. A copy is made under
    a hidden name with an exclusive lock, so that everybody else waits for it.
    """

    def __init__(self, folder: Path, most_bytes: int) -> None:
        self.folder = folder.resolve()
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._most_bytes = most_bytes

    @contextmanager
    def held(self, name: str, size: int, content: Content) -> Iterator[Path]:
        """Hold the copy of this name; if there is none, `content` yields its `size` bytes."""
        path = self.folder / name
        while (file := _locked(path, size)) is None:
            self._make(path, size, content)
        with file:
            yield path

    def _make(self, path: Path, size: int, content: Content) -> None:
        part = path.with_name(f".{path.name}.part")
        with part.open("ab") as out:
            try:
                fcntl.flock(out, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                fcntl.flock(out, fcntl.LOCK_SH)  # another one makes it; its users do not block this
                return
            if not _is_at(out, part):
                return  # another one has made it meanwhile, or has given up
            try:
                with full_disk_reported():
                    if not path.exists():
                        self._make_room(size)
                        out.truncate(0)  # what a process left that was killed
                        for block in content():
                            out.write(block)
                        out.flush()
                        os.fsync(out.fileno())
                        part.replace(path)
            finally:
                if _is_at(out, part):
                    part.unlink()

    def _make_room(self, size: int) -> None:
        """Delete unused copies until `size` bytes fit, as far as there are any."""
        found = []
        for path in self.folder.iterdir():
            try:
                found.append((path.stat(), path))
            except FileNotFoundError:
                continue
        used = sum(stat.st_size for stat, _ in found)
        for stat, path in sorted(found, key=lambda pair: pair[0].st_mtime_ns):
            if used + size <= self._most_bytes:
                return
            if _deleted_unless_used(path):
                used -= stat.st_size


def _locked(path: Path, size: int) -> BinaryIO | None:
    """Open a copy and lock it against deletion; None if it is missing or not whole."""
    try:
        file = path.open("rb")
    except FileNotFoundError:
        return None
    fcntl.flock(file, fcntl.LOCK_SH)
    if _is_at(file, path):
        if os.fstat(file.fileno()).st_size == size:
            os.utime(file.fileno())
            return file
        path.unlink(missing_ok=True)  # damaged
    file.close()
    return None


def _deleted_unless_used(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            path.unlink()
    except BlockingIOError:
        return False
    except FileNotFoundError:
        pass
    return True


def _is_at(file: BinaryIO, path: Path) -> bool:
    """Return whether an open file still has this name."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    except FileNotFoundError:
        return False
