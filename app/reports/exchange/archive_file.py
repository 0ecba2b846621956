"""Writes the archive file: an inspection whole, as `app.imports.archive_manifest` describes it.

`app.imports.archive_file` reads it.
"""

from __future__ import annotations

import hashlib
import stat
import tempfile
import zipfile
from collections.abc import Iterable
from datetime import UTC
from importlib.metadata import version
from typing import IO, cast

import msgspec

from app.errors import BlobNotFound
from app.imports.archive_manifest import (
    COMPRESSED,
    FILM,
    MANIFEST,
    PACK,
    REPORT,
    SCHEMA,
    WALL,
    Listed,
    Manifest,
)
from app.reports.content.text import iso
from app.reports.exchange import chainage_json
from app.reports.exchange.media_files import media_of
from app.reports.report import Entry, Loss, Report, WhyLost, Written, why_lost
from app.storage.blobs.blobs import Readable


def write(report: Report) -> Written:
    """Write a ZIP to a temporary file, so that a film needs no memory."""
    file = cast(IO[bytes], tempfile.TemporaryFile(dir=report.scratch))  # noqa: SIM115  (handed on open)
    try:
        with zipfile.ZipFile(file, "w", allowZip64=True) as archive:
            content = _Content(archive, report)
            content.add(REPORT, chainage_json.write(report).blocks())
            content.add_media()
            content.add_wall()
            content.add_what_is_known_of_the_film()
            content.add_film()
            content.add_manifest()
    except BaseException:
        file.close()
        raise
    file.seek(0)
    return Written(b"", tuple(content.losses), file)


class _Content:
    """An archive that is being written, and the list of its files."""

    def __init__(self, archive: zipfile.ZipFile, report: Report) -> None:
        self._archive = archive
        self._report = report
        self._files: dict[str, Listed] = {}
        self._missing: list[str] = []
        self.losses: list[Loss] = []

    def add_media(self) -> None:
        """Add photos as they were taken, and voice notes."""
        for media in media_of(self._report).values():
            self._add_stored(media.path, media.stored, media.entry)

    def add_wall(self) -> None:
        """Add the tiles of the unrolled wall."""
        for index, tile in self._report.wall.items():
            self._add_stored(f"{WALL}{index}.jpg", tile)

    def add_what_is_known_of_the_film(self) -> None:
        """Add what was read in the film, where its parts begin, and the codes of its defects."""
        for name, stored in self._report.kept.files.items():
            if stored.exists():
                self._add_stored(name, stored)
        if (table := self._report.kept.pack_table) is not None:
            self.add(PACK, [table.encode()])

    def add_film(self) -> None:
        """Add the film, if it is wanted and here; otherwise it is listed as missing."""
        film = self._report.film
        if film is None:
            if self._report.extras.film:
                self.losses.append(Loss("no_film_here"))
            return
        path = FILM + film.key.rpartition("/")[2]
        if not self._report.extras.film:
            self._missing.append(path)
            return
        source = self._report.source
        try:
            if not film.has(source.size, source.sha256):
                self._lose("changed", path, None)
                return
            self.add(path, film.blocks(0, source.size))
        except BlobNotFound as error:
            self._lose(why_lost(error), path, None)

    def add_manifest(self) -> None:
        """Add the list of all other files."""
        report = self._report
        manifest = Manifest(
            schema=SCHEMA,
            program=f"chainage {version('chainage')}",
            inspection_id=report.id,
            name=report.name.encode("utf-8", "replace").decode(),
            made_at=iso(report.made_at) or "",
            files=self._files,
            missing=self._missing,
        )
        content = msgspec.json.format(msgspec.json.encode(manifest), indent=1)
        self._write(MANIFEST, [content])

    def add(self, path: str, blocks: Iterable[bytes]) -> None:
        """Add a file, and list it."""
        self._files[path] = self._write(path, blocks)

    def _add_stored(self, path: str, stored: Readable | None, entry: Entry | None = None) -> None:
        try:
            content = stored.read_bytes() if stored else None
        except FileNotFoundError as error:
            self._lose(why_lost(error), path, entry)
            return
        if content is None:
            self._lose("gone", path, entry)
        else:
            self.add(path, [content])

    def _lose(self, why: WhyLost, path: str, entry: Entry | None) -> None:
        self._missing.append(path)
        self.losses.append(Loss(f"file_{why}", entry, name=path))

    def _write(self, path: str, blocks: Iterable[bytes]) -> Listed:
        digest, size = hashlib.sha256(), 0
        with self._archive.open(self._info(path), "w", force_zip64=path.startswith(FILM)) as member:
            for block in blocks:
                member.write(block)
                digest.update(block)
                size += len(block)
        return Listed(size, digest.hexdigest())

    def _info(self, path: str) -> zipfile.ZipInfo:
        """Describe a plain file with the time of the report: equal reports give equal archives."""
        made_at = self._report.made_at.astimezone(UTC)
        info = zipfile.ZipInfo(path, (max(made_at.year, 1980), *made_at.timetuple()[1:6]))
        info.create_system = 3
        info.external_attr = (stat.S_IFREG | 0o644) << 16
        is_compressed = path.endswith(COMPRESSED)
        info.compress_type = zipfile.ZIP_DEFLATED if is_compressed else zipfile.ZIP_STORED
        return info
