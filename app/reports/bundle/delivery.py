"""The delivery: what the software of a client reads in, and what its people read.

The exchange file is at the top, beside it the photos and the film under exactly the names that it
cites, since it cites names without a folder. Report, page, index, checksums and a signed manifest
complete it. A delivery of several inspections has a folder of this kind for each.
"""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from datetime import datetime
from typing import IO, cast

from app.errors import ExportNotAvailable
from app.reports.bundle.bundle import Form
from app.reports.bundle.guide import Delivered, Film, page, text
from app.reports.bundle.signed_archive import Inspected, SignedArchive, inspected
from app.reports.bundle.signing import Signer
from app.reports.content.naming import file_stem
from app.reports.exchange.survey import film as film_name
from app.reports.exchange.survey import film_in_ascii
from app.reports.report import Entry, Loss, Photo, Report, VoiceNote, Written
from app.storage.blobs import Readable, StoredBlob

SUMS = "SHA256SUMS"
_ASCII = ("en13508", "en13508xml", "ribx")
"""Formats whose names of films are in ASCII."""
_FIRST = "en13508"


def write(report: Report, forms: Mapping[str, Form]) -> Written:
    """Write the delivery of one inspection to a temporary file.

    Raises:
        ExportNotAvailable: There is no signing key, or the inspection lacks what the exchange
            format needs.
    """
    if report.signer is None:
        raise ExportNotAvailable("There is no key with which the delivery could be signed.")
    folder = report.scratch
    file = cast(IO[bytes], tempfile.TemporaryFile(dir=folder))  # noqa: SIM115  (handed on open)
    try:
        with zipfile.ZipFile(file, "w") as archive:
            delivery = Delivery(archive, report.made_at, report.signer, forms)
            delivery.add(report)
            delivery.close()
    except BaseException:
        file.close()
        raise
    file.seek(0)
    return Written(b"", tuple(delivery.losses), file)


class Delivery:
    """A delivery that is being written into an archive; `close` ends it."""

    def __init__(
        self,
        archive: zipfile.ZipFile,
        made_at: datetime,
        signer: Signer,
        forms: Mapping[str, Form],
    ) -> None:
        self._archive = SignedArchive(archive, made_at, signer)
        self._forms = forms
        self._inspected: list[Inspected] = []
        self._delivered: list[Delivered] = []
        self.losses: list[Loss] = []

    def add(self, report: Report, folder: str = "") -> list[str]:
        """Add an inspection.

        Args:
            report: Its report.
            folder: Its folder, with a slash; empty if it is the only one.

        Returns:
            The names of exchange file, report and page.

        Raises:
            ExportNotAvailable: It lacks what the exchange format needs.
        """
        kind = report.extras.exchange or _FIRST
        # First what may be refused: nothing of such an inspection is in the archive.
        exchange = self._forms[kind].write(report)
        stem = file_stem(report.asset)
        file = f"{stem}{self._forms[kind].suffix}"
        self._add_form(folder, kind, file, exchange)
        readable = []
        linked = _linked_to_film(report, kind)
        for kind_read in ("pdf", "html"):
            form = self._forms[kind_read]
            readable.append(f"{stem}-{form.stem}{form.suffix}")
            self._add_form(folder, kind_read, readable[-1], form.write(linked))
        photos = sum(self._add_photo(folder, entry, photo) for entry, photo in _photos(report))
        for entry in report.entries:
            for note in entry.voice_notes:
                self._add_stored(folder, "voice", entry, note, note.sound)
        self._inspected.append(inspected(report, folder.rstrip("/")))
        film = self._add_film(report, folder, kind)
        self._delivered.append(
            Delivered(folder, report.name, report.asset, kind, file, readable[0], readable[1],
                      photos, film)
        )  # fmt: skip
        return [file, *readable]

    def add_file(self, name: str, blocks: Iterable[bytes]) -> None:
        """Add another file, such as the report over all inspections, unless it is there."""
        if name not in self._archive.files:
            self._archive.add_blocks(name, blocks)

    def close(self) -> None:
        """Add index, checksums and signature."""
        self._archive.add("index.html", page(self._delivered).encode())
        self._archive.add("README.txt", text(self._delivered).encode())
        sums = "".join(f"{one.sha256}  {name}\n" for name, one in self._archive.files.items())
        self._archive.add(SUMS, sums.encode())
        self._archive.seal(*self._inspected)

    def _add_form(self, folder: str, kind: str, name: str, written: Written) -> None:
        self._archive.add_blocks(f"{folder}{name}", written.blocks())
        self.losses += [
            Loss("in_format", loss.entry, format=kind, loss=loss) for loss in written.losses
        ]

    def _add_photo(self, folder: str, entry: Entry, photo: Photo) -> bool:
        """Add a photo as reports show it; return whether it is there."""
        if photo.shown is None:
            self.losses.append(Loss("photo_elsewhere", entry, name=photo.name))
            return False
        return self._add_stored(folder, "photo", entry, photo, photo.shown)

    def _add_stored(
        self, folder: str, what: str, entry: Entry, named: Photo | VoiceNote, stored: Readable
    ) -> bool:
        try:
            content = stored.read_bytes()
        except FileNotFoundError:
            self._archive.missing.append(folder + named.name)
            self.losses.append(Loss(f"{what}_gone", entry, name=named.name))
            return False
        self._archive.add(folder + named.name, content)
        return True

    def _add_film(self, report: Report, folder: str, kind: str) -> Film | None:
        """Add the film if it is wanted; return what the file calls it, wherever it is."""
        name = _cited_film(report, kind)
        if not name:
            return None
        source, film = report.source, wanted_film(report)
        if film is not None:
            self._archive.add_blocks(folder + name, film.blocks(0, film.about().size))
        elif report.extras.film:
            self.losses.append(Loss("film_elsewhere", name=name))
        return Film(name, source.filename, source.size, source.sha256, film is not None)


def wanted_film(report: Report) -> StoredBlob | None:
    """Return the film, if a delivery is to hold it and it is there."""
    film = report.film if report.extras.film else None
    return film if film is not None and film.exists() else None


def _cited_film(report: Report, kind: str) -> str:
    """Return the name of the film in the exchange file; empty if there is none."""
    return (film_in_ascii if kind in _ASCII else film_name)(report)


def _linked_to_film(report: Report, kind: str) -> Report:
    """Return the report with the name of the film beside it, if the film is there."""
    name = _cited_film(report, kind)
    if not name or wanted_film(report) is None:
        return report
    return replace(report, extras=replace(report.extras, film_name=name))


def _photos(report: Report) -> Iterator[tuple[Entry, Photo]]:
    """Yield every photo once: one picture may belong to several entries."""
    seen = set()
    for entry in report.entries:
        for photo in entry.photos:
            if photo.name not in seen:
                seen.add(photo.name)
                yield entry, photo
