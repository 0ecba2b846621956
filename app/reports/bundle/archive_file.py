"""Writes the archive file, an inspection whole, as `app.imports.moved.archive_manifest` has it.

`app.imports.moved.archive_file` reads it.
"""

from __future__ import annotations

import zipfile
from functools import partial
from importlib.metadata import version

import msgspec

from app.errors import BlobNotFound
from app.imports.moved.archive_manifest import (
    COMPRESSED,
    FILM,
    MANIFEST,
    PACK,
    REPORT,
    SCHEMA,
    WALL,
    Manifest,
)
from app.reports.bundle.listed_zip import ListedZip, encodable, written_to_disk
from app.reports.content.media_files import media_of
from app.reports.exchange import chainage_json
from app.reports.report import Entry, Loss, Report, WhyLost, Written, why_lost
from app.reports.text.legible import iso
from app.storage.blobs.blobs import Readable


def write(report: Report) -> Written:
    """Write the whole inspection as a ZIP."""
    return written_to_disk(report.scratch, partial(_fill, report))


def _fill(report: Report, archive: zipfile.ZipFile) -> list[Loss]:
    content = _Content(archive, report)
    content.add(REPORT, chainage_json.write(report).blocks())
    for media in media_of(report).values():
        content.add_or_lose(media.path, media.stored, media.entry)
    for index, tile in report.wall.items():
        content.add_or_lose(f"{WALL}{index}.jpg", tile)
    for name, stored in report.kept.files.items():
        if stored.exists():
            content.add_or_lose(name, stored)
    if (table := report.kept.pack_table) is not None:
        content.add(PACK, [table.encode()])
    content.add_film()
    content.add_manifest()
    return content.losses


class _Content(ListedZip):
    """An archive that is being written, and what it lacks."""

    def __init__(self, archive: zipfile.ZipFile, report: Report) -> None:
        super().__init__(archive, report.made_at)
        self._report = report
        self.losses: list[Loss] = []

    def is_stored(self, name: str) -> bool:
        """Return whether a file is read from its place in the archive."""
        return not name.endswith(COMPRESSED)

    def add_or_lose(self, path: str, stored: Readable | None, entry: Entry | None = None) -> None:
        """Add a stored file, or name it among the losses."""
        if why := self.add_stored(path, stored):
            self.losses.append(Loss(f"file_{why}", entry, name=path))

    def add_film(self) -> None:
        """Add the film, if it is wanted and here; otherwise it is listed as missing."""
        film, source = self._report.film, self._report.source
        if film is None:
            if self._report.extras.film:
                self.losses.append(Loss("no_film_here"))
            return
        path = FILM + film.key.rpartition("/")[2]
        why: WhyLost | None = None
        if self._report.extras.film:
            try:
                if film.has(source.size, source.sha256):
                    self.add(path, film.blocks(0, source.size))
                    return
                why = "changed"
            except BlobNotFound as error:
                why = why_lost(error)
            self.losses.append(Loss(f"file_{why}", name=path))
        self.missing.append(path)

    def add_manifest(self) -> None:
        """Add the list of all other files."""
        report = self._report
        manifest = Manifest(
            schema=SCHEMA,
            program=f"chainage {version('chainage')}",
            inspection_id=report.id,
            name=encodable(report.name),
            made_at=iso(report.made_at) or "",
            files=self.files,
            missing=self.missing,
        )
        content = msgspec.json.format(msgspec.json.encode(manifest), indent=1)
        self.write(MANIFEST, [content])
