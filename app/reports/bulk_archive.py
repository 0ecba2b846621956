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
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import IO

from app.errors import DiskFull, InspectionNotFound
from app.reports.bundle.delivery import Delivery, wanted_film
from app.reports.bundle.listed_zip import ListedZip
from app.reports.content.translator import Translator
from app.reports.formats import FORMATS
from app.reports.report import Extras, failure
from app.reports.reports import Reports
from app.reports.text.naming import safe_file_name
from app.storage.folder.files import raise_if_full
from app.storage.records.inspections import InspectionStore
from app.survey.fields.header import asset_of, project_of
from vo_core.csv_rows import plain
from vo_core.errors import ChainageError

logger = logging.getLogger(__name__)

DELIVERY = "delivery"
_DOCUMENT = "report.pdf"
_LIST = "inspections.csv"
_LIST_HEAD = (
    "folder", "inspection_id", "name", "project", "asset_id", "review", "files", "not_made",
)  # fmt: skip
_BLOCK = 2**20


@dataclass(frozen=True)
class Wanted:
    """What somebody orders."""

    inspections: tuple[str, ...]
    """Ids, in the order of the archive."""
    kinds: tuple[str, ...]
    """Formats, by their names in `app.reports.formats.FORMATS`; none for the document only."""
    words: Translator
    """The language and the units of what people read."""
    extras: Extras
    clips: bool = False
    document: bool = False
    """One PDF over all inspections."""

    @property
    def steps(self) -> int:
        """Number of steps: an inspection in the archive, and one in the document."""
        return len(self.inspections) * (bool(self.kinds) + self.document)


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


class Stopped(Exception):
    """The order is cancelled, or the server stops."""


