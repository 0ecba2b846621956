"""Uploads on the disk: the received bytes and the announcement.

The size of the file is the offset; nothing else is stored that could contradict it.
"""

from __future__ import annotations

import json
import os
import re
import secrets
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import BinaryIO

from app.errors import DiskFull, UploadNotFound
from app.storage.folder.files import sync_folder, write_durably

_ID = re.compile(r"[0-9a-f]{32}")


@dataclass(frozen=True)
class UploadInfo:
    """The client's announcement of an upload."""

    length: int
    filename: str
    metadata: str
    """The Upload-Metadata header as received, for HEAD."""
    owner: str = ""
    """Name of the token that announced the upload."""


class UploadStore:
    """Keeps `<id>.bin` and `<id>.json` in one folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def create(self, info: UploadInfo) -> str:
        """Create an empty upload durably; return its id."""
        upload_id = secrets.token_hex(16)
        try:
            self.path(upload_id).touch(exist_ok=False)
            write_durably(self._info_path(upload_id), json.dumps(asdict(info)).encode())
        except (DiskFull, OSError):
            self.delete(upload_id)
            raise
        return upload_id

    def path(self, upload_id: str) -> Path:
        """Return the path of the bytes; raise UploadNotFound for ids that were not made here."""
        if not _ID.fullmatch(upload_id):
            raise UploadNotFound("There is no such upload.")
        return self._folder / f"{upload_id}.bin"

    def info(self, upload_id: str) -> UploadInfo:
        """Return the announcement."""
        path = self.path(upload_id)
        try:
            info = UploadInfo(**json.loads(self._info_path(upload_id).read_bytes()))
            path.stat()
        except FileNotFoundError as error:
            raise UploadNotFound(
                "There is no such upload: it expired, was deleted or is already an inspection."
            ) from error
        return info

    def announced(self) -> Iterator[tuple[UploadInfo, int]]:
        """Yield every upload with the number of bytes still missing."""
        for path in self._folder.glob("*.json"):
            with suppress(UploadNotFound):  # it has just become an inspection
                info = self.info(path.stem)
                yield info, max(info.length - self.offset(path.stem), 0)

    def offset(self, upload_id: str) -> int:
        """Return the number of bytes on the disk."""
        return self.path(upload_id).stat().st_size

    def open(self, upload_id: str) -> BinaryIO:
        """Open the bytes for appending."""
        return self.path(upload_id).open("ab", buffering=0)

    def delete(self, upload_id: str) -> None:
        """Delete an upload; its bytes may have been moved away."""
        self._info_path(upload_id).unlink(missing_ok=True)
        self.path(upload_id).unlink(missing_ok=True)
        sync_folder(self._folder)

    def touched_at(self, upload_id: str) -> float:
        """Return the time of the last byte, seconds since 1970."""
        return self.path(upload_id).stat().st_mtime

    def touch_all(self) -> None:
        """Set the time of the last byte of every upload to now."""
        now = time.time()
        for path in self._folder.iterdir():
            with suppress(FileNotFoundError):  # it has just become an inspection
                os.utime(path, (now, now))

    def older_than(self, age_s: float) -> set[str]:
        """Return the ids whose last byte is older than `age_s`."""
        limit = time.time() - age_s
        paths = [path for path in self._folder.iterdir() if _ID.fullmatch(path.stem)]
        fresh = {path.stem for path in paths if path.stat().st_mtime >= limit}
        return {path.stem for path in paths} - fresh

    def _info_path(self, upload_id: str) -> Path:
        return self.path(upload_id).with_suffix(".json")


def write_all(file: BinaryIO, block: bytes) -> None:
    """Write every byte of `block`; a raw file may accept only part of it at once."""
    view = memoryview(block)
    while view:
        view = view[file.write(view) :]


def sync(file: BinaryIO) -> None:
    """Sync the written bytes."""
    os.fsync(file.fileno())
