"""Uploads on the disk: the bytes so far and what was announced.

The size of the file is the offset; nothing else is kept that could disagree with it.
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
from app.storage.files import sync_folder, write_durably

_ID = re.compile(r"[0-9a-f]{32}")


@dataclass(frozen=True)
class UploadInfo:
    """What the client announced."""

    length: int
    filename: str
    metadata: str
    """The Upload-Metadata header as it came, for HEAD."""
    owner: str = ""
    """Name of the token that announced it."""


class UploadStore:
    """`<id>.bin` and `<id>.json` in one folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def create(self, info: UploadInfo) -> str:
        """A new, empty upload; durable when it returns."""
        upload_id = secrets.token_hex(16)
        try:
            self.path(upload_id).touch(exist_ok=False)
            write_durably(self._info_path(upload_id), json.dumps(asdict(info)).encode())
        except (DiskFull, OSError):
            self.delete(upload_id)
            raise
        return upload_id

    def path(self, upload_id: str) -> Path:
        """Where the bytes are; ids that we did not make are not found."""
        if not _ID.fullmatch(upload_id):
            raise UploadNotFound("There is no such upload.")
        return self._folder / f"{upload_id}.bin"

    def info(self, upload_id: str) -> UploadInfo:
        """What was announced."""
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
        """Every upload and how many of its bytes are still to come."""
        for path in self._folder.glob("*.json"):
            with suppress(UploadNotFound):  # it has just become an inspection
                info = self.info(path.stem)
                yield info, max(info.length - self.offset(path.stem), 0)

    def offset(self, upload_id: str) -> int:
        """How many bytes are on the disk."""
        return self.path(upload_id).stat().st_size

    def open(self, upload_id: str) -> BinaryIO:
        """For appending."""
        return self.path(upload_id).open("ab", buffering=0)

    def delete(self, upload_id: str) -> None:
        """Forget it; the bytes may have been moved away."""
        self._info_path(upload_id).unlink(missing_ok=True)
        self.path(upload_id).unlink(missing_ok=True)
        sync_folder(self._folder)

    def touched_at(self, upload_id: str) -> float:
        """Time of the last byte, seconds since 1970."""
        return self.path(upload_id).stat().st_mtime

    def touch_all(self) -> None:
        """Take the last byte of each to have come now."""
        now = time.time()
        for path in self._folder.iterdir():
            with suppress(FileNotFoundError):  # it has just become an inspection
                os.utime(path, (now, now))

    def older_than(self, age_s: float) -> set[str]:
        """Ids whose last byte came longer ago than `age_s`."""
        limit = time.time() - age_s
        paths = [path for path in self._folder.iterdir() if _ID.fullmatch(path.stem)]
        fresh = {path.stem for path in paths if path.stat().st_mtime >= limit}
        return {path.stem for path in paths} - fresh

    def _info_path(self, upload_id: str) -> Path:
        return self.path(upload_id).with_suffix(".json")


def write_all(file: BinaryIO, block: bytes) -> None:
    """Write every byte of `block`; a raw file may take only part of it at once."""
    view = memoryview(block)
    while view:
        view = view[file.write(view) :]


def sync(file: BinaryIO) -> None:
    """Put what was written on the disk."""
    os.fsync(file.fileno())
