"""Builds the services, starts them in order, and stops them in reverse order."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, asynccontextmanager, suppress
from functools import partial

from app.access.access import Access
from app.access.holders import Holders
from app.alerts.webhook import Client, Webhook
from app.archive.archive import Archive
from app.archive.inbox import Inbox
from app.archive.intake import Intake
from app.data_folder import Records, issuing
from app.errors import DiskFull
from app.inspections.acceptance import Acceptance
from app.inspections.brought_in.file_reader import CPU_S, FileReader
from app.inspections.brought_in.imports import Imports
from app.inspections.brought_in.keeping import Keeper
from app.inspections.brought_in.moved import MovedInspections
from app.inspections.brought_in.pack_files import PackFiles
from app.inspections.compared.changes import CPU_S as COMPARE_CPU_S
from app.inspections.compared.changes import Changes
from app.inspections.compared.ruler import WallRuler
from app.inspections.diagnosis import Diagnosis
from app.inspections.films.aiming import Aiming
from app.inspections.films.filmed import Filmed
from app.inspections.films.films import Films
from app.inspections.films.glances import CPU_S as GLANCE_CPU_S
from app.inspections.films.glances import Glances
from app.inspections.films.lenses import CPU_S as LENS_CPU_S
from app.inspections.films.lenses import Lenses
from app.inspections.films.recordings import Recordings
from app.inspections.films.samples import Samples
from app.inspections.films.uploads import Uploads
from app.inspections.findings.detectors import CPU_S as DETECTOR_CPU_S
from app.inspections.findings.detectors import Detectors
from app.inspections.findings.finder import Finder
from app.inspections.findings.findings import Findings
from app.inspections.findings.pictures import FindingPictures
from app.inspections.findings.search import FindingSearch
from app.inspections.inspections import Inspections
from app.inspections.picking import Picking
from app.inspections.preferences import Preferences
from app.inspections.presence import Presence
from app.inspections.purpose import Purpose
from app.inspections.register import Register
from app.inspections.reviews import Reviews
from app.inspections.rigs import Rigs
from app.inspections.scaling import Scaling
from app.inspections.work_orders import OrderFollower, WorkOrders
from app.jobs.messages import Limits
from app.meter_counter.line import MeterCounter, Peer
from app.ops.health import Health
from app.ops.memory import give_back
from app.ops.metrics import Metrics, WatchedServices
from app.reports.bulk import BulkExports
from app.search.asset_map import AssetMaps, Background
from app.search.features import Features
from app.search.indexer import IndexWorker
from app.search.search import Search
from app.services import Services
from app.settings import Settings
from app.storage.blobs.stores import blobs_at
from app.storage.database.database import Database, require_its_database, stored_at
from app.storage.database.dialect import Dialect
from app.storage.folder.files import DataFolder
from app.storage.folder.tokens import TokenFile
from app.storage.folder.unfinished import Unfinished
from app.storage.index.asset_index import AssetIndex
from app.storage.index.asset_places import AssetPlaces
from app.storage.index.features import FeatureIndex
from app.storage.index.work_list import WorkList
from app.storage.records.acceptance import AcceptanceStore
from app.storage.records.access import AccessStore
from app.storage.records.alerts import AlertStore
from app.storage.records.assets import AssetStore
from app.storage.records.detectors import DetectorStore
from app.storage.records.imports import ImportStore
from app.storage.records.labels import LabelStore
from app.storage.records.notices import NoticeStore
from app.storage.records.preferences import PreferenceStore
from app.storage.records.projects import ProjectStore
from app.storage.records.reviews import ReviewStore
from app.storage.records.rigs import RigStore
from app.storage.records.runs import RunStore
from app.storage.records.work_orders import WorkOrderStore
from app.storage.storage import Storage
from app.tracking.cameras import Sources
from app.tracking.films.dask_engine import Cluster, DaskEngine, Store
from app.tracking.films.engines import Engine, Pool
from app.tracking.films.queue import Tracking
from app.tracking.films.run_files import RunFiles
from app.tracking.films.runs import Runs
from app.tracking.live import Live
from app.tracking.pictures.clips import CPU_S as CLIP_CPU_S
from app.tracking.pictures.clips import Clips
from app.tracking.pictures.counter_queue import CounterQueue
from app.tracking.pictures.film_files import FilmFiles
from app.tracking.pictures.media import Media
from app.tracking.pictures.photos import Photos
from app.tracking.pictures.thumbnails import Thumbnails
from app.tracking.recorder import Recorder
from app.tracking.worker import Worker
from app.viewer.clicks import Clicks
from app.viewer.scenes import SWEEP_S, Scenes
from app.watched import Watched

logger = logging.getLogger(__name__)

_EXPIRY_SWEEP_S = 600.0
_GIVE_BACK_S = 60.0
_THREADS = 32


@asynccontextmanager
async def running(settings: Settings, stored: Dialect | None = None) -> AsyncIterator[Services]:
    """Run the services of one data folder until the block ends.

    Args:
        settings: Of the server.
        stored: Its database, if this server is the active one of it already.
    """
    # The default pool has few threads, and each upload occupies one while the disk syncs.
    asyncio.get_running_loop().set_default_executor(ThreadPoolExecutor(_THREADS, "worker"))
    with ExitStack() as stack:
        services = await asyncio.to_thread(_started, settings, stored, stack)
        sweeps = [
            asyncio.create_task(_repeated(services[Scenes].sweep, SWEEP_S)),
            asyncio.create_task(
                _repeated(partial(asyncio.to_thread, services[Uploads].expire), _EXPIRY_SWEEP_S)
            ),
            asyncio.create_task(_repeated(partial(asyncio.to_thread, give_back), _GIVE_BACK_S)),
        ]
        try:
            yield services
        finally:
            for sweep in sweeps:
                sweep.cancel()
                with suppress(asyncio.CancelledError):
                    await sweep
            await services[Scenes].close()
            await asyncio.to_thread(stack.close)


def _started(settings: Settings, stored: Dialect | None, stack: ExitStack) -> Services:
    """Build and start the services; `stack` stops them, even if a later step fails."""
    building = _Building(settings, stored, stack)
    building.start_tracking()
    building.add_inspections()
    building.start_findings()
    building.start_archive()
    building.start_connections()
    building.add_rest()
    return building.services


class _Building:
    """The services as far as they are built; each method adds those of some rooms."""

    def __init__(self, settings: Settings, stored: Dialect | None, stack: ExitStack) -> None:
        self.settings, self.stack = settings, stack
        self.services = Services()
        self.threads: list[Watched] = []
        self.live = self.services.add(Live())
        folder = DataFolder(
            settings.data,
            reserve_bytes=settings.disk_reserve_bytes,
            is_shared=settings.database is not None,
        )
        stack.callback(folder.close)
        blobs = blobs_at(settings.store, folder.root, scratch_bytes=settings.scratch_bytes)
        with suppress(DiskFull):  # what is stored can be read
            blobs.check()
        if stored is None:
            stored = stored_at(settings.database_url, folder.root)
        require_its_database(stored, folder)
        metrics = self.services.add(Metrics(f"{stored.kind} {stored.version()}"))
        stack.enter_context(self.live.listening(None, metrics.on_event))
        database = Database(stored, on_write=metrics.count_write)
        stack.callback(database.close)
        self.threads.append(database.writer)
        self.storage = Storage(database, folder, blobs)
        self.client = _client(settings)
        self.records = Records(
            self.storage, self.live, issuing(settings), has_webhook=self.client is not None
        )

    def _run(self, service: Worker | Tracking) -> None:
        """Start a service with threads, which follows what happens; `stack` stops it."""
        self.stack.enter_context(self.live.listening(None, service.on_event))
        service.start()
        self.stack.callback(service.stop)
        self.threads += service.threads if isinstance(service, Tracking) else [service]

    def _limits(self, cpu_s: int, *reads: str) -> Limits:
        return Limits(self.settings.child_memory_bytes, cpu_s, reads=reads)

    @property
    def _job_limits(self) -> Limits:
        return Limits(self.settings.child_memory_bytes, round(self.settings.job_cpu_h * 3600))

    def start_tracking(self) -> None:
        """Start what tracks and records films, and makes pictures of them."""
        settings, storage, records, live = self.settings, self.storage, self.records, self.live
        reads = (*storage.folder.media, *storage.blobs.media)
        media = self.services.add(Media(Limits(settings.child_memory_bytes, reads=reads)))
        self.stack.callback(media.close)
        self._runs = Runs(records.tracks, records.unrolled, live)
        run_files = RunFiles(
            storage.folder,
            storage.blobs,
            records.tracks,
            limits=self._job_limits,
            stall_s=settings.stall_s,
        )
        self._tracker = self._engine(self._runs, run_files)
        films = FilmFiles(storage.blobs, storage.folder)
        photos = Photos(storage, records.observation_store, media, records.tracks, live)
        self._run(self.services.add(photos))
        run_store = RunStore(storage.database)
        counter_queue = CounterQueue(
            records.inspection_store,
            films,
            records.counter_files,
            live,
            limits=self._job_limits,
            read=self._tracker.read_counter,
            # The workers of a cluster do it beside their films.
            has_others=run_store.are_queued if settings.dask is None else lambda: False,
        )
        self._run(self.services.add(counter_queue))
        tracking = Tracking(storage, records.tracks, self._runs, live, run_files, self._tracker)
        self._run(self.services.add(tracking))
        recorder = Recorder(
            storage,
            records.tracks,
            self._runs,
            live,
            tracking,
            memory_bytes=settings.child_memory_bytes,
        )
        self.stack.callback(self.services.add(recorder).stop)
        self.services.add(Sources(settings.camera_networks, settings.watch_folder))
        self.services.add(Thumbnails(storage, records.observation_store, media))
        self.services.add(
            Clips(
                records.inspection_store,
                records.observation_store,
                storage.blobs,
                films,
                records.tracks,
                self._limits(CLIP_CPU_S),
            )
        )

    def add_inspections(self) -> None:
        """Add inspections, what they are made of, and what belongs to them."""
        settings, storage, records = self.settings, self.storage, self.records
        services, tracks = self.services, self.records.tracks
        media, tracking = services[Media], services[Tracking]
        uploads = services.add(
            Uploads(
                storage.folder,
                max_bytes=settings.max_upload_bytes,
                expiry_s=settings.upload_expiry_h * 3600,
            )
        )
        for service in (
            tracks, records.unrolled, records.observations, records.attachments,
            records.corrections, records.checks, records.counters, records.packs,
        ):  # fmt: skip
            services.add(service)
        scaling = Scaling(records.correction_store, tracks, records.corrections)
        self._run(scaling)
        inspections = services.add(
            Inspections(
                storage,
                tracks,
                records.corrections,
                self._runs,
                tracking,
                self.live,
                services.add(records.purpose),
            )
        )
        services.add(Filmed(storage, media, tracks, records.corrections))
        register = services.add(
            Register(AssetStore(storage.database), ProjectStore(storage.database))
        )
        films = services.add(
            Films(storage, media, uploads, records.counter_files, register, tracking)
        )
        services.add(
            Recordings(storage, tracks, register, services[Sources], services[Recorder], tracking)
        )
        unfinished = Unfinished(
            storage.folder, storage.blobs, ImportStore(storage.database).has_known
        )
        unfinished.delete_all()
        keeper = Keeper(storage, tracks, unfinished)
        moved = MovedInspections(
            storage, keeper, media, records.packs, records.report_templates, self.live
        )
        reader = FileReader(self._limits(CPU_S))
        services.add(Imports(reader, keeper, moved, uploads))
        services.add(PackFiles(reader, records.packs))
        samples = Samples(storage.folder, storage.blobs, inspections, films, records.observations)
        self.stack.callback(services.add(samples).stop)
        services.add(Aiming(uploads, services[Filmed], media, services[CounterQueue]))
        services.add(Diagnosis(inspections, tracks, records.corrections, services[Aiming]))
        services.add(Glances(services[Sources], self._limits(GLANCE_CPU_S)))
        services.add(Lenses(uploads, self._limits(LENS_CPU_S)))
        changes = Changes(
            records.inspection_store,
            records.unrolled,
            records.corrections,
            records.finding_store,
            storage.blobs,
            self._limits(COMPARE_CPU_S),
        )
        self._run(services.add(changes))
        assets = AssetIndex(storage.database)
        services.add(
            WallRuler(records.inspection_store, assets, tracks, records.corrections, changes)
        )
        services.add(Picking(records.inspection_store, tracks, records.corrections))
        accepted = AcceptanceStore(storage.database, has_webhook=self.client is not None)
        services.add(Acceptance(accepted, self.live))
        reviews = ReviewStore(storage.database)
        services.add(Reviews(records.inspection_store, reviews, accepted, self.live))
        services.add(Rigs(RigStore(storage.database)))
        services.add(Preferences(PreferenceStore(storage.database)))
        services.add(Presence())

    def start_findings(self) -> None:
        """Start the search of walls, and add what is done with its findings."""
        records, services, live = self.records, self.services, self.live
        detectors = services.add(
            Detectors(
                DetectorStore(self.storage.database),
                services[Uploads],
                self.storage.blobs,
                self._limits(DETECTOR_CPU_S),
            )
        )
        inspections, store = records.inspection_store, records.finding_store
        search = FindingSearch(
            inspections,
            store,
            records.observations,
            Finder(records.unrolled, self.storage.blobs, detectors, self._job_limits),
            live,
            is_automatic=self.settings.find_defects,
            has_others=RunStore(self.storage.database).are_queued,
        )
        self._run(services.add(search))
        services.add(Findings(inspections, store, records.observations, records.packs, live))
        services.add(FindingPictures(inspections, store, records.unrolled, services[Media]))

    def start_archive(self) -> None:
        """Start the index, the search in it, and the intake of many films."""
        settings, database, records = self.settings, self.storage.database, self.records
        services, tracking = self.services, self.services[Tracking]
        orders = services.add(
            WorkOrders(
                WorkOrderStore(database, has_webhook=self.client is not None), self._tell_client
            )
        )
        follower = OrderFollower(orders)
        index_worker = IndexWorker(records.indexer, follower.wake)
        services[Recorder].start()
        self._run(index_worker)
        self._run(follower)
        intake = Intake(
            self.storage,
            services[Inspections],
            services[Films],
            tracking,
            records.packs,
            self._tracker,
        )
        self._run(intake)
        if settings.inbox is not None:
            inbox = Inbox(database, intake, settings.inbox, settle_s=settings.inbox_settle_s)
            self._run(inbox)
        services.add(
            Archive(
                database,
                tracking,
                self._runs,
                intake,
                services[Purpose],
                folders=settings.archive_folders,
                engine=self._tracker,
            )
        )
        services.add(
            Search(
                records.defect_index,
                AssetIndex(database),
                WorkList(database),
                LabelStore(database),
                index_worker,
                services[Purpose],
            )
        )
        background = Background(settings.map_tiles, settings.map_attribution)
        services.add(AssetMaps(AssetPlaces(database), background))
        services.add(Features(FeatureIndex(database)))
        services.add(records.archive_export)

    def _tell_client(self) -> None:
        """Let the webhook look for messages, once it is there: what waits then it finds itself."""
        if self.services.has(Webhook):
            self.services[Webhook].wake()

    def start_connections(self) -> None:
        """Start what tells other software about inspections."""
        records, services = self.records, self.services
        database = self.storage.database
        webhook = Webhook(
            self.client,
            AlertStore(database),
            NoticeStore(database),
            services[Inspections],
            records.observations,
            records.packs,
        )
        self._run(services.add(webhook))
        self._run(services.add(MeterCounter(_peer(self.settings), records.corrections)))

    def add_rest(self) -> None:
        """Add reports, 3D views, access, and what watches the others."""
        records, services, storage = self.records, self.services, self.storage
        services.add(records.reports)
        services.add(records.report_templates)
        bulk_exports = services.add(
            BulkExports(
                records.inspection_store,
                records.reports,
                services[Clips].content_of,
                storage.folder,
            )
        )
        self._run(bulk_exports)
        scenes = Scenes(
            services[Inspections],
            records.observations,
            records.unrolled,
            self.live,
            records.packs,
            services[Picking],
        )
        services.add(scenes)
        services.add(Clicks())
        media = services[Media]
        services[Metrics].observe(
            WatchedServices(storage, self._runs, media, services[Recorder], scenes)
        )
        services.add(Health(storage, media, services[Tracking], tuple(self.threads)))
        secret = self.settings.token
        token = secret.get_secret_value() if secret else storage.folder.kept_token()
        access_store, token_file = AccessStore(storage.database), TokenFile(storage.folder.root)
        services.add(Access(access_store, token_file, token))
        services.add(Holders(access_store, token_file, token))

    def _engine(self, runs: Runs, run_files: RunFiles) -> Engine:
        """Return what tracks the films: the cluster that is set, or else this machine."""
        settings, storage = self.settings, self.storage
        if settings.dask is None:
            return Pool(
                storage,
                runs,
                slots=settings.max_jobs,
                limits=self._job_limits,
                stall_s=settings.stall_s,
                pace=settings.pace,
            )
        cluster = Cluster(settings.dask, settings.dask_ca, settings.dask_cert, settings.dask_key)
        return DaskEngine(cluster, Store(settings.store, str(storage.folder.root)), run_files, runs)


def _client(settings: Settings) -> Client | None:
    """Return the client to notify of urgent observations, if one is set."""
    if settings.webhook_url is None or settings.webhook_secret is None:
        return None
    page_root = (settings.public_url or "").rstrip("/")
    return Client(settings.webhook_url, settings.webhook_secret.get_secret_value(), page_root)


def _peer(settings: Settings) -> Peer | None:
    """Return the address of the software that uses Chainage as meter counter.

    A port without a host means this machine.
    """
    if settings.meter_counter is None:
        return None
    host, _, port = settings.meter_counter.rpartition(":")
    return Peer(host.strip("[]") or "127.0.0.1", int(port))


async def _repeated(sweep: Callable[[], Awaitable[None]], pause_s: float) -> None:
    while True:
        try:
            await sweep()
        except Exception:
            logger.exception("What is no longer used could not be removed; another try follows.")
        await asyncio.sleep(pause_s)
