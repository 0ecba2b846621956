"""Makes what somebody has ordered of many inspections: a ZIP, one PDF over all, or a delivery.

In the ZIP each inspection has a folder with a file for each wanted format. `inspections.csv` lists
all of them, with what could not be made and why. With deliveries in it, the ZIP has an index,
checksums and a signature.
"""

from __future__ import annotations

import csv
import io
import logging
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import IO, Protocol

from app.errors import DiskFull, InspectionNotFound
from app.reports.bundle.delivery import Delivery, wanted_film
from app.reports.content.naming import safe_file_name
from app.reports.content.translator import Translator
from app.reports.content.words import Language
from app.reports.formats import FORMATS
from app.reports.pdf.collection import document
from app.reports.report import CsvStyle, Extras, Report, Units, failure
from app.reports.reports import Reports
from app.storage.database.tables import Inspection
from app.storage.folder.files import raise_if_full
from app.storage.records.inspections import InspectionStore
from app.survey.fields.header import asset_of, project_of
from vo_core.csv_rows import plain
from vo_core.errors import ChainageError

logger = logging.getLogger(__name__)

DELIVERY = "delivery"
_ZIP, _PDF = "application/zip", "application/pdf"
_COMPRESSED = (".pdf", ".xlsx", ".zip")
_DOCUMENT = "report.pdf"
_LIST = "inspections.csv"
_LIST_HEAD = (
    "folder", "inspection_id", "name", "project", "asset_id", "review", "files", "not_made",
)  # fmt: skip
_DOCUMENT_KIND = "document"
_BLOCK = 2**20


@dataclass(frozen=True)
class Wanted:
    """What somebody orders."""

    inspections: tuple[str, ...]
    """Ids, in the order of the archive."""
    kinds: tuple[str, ...]
    """Formats, by their names in `app.reports.formats.FORMATS`; none for the document only."""
    language: Language
    units: Units
    burnt_in: bool
    clips: bool
    document: bool = False
    """One PDF over all inspections."""
    exchange: str | None = None
    """Exchange format of deliveries."""
    film: bool = False
    """Films in deliveries, and in archive files."""
    photos: bool = False
    """Photos and voice notes in JSON reports."""
    csv_style: CsvStyle = "standard"

    @property
    def words(self) -> Translator:
        """The language and the units of what people read."""
        return Translator(self.language, self.units)

    @property
    def steps(self) -> int:
        """Number of steps: an inspection in the archive, and one in the document."""
        return len(self.inspections) * (bool(self.kinds) + self.document)

    @property
    def is_document(self) -> bool:
        """Whether the document is all that is wanted, so that it is the file itself."""
        return self.document and not self.kinds

    @property
    def is_one_delivery(self) -> bool:
        """Whether the file is a delivery of one inspection."""
        return self.kinds == (DELIVERY,) and len(self.inspections) == 1 and not self.document


@dataclass(frozen=True)
class NotMade:
    """A file that is missing in the archive."""

    inspection_id: str
    name: str
    """Of the inspection; empty if it was deleted."""
    kind: str
    """Its format, by the name in `FORMATS`, or `document`; empty if the whole inspection is
    missing."""
    detail: str
    """Why, in the language of the order."""


@dataclass(frozen=True)
class Made:
    """What the file is."""

    filename: str
    media_type: str


class Watcher(Protocol):
    """Whoever waits for the file."""

    def check(self) -> None:
        """Raise Stopped if the order is to end."""

    def begin(self, name: str) -> None:
        """Note that the reports of the inspection of this name are being made."""

    def done(self) -> None:
        """Note that a step is done."""

    def miss(self, missing: NotMade) -> None:
        """Note what could not be made."""


class Stopped(Exception):
    """The order is cancelled, or the server stops."""


@dataclass(frozen=True)
class Sources:
    """Where the content comes from."""

    inspections: InspectionStore
    reports: Reports
    scratch: Path
    """Folder on a disk for large files that are being written."""
    require_room: Callable[[int], None]
    """Raises DiskFull where so many bytes have no room."""
    clip_of: Callable[[str, str], bytes] | None = None
    """Cuts a clip: of an inspection, around an observation; None where nobody orders clips."""


def write(wanted: Wanted, sources: Sources, file: IO[bytes], watcher: Watcher) -> Made:
    """Write what is wanted to an empty file.

    Raises:
        ChainageError: The one delivery that is wanted cannot be made, or the disk is full.
        Stopped: The file or the watcher has raised it.
    """
    order = _Order(wanted, sources, watcher)
    if wanted.is_document:
        order.write_document(file)
        return Made("chainage-report.pdf", _PDF)
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        if wanted.is_one_delivery:
            return Made(order.write_delivery(archive), _ZIP)
        order.write_archive(archive)
    return Made("chainage-reports.zip", _ZIP)


@dataclass(frozen=True)
class _Missing:
    detail: str


