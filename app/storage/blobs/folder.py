"""Blobs as files below a folder: the data folder, or that of a worker."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from app.errors import StoreUnavailable
from app.storage.blobs.blobs import PROBE, Blob, checked_key, is_key, no_such_blob
from app.storage.folder.files import (
    copy_durably,
    delete_tree,
    full_disk_reported,
    replace_file,
    sync_file,
    sync_folder,
    write_durably,
)

_NO_LINKS = (errno.EPERM, errno.ENOTSUP, errno.EXDEV, errno.EMLINK)
"""Errors of a file system without a second name for this file."""


class FolderBlobs:
    """Blobs as files below a folder."""

    def __init__(self, root: Path) -> None:
        self._root = root.resolve()

    @property
    def name(self) -> str:
        """The folder's path."""
        return f"the folder {self._root}"

    @property
    def media(self) -> tuple[str, ...]:
        """The folder of the inspections; no child may read the server's tokens."""
        return (str(self._root / "inspections"),)

    def _path(self, key: str) -> Path:
        return self._root / checked_key(key)

    def _new(self, key: str) -> Path:
        """Return the path of a blob whose folder exists durably."""
        path = self._path(key)
        missing = [folder for folder in path.parents if not folder.exists()]
        path.parent.mkdir(parents=True, exist_ok=True)
        for folder in reversed(missing):
            sync_folder(folder.parent)
        return path

    def put(self, key: str, content: bytes) -> None:
        """Write, sync and rename."""
        with full_disk_reported():
            write_durably(self._new(key), content)

    def put_again(self, key: str, content: bytes) -> None:
        """Write and rename."""
        with full_disk_reported():
            replace_file(self._new(key), content)

    def sync(self, keys: Iterable[str]) -> None:
        """Sync the files and their folders."""
        folders = set()
        for key in keys:
            path = self._path(key)
            if path.exists():
                sync_file(path)
                folders.add(path.parent)
        for folder in folders:
            sync_folder(folder)

    def put_file(self, key: str, path: Path) -> None:
        """Copy, sync and rename."""
        with full_disk_reported():
            copy_durably(path, self._new(key))

    def adopt(self, key: str, path: Path) -> bool:
        """Give the file a second name, or copy it where a file system has no such names."""
        target = self._new(key)
        sync_file(path)
        if target == path.resolve():
            return False
        try:
            target.unlink(missing_ok=True)
            target.hardlink_to(path)
        except OSError as error:
            if error.errno not in _NO_LINKS:
                raise
            self.put_file(key, path)
        sync_folder(target.parent)
        return True

    def get(self, key: str) -> bytes:
        """Read the whole file."""
        with _found(key):
            return self._path(key).read_bytes()

    def read_range(self, key: str, first: int, length: int) -> bytes:
        """Read a part of the file."""
        with _found(key), self._path(key).open("rb") as file:
            file.seek(first)
            return file.read(length)

    def about(self, key: str) -> Blob:
        """Ask the file system."""
        with _found(key):
            return _blob(key, self._path(key).stat())

    def exists(self, key: str) -> bool:
        """Ask the file system."""
        return self._path(key).is_file()

    def listed(self, folder: str) -> Iterator[Blob]:
        """Walk through the folder."""
        yield from self._below(self._path(folder), f"{folder}/")

    def _below(self, folder: Path, prefix: str) -> Iterator[Blob]:
        try:
            # A name with a slash, as keys sort: "a.b" comes before "a/b".
            entries = sorted(
                os.scandir(folder), key=lambda entry: entry.name + "/" * entry.is_dir()
            )
        except FileNotFoundError:
            return
        for entry in entries:
            key = prefix + entry.name
            if entry.is_symlink() or not is_key(key):
                continue
            if entry.is_dir():
                yield from self._below(Path(entry.path), f"{key}/")
            else:
                try:
                    yield _blob(key, entry.stat())
                except FileNotFoundError:
                    continue

    def delete(self, key: str) -> None:
        """Delete the file."""
        self._path(key).unlink(missing_ok=True)

    def delete_all(self, folder: str) -> None:
        """Delete the folder."""
        delete_tree(self._path(folder))

    @contextmanager
    def local(self, key: str) -> Iterator[Path]:
        """Yield the file itself."""
        path = self._path(key)
        if not path.is_file():
            raise no_such_blob(key)
        yield path

    def check(self) -> None:
        """Write and delete a small file."""
        try:
            self.put(PROBE, b"")
            self.delete(PROBE)
        except OSError as error:
            raise StoreUnavailable(f"{self._root} cannot be written: {error}.") from error


def _blob(key: str, stat: os.stat_result) -> Blob:
    # The modification time survives a restart; microseconds are exact in JavaScript.
    return Blob(key, stat.st_size, stat.st_mtime_ns // 1000)


@contextmanager
def _found(key: str) -> Iterator[None]:
    try:
        yield
    except FileNotFoundError as error:
        raise no_such_blob(key) from error
