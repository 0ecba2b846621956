"""Gives access to the stored inspections of a data folder, and their reports, without a server."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from app.errors import UnusableDatabase
from app.inspections.attachments import Attachments
from app.inspections.checks import Checks
from app.inspections.corrections import Corrections
from app.inspections.counters import Counters
from app.inspections.observations import Observations
from app.inspections.packs import Packs
from app.inspections.purpose import Purpose
from app.reports.builder import Measurements, ReportBuilder
from app.reports.report import Company, Report
from app.reports.reports import Reports
from app.reports.templates import ReportTemplates
from app.search.export import ArchiveExport
from app.search.indexer import Indexer
from app.search.tables import Rows
from app.settings import Settings
from app.storage.blobs.stores import blobs_at
from app.storage.database.database import Database, stored_at
from app.storage.database.tables import Inspection
from app.storage.folder.files import Places
from app.storage.index.defect_index import DefectIndex
from app.storage.records.assets import AssetStore
from app.storage.records.corrections import CorrectionStore
from app.storage.records.findings import FindingStore
from app.storage.records.inspections import InspectionStore
from app.storage.records.observations import ObservationStore
from app.storage.records.packs import PackStore
from app.storage.records.report_templates import ReportTemplateStore
from app.storage.storage import Stored
from app.tracking.live import Live
from app.tracking.pictures.counter_files import CounterFiles
from app.tracking.tracks import Tracks
from app.tracking.unrolled import Unrolled


class Records:
    """Stored inspections and everything derived from them, with or without a server."""

    def __init__(
        self, stored: Stored, live: Live, company: Company, *, has_webhook: bool = False
    ) -> None:
        database, blobs = stored.database, stored.blobs
        self.inspection_store = InspectionStore(database)
        self.correction_store = CorrectionStore(database)
        self.observation_store = ObservationStore(database, has_webhook=has_webhook)
        self.tracks = Tracks(blobs, stored.folder)
        self.unrolled = Unrolled(blobs, live)
        self.counter_files = CounterFiles(blobs)
        self.counters = Counters(self.inspection_store, self.counter_files, self.tracks)
        self.corrections = Corrections(
            self.inspection_store, self.correction_store, self.tracks, self.counters, live
        )
        self.observations = Observations(
            self.inspection_store, self.observation_store, self.tracks, self.corrections, live
        )
        self.finding_store = FindingStore(database, self.observation_store)
        self.attachments = Attachments(stored, self.observation_store, self.tracks, live)
        self.packs = Packs(PackStore(database))
        self.purpose = Purpose(blobs)
        self.checks = Checks(
            stored, self.observations, self.corrections, self.tracks, self.packs, self.purpose
        )
        self.defect_index = DefectIndex(database)
        self.indexer = Indexer(
            self.defect_index,
            self.inspection_store,
            self.observations,
            self.corrections,
            self.tracks,
            self.packs,
            AssetStore(database),
        )
        self.archive_export = ArchiveExport(
            self.defect_index, Rows(self.defect_index, self.corrections, self.tracks)
        )
        self.report_templates = ReportTemplates(
            ReportTemplateStore(database), self.inspection_store, company
        )
        measurements = Measurements(
            blobs, self.tracks, self.corrections, self.counters, self.unrolled
        )
        builder = ReportBuilder(
            stored,
            measurements,
            self.observations,
            self.checks,
            self.packs,
            self.report_templates,
        )
        builder.draw_scene = _scene_of
        self.reports = Reports(builder)

    def named(self, wanted: str) -> list[Inspection]:
        """Return the inspections with exactly this id or name, else those whose id begins
        with it.
        """
        rows = [summary.row for summary in self.inspection_store.summaries()]
        exact = [row for row in rows if wanted in (row.id, row.name)]
        return exact or [row for row in rows if wanted and row.id.startswith(wanted.lower())]


def _scene_of(report: Report) -> str:
    from app.viewer.still import scene_page  # slow to import, and few formats need it

    return scene_page(report)


def issuing(settings: Settings) -> Company:
    """Return the company that a server's reports are of, unless a template names another."""
    return Company(settings.company_name, settings.company_logo, server=settings.public_url)


@contextmanager
def reading(settings: Settings) -> Iterator[Records]:
    """Open the present state of a data folder, its database and its store for reading.

    Nothing in it changes, except that the first bundle makes its signing key.

    Args:
        settings: Those of the server, which may be running.
    Raises:
        UnusableDatabase: The database is missing, damaged or of a newer version.
    """
    known = stored_at(settings.database_url, settings.data)
    if known.revision() is None:
        raise UnusableDatabase(known.missing)
    with tempfile.TemporaryDirectory(prefix="chainage-") as folder:
        database = Database(known.to_read(Path(folder)))
        try:
            is_here = settings.store is None
            blobs = blobs_at(settings.store, settings.data if is_here else Path(folder))
            stored = Stored(database, Places(settings.data), blobs)
            yield Records(stored, Live(), issuing(settings))
        finally:
            database.close()
