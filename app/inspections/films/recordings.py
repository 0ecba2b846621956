"""Recordings of cameras as inspections: begun, and continued as a further part."""

from __future__ import annotations

import logging
import secrets
import threading
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from app.errors import (
    DiskFull,
    LiveSourceRefused,
    NotAllTracked,
    NothingRecorded,
    StillRunning,
    StoreUnavailable,
)
from app.inspections.films.making import NewInspections, checked_rig, keep_rig
from app.inspections.register import Register
from app.jobs.track import parts
from app.jobs.track.parts import Between, Mark
from app.settings import MIB
from app.storage.blobs import keys
from app.storage.database.tables import ENDED, Inspection
from app.storage.folder.files import sync_folder, write_durably
from app.storage.records.inspections import InspectionStore, require_unlocked
from app.storage.records.runs import RunStore
from app.storage.storage import Storage
from app.tracking.cameras import Sources
from app.tracking.films.queue import Tracking
from app.tracking.pictures.film_files import FilmFiles
from app.tracking.pictures.videos import unrecorded_columns
from app.tracking.recorder import Recorder
from app.tracking.tracks import Tracks

logger = logging.getLogger(__name__)

_LEAST_ROOM_TO_RECORD = 64 * MIB


class Recordings:
    """Makes inspections of cameras, and continues them."""

    def __init__(
        self,
        storage: Storage,
        tracks: Tracks,
        register: Register,
        sources: Sources,
        recorder: Recorder,
        tracking: Tracking,
    ) -> None:
        self._store = InspectionStore(storage.database)
        self._run_store = RunStore(storage.database)
        self._folder = storage.folder
        self._blobs = storage.blobs
        self._film_files = FilmFiles(storage.blobs, storage.folder)
        self._new = NewInspections(storage.blobs, register)
        self._tracks = tracks
        self._sources = sources
        self._recorder = recorder
        self._tracking = tracking
        self._recording_on = threading.Lock()

    def create_live(
        self,
        name: str,
        url: str,
        rig: Mapping[str, Any],
        header: Mapping[str, Any],
        who: str,
    ) -> str:
        """Make an inspection of a live source, record and track it at once, and return its id.

        Raises:
            InvalidRig: The text names field, value and the allowed values.
            LiveSourceRefused: The server does not open this source.
            DiskFull: There is no room for a recording.
        """
        checked = checked_rig(rig)
        width, height = checked.camera.width, checked.camera.height
        source = self._sources.resolve(url, (width, height))
        self._folder.require_room(_LEAST_ROOM_TO_RECORD)
        inspection = self._new.new(
            name,
            checked,
            header,
            id=secrets.token_hex(16),
            status="running",
            source_kind="live",
            source_filename=source.shown,
            source_size=0,
            source_sha256="",
            video_file=keys.RECORDING,
            video=unrecorded_columns(width, height),
        )
        with self._new.removed_unless_added(inspection):
            self._make_place(inspection.id)
            keep_rig(self._blobs, inspection.id, inspection.rig)
            self._store.add(inspection, who)
        logger.info("Inspection %s (%s) made from %s.", inspection.id, name, source.shown)
        self._recorder.begin(inspection, source)
        return inspection.id

    def _make_place(self, inspection_id: str) -> None:
        """Make the folder in which a recording grows, unless it exists."""
        place = self._folder.inspection(inspection_id)
        place.mkdir(exist_ok=True)
        sync_folder(place.parent)

    def record_on(self, inspection_id: str, url: str, between: Between, who: str) -> None:
        """Continue the recording of a camera as its next part; every frame keeps its number.

        Args:
            inspection_id: A live inspection that has ended.
            url: The camera, possibly at a new address.
            between: The robot's movement since then.
            who: Name for the history.
        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            StillRunning: It is queued or running.
            NothingRecorded: The inspection never was live, or has no film.
            NotAllTracked: The track ends before the film.
            LiveSourceRefused: The server does not open this source, or the source has an end.
            DiskFull: There is no room for another part.
            MediaFailed: The film cannot be converted into a recording.
        """
        with self._recording_on:  # the film becomes a recording once only
            self._record_on(self._store.get(inspection_id), url, between, who)

    def _record_on(self, row: Inspection, url: str, between: Between, who: str) -> None:
        inspection_id = row.id
        require_unlocked(row)
        if row.status not in ENDED:
            raise StillRunning(f"The inspection is {row.status}; stop it first.")
        if row.source_kind != "live":
            raise NothingRecorded("Only a recording of a camera can be continued.")
        self._tracking.require_film(row)
        track = self._tracks.get(inspection_id)
        if not len(track) or len(track) != row.video.get("frames"):
            raise NotAllTracked("The film was not tracked to its end; track it again first.")
        size_wh = row.video["width"], row.video["height"]
        source = self._sources.resolve(url, size_wh)
        if source.camera.kind == "file":
            raise LiveSourceRefused(
                "A recorder's file is a separate film and cannot be the next part."
            )
        self._folder.require_room(_LEAST_ROOM_TO_RECORD)
        recording = self._folder.recording(inspection_id)
        film = self._film_files.film_of(row)
        self._make_place(inspection_id)
        with film.local() as video:
            is_recording = video == recording
            if not is_recording:
                self._recorder.reopen(video, recording)
        marks = [*self._tracks.marks(inspection_id)]
        marks.append(Mark(len(track), float(track.time_s[-1]), between))
        write_durably(self._folder.marks(inspection_id), parts.text_of(marks).encode())
        values = {
            "source_filename": source.shown,
            "video_file": keys.RECORDING,
            "video": unrecorded_columns(*size_wh),
        }
        try:
            row = self._run_store.record_on(inspection_id, who, between, values)
        except DiskFull:
            if not is_recording:
                recording.unlink()
            raise
        if not is_recording:
            with suppress(StoreUnavailable):  # it stays until the recording replaces it
                self._blobs.delete(film.key)
        logger.info("Inspection %s is continued by %s.", inspection_id, who)
        self._recorder.begin(row, source, between)
