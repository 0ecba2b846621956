"""Builds the services, starts them in order, and stops them in reverse order."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from functools import partial

from app.access.access import Access
from app.access.holders import Holders
from app.alerts.webhook import Client, Webhook
from app.archive.archive import Archive
from app.archive.inbox import Inbox
from app.archive.intake import Intake
from app.data_folder import Records, issuing
from app.errors import DiskFull
from app.inspections.aiming import Aiming
from app.inspections.attachments import Attachments
from app.inspections.checks import Checks
from app.inspections.corrections import Corrections
from app.inspections.counters import Counters
from app.inspections.file_reader import CPU_S, FileReader
from app.inspections.films import Films
from app.inspections.imports import Imports
from app.inspections.inspections import Inspections
from app.inspections.keeping import Keeper
from app.inspections.lenses import CPU_S as LENS_CPU_S
from app.inspections.lenses import Lenses
from app.inspections.moved import MovedInspections
from app.inspections.observations import Observations
from app.inspections.packs import Packs
from app.inspections.picking import Picking
from app.inspections.preferences import Preferences
from app.inspections.presence import Presence
from app.inspections.register import Register
from app.inspections.reviews import Reviews
from app.inspections.rigs import Rigs
from app.inspections.samples import Samples
from app.inspections.scaling import Scaling
from app.inspections.uploads import Uploads
from app.jobs.messages import Limits
from app.meter_counter.line import MeterCounter, Peer
from app.ops.health import Health
from app.ops.memory import give_back
from app.ops.metrics import Metrics, WatchedServices
from app.reports.bulk import BulkExports
from app.reports.reports import Reports
from app.reports.templates import ReportTemplates
from app.search.asset_map import AssetMaps, Background
from app.search.export import ArchiveExport
from app.search.indexer import IndexWorker
from app.search.search import Search
from app.settings import Settings
from app.storage.archive.changes import ArchiveChanges
from app.storage.archive.films import ArchiveFilms
from app.storage.archive.intake import IntakeStore
from app.storage.archive.rules import RuleStore
from app.storage.blobs.blobs import Blobs
from app.storage.blobs.stores import blobs_at
from app.storage.database.database import Database, require_its_database, stored_at
from app.storage.database.dialect import Dialect
from app.storage.folder.files import DataFolder
from app.storage.folder.tokens import TokenFile
from app.storage.folder.unfinished import Unfinished
from app.storage.index.asset_index import AssetIndex
from app.storage.index.asset_places import AssetPlaces
from app.storage.index.inspection_list import InspectionList
from app.storage.records.access import AccessStore
from app.storage.records.alerts import AlertStore
from app.storage.records.assets import AssetStore
from app.storage.records.imports import ImportStore
from app.storage.records.preferences import PreferenceStore
from app.storage.records.rigs import RigStore
from app.storage.records.runs import RunStore
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
from app.tracking.tracks import Tracks
from app.tracking.unrolled import Unrolled
from app.viewer.clicks import Clicks
from app.viewer.scenes import SWEEP_S, Scenes
from app.watched import Watched

logger = logging.getLogger(__name__)

_EXPIRY_SWEEP_S = 600.0
_GIVE_BACK_S = 60.0
_THREADS = 32


@dataclass(frozen=True)
class Services:
    """Everything that routers may call."""

    access: Access
    holders: Holders
    archive: Archive
    uploads: Uploads
    aiming: Aiming
    inspections: Inspections
    films: Films
    imports: Imports
    tracking: Tracking
    sources: Sources
    tracks: Tracks
    unrolled: Unrolled
    observations: Observations
    attachments: Attachments
    corrections: Corrections
    checks: Checks
    counters: Counters
    counter_queue: CounterQueue
    photos: Photos
    clips: Clips
    thumbnails: Thumbnails
    media: Media
    packs: Packs
    rigs: Rigs
    register: Register
    lenses: Lenses
    preferences: Preferences
    samples: Samples
    reports: Reports
    report_templates: ReportTemplates
    bulk_exports: BulkExports
    reviews: Reviews
    search: Search
    asset_maps: AssetMaps
    archive_export: ArchiveExport
    live: Live
    scenes: Scenes
    clicks: Clicks
    picking: Picking
    presence: Presence
    webhook: Webhook
    meter_counter: MeterCounter
    health: Health
    metrics: Metrics


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
        services = await asyncio.to_thread(_start, settings, stored, stack)
        sweeps = [
            asyncio.create_task(_repeated(services.scenes.sweep, SWEEP_S)),
            asyncio.create_task(
                _repeated(partial(asyncio.to_thread, services.uploads.expire), _EXPIRY_SWEEP_S)
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
            await services.scenes.close()
            await asyncio.to_thread(stack.close)


def _start(settings: Settings, stored: Dialect | None, stack: ExitStack) -> Services:
    """Build and start the services; `stack` stops them, even if a later step fails."""
    folder = DataFolder(
        settings.data,
        reserve_bytes=settings.disk_reserve_bytes,
        is_shared=settings.database is not None,
    )
    stack.callback(folder.close)
    blobs = blobs_at(settings.store, folder.root, scratch_bytes=settings.scratch_bytes)
    with suppress(DiskFull):  # what is stored can be read
        blobs.check()
    film_files = FilmFiles(blobs, folder)
    if stored is None:
        stored = stored_at(settings.database_url, folder.root)
    require_its_database(stored, folder)
    metrics = Metrics(f"{stored.kind} {stored.version()}")
    database = Database(stored, on_write=metrics.count_write)
    stack.callback(database.close)
    client = _client(settings)
    live = Live()
    company = issuing(settings)
    records = Records(database, folder, blobs, live, company, has_webhook=client is not None)
    tracks = records.tracks
    uploads = Uploads(
        folder, max_bytes=settings.max_upload_bytes, expiry_s=settings.upload_expiry_h * 3600
    )
    import_store = ImportStore(database)
    unfinished = Unfinished(folder, blobs, import_store.has_known)
    unfinished.delete_all()
    keeper = Keeper(import_store, folder, blobs, tracks, unfinished)
    media = Media(Limits(settings.child_memory_bytes, reads=(*folder.media, *blobs.media)))
    stack.callback(media.close)
    child_limits = Limits(settings.child_memory_bytes, round(settings.job_cpu_h * 3600))
    run_store = RunStore(database)
    runs = Runs(tracks, records.unrolled, live)
    stack.enter_context(live.listening(None, metrics.on_event))
    run_files = RunFiles(folder, blobs, tracks, limits=child_limits, stall_s=settings.stall_s)
    engine = _engine(settings, folder, blobs, film_files, records, runs, run_files, child_limits)
    tracking = Tracking(
        records.inspection_store,
        run_store,
        film_files,
        tracks,
        runs,
        live,
        run_files,
        engine,
    )
    photos = Photos(
        records.inspection_store,
        records.observation_store,
        records.attachment_store,
        blobs,
        film_files,
        media,
        tracks,
        live,
    )
    stack.enter_context(live.listening(None, photos.on_event))
    photos.start()
    stack.callback(photos.stop)
    counter_queue = CounterQueue(
        records.inspection_store,
        film_files,
        records.counter_files,
        limits=child_limits,
        # The workers of a cluster have processors of their own.
        has_others=run_store.are_queued if settings.dask is None else lambda: False,
    )
    stack.enter_context(live.listening(None, counter_queue.on_event))
    counter_queue.start()
    stack.callback(counter_queue.stop)
    stack.enter_context(live.listening(None, tracking.on_event))
    tracking.start()
    stack.callback(tracking.stop)
    recorder = Recorder(
        records.inspection_store,
        run_store,
        folder,
        blobs,
        film_files,
        tracks,
        runs,
        live,
        tracking,
        memory_bytes=settings.child_memory_bytes,
        reserve_bytes=settings.disk_reserve_bytes,
    )
    stack.callback(recorder.stop)
    sources = Sources(settings.camera_networks, settings.watch_folder)
    scaling = Scaling(records.correction_store, tracks, records.corrections)
    stack.enter_context(live.listening(None, scaling.on_event))
    scaling.start()
    stack.callback(scaling.stop)
    index_worker = IndexWorker(records.indexer)
    stack.enter_context(live.listening(None, index_worker.on_event))
    inspections = Inspections(
        records.inspection_store,
        InspectionList(database),
        records.label_store,
        folder,
        blobs,
        film_files,
        media,
        tracks,
        records.corrections,
        runs,
        tracking,
        live,
    )
    register = Register(AssetStore(database))
    films = Films(
        inspections,
        register,
        records.inspection_store,
        run_store,
        folder,
        blobs,
        film_files,
        media,
        uploads,
        tracks,
        records.corrections,
        tracking,
        sources,
        recorder,
        records.observation_store,
        records.counter_files,
    )
    intake = Intake(IntakeStore(database), films, tracking, records.packs, folder, engine)
    stack.enter_context(live.listening(None, intake.on_event))
    archive_films = ArchiveFilms(database)
    archive_changes = ArchiveChanges(database)
    archive_rules = RuleStore(database)
    inboxes = []
    if settings.inbox is not None:
        inboxes.append(
            Inbox(
                archive_films,
                archive_changes,
                archive_rules,
                intake,
                settings.inbox,
                settle_s=settings.inbox_settle_s,
            )
        )
    archive = Archive(
        archive_films,
        archive_changes,
        archive_rules,
        tracking,
        runs,
        intake,
        folders=settings.archive_folders,
        engine=engine,
    )
    samples = Samples(folder, blobs, inspections, films, records.observations)
    stack.callback(samples.stop)
    picking = Picking(records.inspection_store, tracks, records.corrections)
    scenes = Scenes(
        inspections,
        records.corrections,
        records.observations,
        records.unrolled,
        live,
        records.packs,
        picking,
    )
    alert_store = AlertStore(database)
    webhook = Webhook(client, alert_store, inspections, records.observations, records.packs)
    stack.enter_context(live.listening(None, webhook.on_event))
    meter_counter = MeterCounter(_peer(settings), records.corrections)
    stack.enter_context(live.listening(None, meter_counter.on_event))
    recorder.start()
    for service in (index_worker, webhook, meter_counter, intake, *inboxes):
        service.start()
        stack.callback(service.stop)
    metrics.observe(
        WatchedServices(
            records.inspection_store, folder, runs, media, recorder, scenes, alert_store
        )
    )
    token = settings.token.get_secret_value() if settings.token else folder.kept_token()
    access_store, token_file = AccessStore(database), TokenFile(folder.root)
    clips = Clips(
        records.inspection_store,
        records.observation_store,
        blobs,
        film_files,
        tracks,
        Limits(settings.child_memory_bytes, CLIP_CPU_S),
    )
    bulk_exports = BulkExports(records.inspection_store, records.reports, clips.content_of, folder)
    bulk_exports.start()
    stack.callback(bulk_exports.stop)
    threads: tuple[Watched, ...] = (
        database.writer, *tracking.threads, photos, counter_queue, scaling, index_worker, intake,
        *inboxes, webhook, meter_counter, bulk_exports,
    )  # fmt: skip
    return Services(
        access=Access(access_store, token_file, token),
        holders=Holders(access_store, token_file, token),
        archive=archive,
        uploads=uploads,
        aiming=Aiming(uploads, media, counter_queue),
        inspections=inspections,
        films=films,
        imports=Imports(
            FileReader(Limits(settings.child_memory_bytes, CPU_S, reads=())),
            keeper,
            MovedInspections(
                keeper, folder, blobs, media, records.packs, records.report_templates, live
            ),
            uploads,
        ),
        tracking=tracking,
        sources=sources,
        tracks=tracks,
        unrolled=records.unrolled,
        observations=records.observations,
        attachments=records.attachments,
        corrections=records.corrections,
        checks=records.checks,
        counters=records.counters,
        counter_queue=counter_queue,
        photos=photos,
        clips=clips,
        thumbnails=Thumbnails(
            records.inspection_store,
            records.observation_store,
            records.attachment_store,
            blobs,
            film_files,
            media,
        ),
        media=media,
        packs=records.packs,
        rigs=Rigs(RigStore(database)),
        register=register,
        lenses=Lenses(uploads, Limits(settings.child_memory_bytes, LENS_CPU_S)),
        preferences=Preferences(PreferenceStore(database)),
        samples=samples,
        reports=records.reports,
        report_templates=records.report_templates,
        bulk_exports=bulk_exports,
        reviews=Reviews(records.inspection_store, records.review_store, live),
        archive_export=records.archive_export,
        asset_maps=AssetMaps(
            AssetPlaces(database), Background(settings.map_tiles, settings.map_attribution)
        ),
        search=Search(
            records.defect_index, AssetIndex(database), records.label_store, index_worker
        ),
        live=live,
        scenes=scenes,
        clicks=Clicks(),
        picking=picking,
        presence=Presence(),
        webhook=webhook,
        meter_counter=meter_counter,
        health=Health(database, folder, blobs, media, tracking, threads),
        metrics=metrics,
    )


def _engine(
    settings: Settings,
    folder: DataFolder,
    blobs: Blobs,
    film_files: FilmFiles,
    records: Records,
    runs: Runs,
    run_files: RunFiles,
    limits: Limits,
) -> Engine:
    """Return what tracks the films: the cluster that is set, or else this machine."""
    if settings.dask is None:
        return Pool(
            folder,
            blobs,
            film_files,
            records.tracks,
            records.unrolled,
            runs,
            slots=settings.max_jobs,
            limits=limits,
            stall_s=settings.stall_s,
            pace=settings.pace,
        )
    cluster = Cluster(settings.dask, settings.dask_ca, settings.dask_cert, settings.dask_key)
    return DaskEngine(cluster, Store(settings.store, str(folder.root)), run_files, runs)


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
