"""Writes the report of an inspection in its present state, in any format."""

from __future__ import annotations

import threading
from collections.abc import Hashable
from dataclasses import dataclass

from cachetools import TTLCache

from app.errors import BlobChanged, ExportNotAvailable, PhotoNotFound
from app.reports.builder import NO_EXTRAS, ReportBuilder
from app.reports.content.words import Language
from app.reports.formats import FORMATS
from app.reports.report import Extras, Loss, Units, Written
from app.reports.text.naming import safe_file_name
from app.storage.database.tables import ENDED

_KEPT_S = 60.0
"""How long a written report is cached: a page requests its losses and then the report itself."""
_KEPT_BYTES = 64 * 2**20
"""Bytes of cached reports, together."""


@dataclass(frozen=True)
class Export:
    """A report as a file."""

    filename: str
    media_type: str
    written: Written


class Reports:
    """Writes reports."""

    def __init__(self, builder: ReportBuilder) -> None:
        self.builder = builder
        self._lock = threading.Lock()
        """Guards the next field."""
        self._kept: TTLCache[Hashable, Export] = TTLCache(
            _KEPT_BYTES, _KEPT_S, getsizeof=lambda export: export.written.size
        )

    def export(
        self,
        inspection_id: str,
        kind: str,
        *,
        language: Language = "en",
        units: Units = "m",
        extras: Extras = NO_EXTRAS,
    ) -> Export:
        """Return the report as a file; a second call within a minute returns the same file.

        Args:
            inspection_id: An inspection in any state.
            kind: One of FORMATS.
            language: Language of formats that people read.
            units: Units of the same formats.
            extras: What it shows only where it is asked for.

        Raises:
            InspectionNotFound: No inspection has this id.
            ExportNotAvailable: The format does not exist, or the inspection lacks what it needs.
        """
        if kind not in FORMATS:
            raise ExportNotAvailable(
                f"There is no export as {kind}; there are {', '.join(FORMATS)}."
            )
        state = self.builder.state(inspection_id)
        key = (inspection_id, kind, language, units, extras, state)
        with self._lock:
            known = self._kept.get(key)
        if known is not None:
            return known
        form = FORMATS[kind]
        report = self.builder.report(inspection_id, language=language, units=units, extras=extras)
        name = safe_file_name(f"{report.name}-{form.stem}{form.suffix}")
        export = Export(name, form.media_type, form.write(report))
        can_be_kept = export.written.file is None and export.written.size <= _KEPT_BYTES
        if report.status in ENDED and can_be_kept:
            with self._lock:
                self._kept[key] = export
        return export

    def losses(
        self,
        inspection_id: str,
        kind: str,
        *,
        language: Language = "en",
        units: Units = "m",
    ) -> tuple[Loss, ...]:
        """Return what a format cannot hold; where finding that takes as long as writing it, the
        written report is cached as by `export`.

        Raises:
            InspectionNotFound: No inspection has this id.
            ExportNotAvailable: The format does not exist, or the inspection lacks what it needs.
        """
        form = FORMATS.get(kind)
        if form is not None and form.losses_of is not None:
            return form.losses_of(
                self.builder.report(inspection_id, language=language, units=units)
            )
        written = self.export(inspection_id, kind, language=language, units=units).written
        if written.file is not None:
            written.file.close()
        return written.losses

    def photo(
        self, inspection_id: str, photo_of: str, *, language: Language, units: Units, burnt_in: bool
    ) -> tuple[str, bytes]:
        """Return a photo as reports show it: the name of its file, and the JPEG.

        Args:
            inspection_id: The inspection.
            photo_of: Id of the observation or the attachment.
            language, units: Those of what is burnt in.
            burnt_in: Whether distance and code are below the picture.

        Raises:
            InspectionNotFound: No inspection has this id.
            PhotoNotFound: There is no such photo.
            BlobChanged: Its file is not the one that was stored.
        """
        extras = Extras(burnt_in=burnt_in)
        report = self.builder.report(inspection_id, language=language, units=units, extras=extras)
        for photo in (photo for entry in report.entries for photo in entry.photos):
            if photo.of == photo_of and photo.shown is not None:
                try:
                    return photo.name, photo.shown.read_bytes()
                except BlobChanged:
                    raise
                except FileNotFoundError:
                    break
        raise PhotoNotFound("There is no such photo, or it is not made yet.")
