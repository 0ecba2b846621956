"""The delivery: what the software of a client reads in, and what its people read.

One exchange file with all inspections is at the top, beside it the photos and the films under
exactly the names that it cites, since it cites names without a folder. Report and page of each
inspection, an index, checksums and a signed manifest complete it. With several inspections each
has a folder for what people read of it.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import datetime

from app.errors import ExportNotAvailable
from app.reports.bundle.cited_names import CitedNames
from app.reports.bundle.guide import Delivered, Exchange, Film, page, text
from app.reports.bundle.listed_zip import written_to_disk
from app.reports.bundle.signed_archive import (
    MANIFEST,
    SIGNATURE,
    Inspected,
    SignedArchive,
    inspected,
)
from app.reports.bundle.signing import Signer
from app.reports.content.media_files import read_stored
from app.reports.format import Format, SurveyFile
from app.reports.report import Entry, Loss, Photo, Report, VoiceNote, Written
from app.reports.text.naming import file_stem
from app.storage.blobs.blobs import StoredBlob
from app.survey.fields.header import project_of

SUMS, INDEX, README = "SHA256SUMS", "index.html", "README.txt"
_FIRST = "en13508"
_READABLE = ("pdf", "html")
_SEVERAL = "inspections"
"""Stem of an exchange file over several projects."""


def write(report: Report, forms: Mapping[str, Format]) -> Written:
    """Write the delivery of one inspection.

    Raises:
        ExportNotAvailable: There is no signing key, or the inspection lacks what the exchange
            format needs.
    """
    signer = report.signer
    if signer is None:
        raise ExportNotAvailable("There is no key with which the delivery could be signed.")

    def fill(archive: zipfile.ZipFile) -> tuple[Loss, ...]:
        delivery = Delivery(archive, report.made_at, signer, forms)
        added = delivery.add(report)
        delivery.close()
        return added.losses

    return written_to_disk(report.scratch, fill)


def losses(report: Report, forms: Mapping[str, Format]) -> tuple[Loss, ...]:
    """Return what the delivery of an inspection lacks; no file of it is written.

    Args:
        report: The report of the inspection.
        forms: The formats by their names.
    """
    kinds = (_kind_of(report), *_READABLE)
    found = [loss.in_format(kind) for kind in kinds for loss in forms[kind].losses(report)]
    return (*found, *_missing(CitedNames(()).with_unique_names(report, _kind_of(report), 1)))


def _missing(report: Report) -> list[Loss]:
    found = []
    for entry, photo in _photos(report):
        if photo.original is None:
            found.append(Loss("photo_elsewhere", entry, name=photo.name))
        elif isinstance(why := read_stored(photo.original), str):
            found.append(Loss(f"photo_{why}", entry, name=photo.name))
    for entry, note in _voice_notes(report):
        if isinstance(why := read_stored(note.original), str):
            found.append(Loss(f"voice_{why}", entry, name=note.name))
    film = report.extras.film_called
    if film and report.extras.film and wanted_film(report) is None:
        found.append(Loss("film_elsewhere", name=film))
    return found


@dataclass(frozen=True)
class Added:
    """What a delivery has of an inspection."""

    names: tuple[str, ...]
    """Names of report and page in its folder."""
    losses: tuple[Loss, ...]


class Delivery:
    """A delivery that is being written into an archive; `close` ends it."""

    def __init__(
        self,
        archive: zipfile.ZipFile,
        made_at: datetime,
        signer: Signer,
        forms: Mapping[str, Format],
        go_on: Callable[[], None] = lambda: None,
    ) -> None:
        """Begin a delivery; `go_on` may end long work on it by an exception."""
        self._go_on = go_on
        self._archive = SignedArchive(archive, made_at, signer)
        self._forms = forms
        self._names = CitedNames((SUMS, INDEX, README, MANIFEST, SIGNATURE))
        self._exchange: SurveyFile | None = None
        self._kind = _FIRST
        self._inspected: list[Inspected] = []
        self._delivered: list[Delivered] = []
        self._stems: set[str] = set()
        """What the exchange file may be named after."""

    def add(self, report: Report, folder: str = "", number: int = 1) -> Added:
        """Add an inspection.

        Args:
            report: Its report; the first one names the exchange format of the delivery.
            folder: Its folder, with a slash; empty if it is the only one.
            number: Its number in the delivery, for names that another inspection has.

        Raises:
            ExportNotAvailable: It lacks what the exchange format needs.
        """
        if self._exchange is None:
            self._kind = _kind_of(report)
            self._exchange = _begun(self._forms[self._kind])
        report = self._names.with_unique_names(report, self._kind, number)
        report, changed = _without_changed_film(report, self._go_on)
        stem = file_stem(report.asset)
        linked = _linked_to_film(report, folder)
        written = {kind: self._forms[kind].write(linked) for kind in _READABLE}
        # What may be refused comes first: nothing of such an inspection is in the archive.
        losses = [loss.in_format(self._kind) for loss in self._exchange.add(report)]
        names = []
        for kind, readable in written.items():
            names.append(f"{stem}-{self._forms[kind].stem}{self._forms[kind].suffix}")
            self._archive.add(folder + names[-1], readable.blocks())
            losses += [loss.in_format(kind) for loss in readable.losses]
        photos = sum(
            self._archive.add_stored(photo.name, photo.shown) is None
            for _, photo in _photos(report)
            if photo.shown is not None
        )
        for _, note in _voice_notes(report):
            self._archive.add_stored(folder + note.name, note.original)
        self._inspected.append(inspected(report, folder.rstrip("/")))
        self._stems.add((project_of(report.header) or _SEVERAL) if folder else report.asset)
        film = self._add_film(report)
        losses += [*_missing(report), *changed]
        paths = [folder + name for name in names]
        self._delivered.append(
            Delivered(report.name, report.asset, paths[0], paths[1], photos, film, tuple(losses))
        )
        return Added(tuple(names), tuple(losses))

    def add_file(self, name: str, blocks: Iterable[bytes]) -> None:
        """Add another file, such as the report over all inspections, unless it is there."""
        if name not in self._archive.files:
            self._archive.add(name, blocks)

    def close(self) -> None:
        """Add the exchange file, index, checksums and signature."""
        exchange = None
        if self._exchange is not None and self._delivered:
            form = self._forms[self._kind]
            stem = file_stem(self._stems.pop() if len(self._stems) == 1 else _SEVERAL)
            name = self._names.unique(f"{stem}{form.suffix}", f"{_SEVERAL}-")
            self._archive.add(name, [self._exchange.content()])
            exchange = Exchange(name, self._kind, len(self._delivered))
        self._archive.add(INDEX, [page(exchange, self._delivered).encode()])
        self._archive.add(README, [text(exchange, self._delivered).encode()])
        sums = "".join(f"{one.sha256}  {name}\n" for name, one in self._archive.files.items())
        self._archive.add(SUMS, [sums.encode()])
        self._archive.seal(*self._inspected)

    def _add_film(self, report: Report) -> Film | None:
        """Add the film if it is wanted; return what the file calls it, wherever it is."""
        name = report.extras.film_called
        if not name:
            return None
        source, film = report.source, wanted_film(report)
        if source.kind == "import":  # whose file is not the film
            return Film(name, "", 0, "", is_there=False)
        if film is not None and name not in self._archive.files:
            self._archive.add(name, film.blocks(0, film.about().size))
        return Film(name, source.filename, source.size, source.sha256, film is not None)


def wanted_film(report: Report) -> StoredBlob | None:
    """Return the film, if a delivery is to hold it and it is there."""
    film = report.film if report.extras.film else None
    return film if film is not None and film.exists() else None


def _without_changed_film(report: Report, go_on: Callable[[], None]) -> tuple[Report, list[Loss]]:
    film, source = wanted_film(report), report.source
    if film is None or film.has(source.size, source.sha256, go_on):
        return report, []
    loss = Loss("film_changed", name=report.extras.film_called or source.filename)
    return replace(report, extras=replace(report.extras, film=False)), [loss]


def _kind_of(report: Report) -> str:
    return report.extras.exchange or _FIRST


def _begun(form: Format) -> SurveyFile:
    if form.survey_file is None:
        raise ExportNotAvailable(f"A delivery cannot have {form.stem}{form.suffix} at its top.")
    return form.survey_file()


def _linked_to_film(report: Report, folder: str) -> Report:
    name = report.extras.film_called
    if not name or wanted_film(report) is None:
        return report
    path = f"../{name}" if folder else f"./{name}"
    return replace(report, extras=replace(report.extras, film_path=path))


def _photos(report: Report) -> Iterator[tuple[Entry, Photo]]:
    """Yield every photo once: one picture may belong to several entries."""
    seen = set()
    for entry in report.entries:
        for photo in entry.photos:
            if photo.name not in seen:
                seen.add(photo.name)
                yield entry, photo


def _voice_notes(report: Report) -> Iterator[tuple[Entry, VoiceNote]]:
    for entry in report.entries:
        for note in entry.voice_notes:
            yield entry, note