class Watcher:
    """How far the file is; a subclass may end the work."""

    def __init__(self) -> None:
        self.done = 0
        """Steps that are done."""
        self.present: str | None = None
        """Name of the inspection whose reports are being made."""
        self.not_made: list[NotMade] = []

    def check(self) -> None:
        """Raise Stopped if nobody waits for the file any more."""

    def begin(self, name: str) -> None:
        """Begin with the inspection of this name."""
        self.check()
        self.present = name

    def end_step(self) -> None:
        """Count a step."""
        self.done += 1


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
        Stopped: The watcher has raised it.
    """
    if wanted.document and not wanted.kinds:
        _write_document(wanted, sources, file, watcher)
        return Made("chainage-report.pdf", "application/pdf")
    is_one = wanted.kinds == (DELIVERY,) and len(wanted.inspections) == 1 and not wanted.document
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        order = _Order(wanted, sources, watcher, archive)
        return Made(order.write_one() if is_one else order.write_all(), "application/zip")


def _write_document(wanted: Wanted, sources: Sources, file: IO[bytes], watcher: Watcher) -> None:
    from app.reports.pdf import collection  # loads what it is made of

    words, extras = wanted.words, Extras(burnt_in=wanted.extras.burnt_in)
    missing = collection.write(
        file,
        wanted.inspections,
        partial(
            sources.reports.builder.report,
            language=words.language,
            units=words.units,
            extras=extras,
        ),
        words,
        begin=watcher.begin,
        done=watcher.end_step,
        scratch=sources.scratch,
    )
    watcher.not_made += [
        NotMade(inspection_id, name, "document", detail) for inspection_id, name, detail in missing
    ]


class _Order:
    """An archive of what is wanted, being written."""

    def __init__(
        self, wanted: Wanted, sources: Sources, watcher: Watcher, archive: zipfile.ZipFile
    ) -> None:
        self._wanted = wanted
        self._sources = sources
        self._watcher = watcher
        now = datetime.now(UTC)
        self._zip = ListedZip(archive, now)
        self._delivery = (
            Delivery(archive, now, sources.reports.builder.signer, FORMATS, watcher.check)
            if DELIVERY in wanted.kinds
            else None
        )

    def write_all(self) -> str:
        """Write a folder for each inspection, the document, and the list; return its name."""
        wanted = self._wanted
        rows: list[tuple[str, ...]] = [_LIST_HEAD]
        if wanted.document:  # first, as it may be too large
            with tempfile.TemporaryFile(dir=self._sources.scratch) as file:
                _write_document(wanted, self._sources, file, self._watcher)
                file.seek(0)
                self._put(_DOCUMENT, iter(partial(file.read, _BLOCK), b""))
        for number, inspection_id in enumerate(wanted.inspections if wanted.kinds else (), 1):
            rows.append(self._add(number, inspection_id))
            self._watcher.end_step()
        self._put(_LIST, [_listed(rows)])
        if self._delivery is not None:
            self._delivery.close()
        return "chainage-reports.zip"

    def write_one(self) -> str:
        """Write the delivery of the only inspection, without a folder; return its name."""
        (inspection_id,) = self._wanted.inspections
        name = self._sources.inspections.get(inspection_id).name
        self._watcher.begin(name)
        if self._delivery is not None:
            self._deliver(self._delivery, inspection_id)
            self._delivery.close()
        self._watcher.end_step()
        return safe_file_name(f"{name}-delivery.zip")

    def _add(self, number: int, inspection_id: str) -> tuple[str, ...]:
        """Add the folder of an inspection; return its row of the list."""
        try:
            row = self._sources.inspections.get(inspection_id)
        except InspectionNotFound as error:
            why = self._wanted.words.phrase(failure(error))
            self._watcher.not_made.append(NotMade(inspection_id, "", "", why))
            return ("", inspection_id, "", "", "", "", "", why)
        asset = asset_of(row.header)
        folder = safe_file_name(f"{number:03d}-{asset or row.name}")
        made: list[str] = []
        missing = []
        for kind in self._wanted.kinds:
            self._watcher.begin(row.name)
            self._sources.require_room(0)
            try:
                if kind == DELIVERY and self._delivery is not None:
                    made += self._deliver(self._delivery, inspection_id, f"{folder}/", number)
                else:
                    made.append(self._export(inspection_id, kind, folder))
            except (DiskFull, Stopped):
                raise
            except Exception as error:  # one of them must not cost all the others
                why = self._why(error, kind, inspection_id)
                missing.append(f"{kind}: {why}")
                self._watcher.not_made.append(NotMade(inspection_id, row.name, kind, why))
        project = project_of(row.header) or ""
        return (
            folder, row.id, row.name, project, asset or "", row.review_state, " ".join(made),
            "; ".join(missing),
        )  # fmt: skip

    def _why(self, error: Exception, kind: str, inspection_id: str) -> str:
        if isinstance(error, ChainageError):
            return self._wanted.words.phrase(failure(error))
        if isinstance(error, OSError):
            raise_if_full(error)
        logger.error("The %s of %s could not be made.", kind, inspection_id, exc_info=error)
        return self._wanted.words("failure.internal_error")

    def _export(self, inspection_id: str, kind: str, folder: str) -> str:
        words = self._wanted.words
        export = self._sources.reports.export(
            inspection_id,
            kind,
            language=words.language,
            units=words.units,
            extras=self._extras(inspection_id),
        )
        self._put(f"{folder}/{export.filename}", export.written.blocks())
        return export.filename

    def _deliver(
        self, delivery: Delivery, inspection_id: str, folder: str = "", number: int = 1
    ) -> tuple[str, ...]:
        words, extras = self._wanted.words, self._extras(inspection_id)
        report = self._sources.reports.builder.report(
            inspection_id, language=words.language, units=words.units, extras=extras
        )
        if film := wanted_film(report):
            self._sources.require_room(film.about().size)
        return delivery.add(report, folder, number).names

    def _extras(self, inspection_id: str) -> Extras:
        clip_of = self._sources.clip_of if self._wanted.clips else None
        extras = self._wanted.extras
        return replace(extras, clip_of=partial(clip_of, inspection_id)) if clip_of else extras

    def _put(self, name: str, blocks: Iterable[bytes]) -> None:
        """Add a file; in a delivery it is listed and signed, too."""
        if self._delivery is not None:
            self._delivery.add_file(name, blocks)
        else:
            self._zip.write(name, self._watched(blocks))

    def _watched(self, blocks: Iterable[bytes]) -> Iterator[bytes]:
        """Yield a file, which may be a large film, as long as somebody waits for it."""
        for block in blocks:
            self._watcher.check()
            yield block


def _listed(rows: Iterable[Iterable[str]]) -> bytes:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerows([plain(cell) for cell in row] for row in rows)
    return out.getvalue().encode("utf-8-sig")