class _Order:
    """What is wanted, being written."""

    def __init__(self, wanted: Wanted, sources: Sources, watcher: Watcher) -> None:
        self._wanted = wanted
        self._sources = sources
        self._watcher = watcher

    def write_archive(self, archive: zipfile.ZipFile) -> None:
        """Write a folder for each inspection, the document, and the list."""
        wanted = self._wanted
        delivery = self._delivery(archive) if DELIVERY in wanted.kinds else None
        rows = []
        if wanted.kinds:
            for number, inspection_id in enumerate(wanted.inspections, 1):
                rows.append(self._add(archive, delivery, number, inspection_id))
                self._watcher.done()
        put = partial(_put, archive, delivery)
        if wanted.document:
            with tempfile.TemporaryFile(dir=self._sources.scratch) as file:
                self.write_document(file)
                file.seek(0)
                put(_DOCUMENT, iter(partial(file.read, _BLOCK), b""))
        put(_LIST, [_listed(rows)])
        if delivery is not None:
            delivery.close()

    def write_delivery(self, archive: zipfile.ZipFile) -> str:
        """Write the delivery of the only inspection, without a folder; return its name."""
        (inspection_id,) = self._wanted.inspections
        name = self._sources.inspections.get(inspection_id).name
        self._watcher.begin(name)
        delivery = self._delivery(archive)
        self._deliver(delivery, inspection_id)
        delivery.close()
        self._watcher.done()
        return safe_file_name(f"{name}-delivery.zip")

    def write_document(self, file: IO[bytes]) -> None:
        """Write the PDF over all inspections."""
        wanted = self._wanted
        missing = document.write(
            file,
            wanted.inspections,
            partial(self._report, extras=Extras(burnt_in=wanted.burnt_in)),
            wanted.words,
            begin=self._watcher.begin,
            done=self._watcher.done,
        )
        for inspection_id, name, detail in missing:
            self._watcher.miss(NotMade(inspection_id, name, _DOCUMENT_KIND, detail))

    def _delivery(self, archive: zipfile.ZipFile) -> Delivery:
        signer = self._sources.reports.signer
        return Delivery(archive, datetime.now(UTC), signer, FORMATS, self._watcher.check)

    def _add(
        self,
        archive: zipfile.ZipFile,
        delivery: Delivery | None,
        number: int,
        inspection_id: str,
    ) -> tuple[str, ...]:
        """Add the folder of an inspection; return its row of the list."""
        try:
            row = self._sources.inspections.get(inspection_id)
        except InspectionNotFound as error:
            why = self._wanted.words.phrase(failure(error))
            self._watcher.miss(NotMade(inspection_id, "", "", why))
            return ("", inspection_id, "", "", "", "", "", why)
        folder = safe_file_name(f"{number:03d}-{asset_of(row.header) or row.name}")
        made: list[str] = []
        missing = []
        for kind in self._wanted.kinds:
            self._watcher.begin(row.name)
            self._sources.require_room(0)
            found = self._made(archive, delivery, inspection_id, kind, folder, number)
            if isinstance(found, _Missing):
                missing.append(f"{kind}: {found.detail}")
                self._watcher.miss(NotMade(inspection_id, row.name, kind, found.detail))
            else:
                made += found
        return _row(folder, row, made, missing)

    def _made(
        self,
        archive: zipfile.ZipFile,
        delivery: Delivery | None,
        inspection_id: str,
        kind: str,
        folder: str,
        number: int,
    ) -> Sequence[str] | _Missing:
        """Add the files of a format, or return why there are none: one of them must not cost all
        the others.
        """
        try:
            if kind == DELIVERY and delivery is not None:
                return self._deliver(delivery, inspection_id, f"{folder}/", number)
            export = self._sources.reports.export(
                inspection_id,
                kind,
                language=self._wanted.language,
                units=self._wanted.units,
                extras=self._extras(inspection_id),
            )
            _put(archive, delivery, f"{folder}/{export.filename}", export.written.blocks())
        except (DiskFull, Stopped):
            raise
        except ChainageError as error:
            return _Missing(self._wanted.words.phrase(failure(error)))
        except Exception as error:
            if isinstance(error, OSError):
                raise_if_full(error)
            logger.exception("The %s of %s could not be made.", kind, inspection_id)
            return _Missing(self._wanted.words("failure.internal_error"))
        return [export.filename]

    def _deliver(
        self, delivery: Delivery, inspection_id: str, folder: str = "", number: int = 1
    ) -> tuple[str, ...]:
        report = self._report(inspection_id, extras=self._extras(inspection_id))
        if film := wanted_film(report):
            self._sources.require_room(film.about().size)
        return delivery.add(report, folder, number).names

    def _report(self, inspection_id: str, *, extras: Extras) -> Report:
        return self._sources.reports.report(
            inspection_id, language=self._wanted.language, units=self._wanted.units, extras=extras
        )

    def _extras(self, inspection_id: str) -> Extras:
        wanted, clip_of = self._wanted, self._sources.clip_of
        return Extras(
            burnt_in=wanted.burnt_in,
            clip_of=partial(clip_of, inspection_id) if wanted.clips and clip_of else None,
            exchange=wanted.exchange,
            film=wanted.film,
            photos=wanted.photos,
            csv_style=wanted.csv_style,
        )


def _put(
    archive: zipfile.ZipFile, delivery: Delivery | None, name: str, blocks: Iterable[bytes]
) -> None:
    """Add a file; in a delivery it is listed and signed, too."""
    if delivery is not None:
        delivery.add_file(name, blocks)
        return
    member = zipfile.ZipInfo(name, datetime.now(UTC).timetuple()[:6])
    is_compressed = name.endswith(_COMPRESSED)
    member.compress_type = zipfile.ZIP_STORED if is_compressed else zipfile.ZIP_DEFLATED
    with archive.open(member, "w", force_zip64=True) as out:
        for block in blocks:
            out.write(block)


def _row(
    folder: str, row: Inspection, made: Sequence[str], missing: Sequence[str]
) -> tuple[str, ...]:
    return (
        folder,
        row.id,
        row.name,
        project_of(row.header) or "",
        asset_of(row.header) or "",
        row.review_state,
        " ".join(made),
        "; ".join(missing),
    )


def _listed(rows: Sequence[Sequence[str]]) -> bytes:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerows([plain(cell) for cell in row] for row in (_LIST_HEAD, *rows))
    return out.getvalue().encode("utf-8-sig")
