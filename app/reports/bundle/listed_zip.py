"""A ZIP that lists its files with their sizes and checksums while it is written."""

from __future__ import annotations

import hashlib
import stat
import tempfile
import zipfile
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, cast

from app.imports.moved.archive_manifest import Listed
from app.reports.content.media_files import read_stored
from app.reports.report import Loss, WhyLost, Written
from app.storage.blobs.blobs import Readable

_STORED = (
    ".jpg", ".pdf", ".xlsx", ".zip", ".webm", ".ogg", ".m4a",
    ".mp4", ".mkv", ".avi", ".ts", ".mpg", ".mov",
)  # fmt: skip
"""Stored uncompressed: these formats hardly shrink."""


class ListedZip:
    """An archive that is being written."""

    def __init__(self, archive: zipfile.ZipFile, made_at: datetime) -> None:
        self._archive = archive
        self.made_at = made_at
        """Time of all its files: equal reports give equal archives."""
        self.files: dict[str, Listed] = {}
        self.missing: list[str] = []
        """Files that are named and no longer exist as they were stored."""

    def add(self, name: str, blocks: Iterable[bytes]) -> None:
        """Add a file of any size in pieces, and list it."""
        self.files[name] = self.write(name, blocks)

    def add_stored(self, name: str, stored: Readable | None) -> WhyLost | None:
        """Add a stored file, or list it as missing and return why."""
        content = read_stored(stored)
        if isinstance(content, bytes):
            self.add(name, [content])
            return None
        self.missing.append(name)
        return content

    def write(self, name: str, blocks: Iterable[bytes]) -> Listed:
        """Add a file without listing it."""
        digest, size = hashlib.sha256(), 0
        with self._archive.open(self._info(name), "w", force_zip64=True) as out:
            for block in blocks:
                out.write(block)
                digest.update(block)
                size += len(block)
        return Listed(size, digest.hexdigest())

    def is_stored(self, name: str) -> bool:
        """Return whether a file is not compressed."""
        return name.lower().endswith(_STORED)

    def _info(self, name: str) -> zipfile.ZipInfo:
        made_at = self.made_at.astimezone(UTC)
        info = zipfile.ZipInfo(name, (max(made_at.year, 1980), *made_at.timetuple()[1:6]))
        info.create_system = 3
        info.external_attr = (stat.S_IFREG | 0o644) << 16
        is_stored = self.is_stored(name)
        info.compress_type = zipfile.ZIP_STORED if is_stored else zipfile.ZIP_DEFLATED
        return info


def written_to_disk(
    scratch: Path | None, fill: Callable[[zipfile.ZipFile], Iterable[Loss]]
) -> Written:
    """Write a ZIP to a temporary file, so that many photos, or a film, need no memory.

    Args:
        scratch: Folder for it; None for the usual one.
        fill: Writes what is in it, and returns the losses.
    """
    file = cast(IO[bytes], tempfile.TemporaryFile(dir=scratch))  # noqa: SIM115  (handed on open)
    try:
        with zipfile.ZipFile(file, "w", allowZip64=True) as archive:
            losses = tuple(fill(archive))
    except BaseException:
        file.close()
        raise
    file.seek(0)
    return Written(b"", losses, file)


def encodable(text: str) -> str:
    """Return a text without what UTF-8 cannot hold."""
    return text.encode("utf-8", "replace").decode()
