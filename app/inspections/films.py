"""The films of inspections: uploaded, recorded, continued, ended, and tracked with another rig."""

from __future__ import annotations

import json
import logging
import secrets
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from app.errors import (
    DiskFull,
    LiveSourceRefused,
    NoLongerWanted,
    NotAllTracked,
    NothingRecorded,
    OpenStretches,
    StillRunning,
    StoreUnavailable,
)
from app.inspections.corrections import Corrections
from app.inspections.inspections import Inspections
from app.inspections.register import Register
from app.inspections.uploads import Uploads
from app.jobs.track import parts
from app.jobs.track.parts import Between, Mark
from app.settings import MIB
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.storage.database.tables import ENDED, Inspection
from app.storage.folder.files import DataFolder, copy_durably, sha256_of, sync_folder, write_durably
from app.storage.records.inspections import InspectionStore, require_unlocked
from app.storage.records.observations import ObservationStore
from app.storage.records.runs import RunStore
from app.survey.stretches import open_stretches
from app.tracking.cameras import Sources
from app.tracking.films.queue import Tracking
from app.tracking.pictures.counter_files import SEARCHED, CounterFiles, KeptCounter
from app.tracking.pictures.film_files import FilmFiles
from app.tracking.pictures.media import Media
from app.tracking.pictures.videos import file_name, unrecorded_columns, video_columns
from app.tracking.recorder import Recorder
from app.tracking.tracks import Tracks
from vo_core import Rig
from vo_core.geometry.rectify import require_wall_in_view

logger = logging.getLogger(__name__)

DESK_PRIORITY = 10
"""Priority of what people at the desk wait for; that of films of the archive is lower."""
Add = Callable[[Inspection, str], None]
"""Adds a new inspection to the database, for a person named by the second argument."""
_LEAST_ROOM_TO_RECORD = 64 * MIB


class Films:
    """Makes an inspection of each new film, and a further run of an existing one."""

    def __init__(
        self,
        inspections: Inspections,
        register: Register,
        store: InspectionStore,
        run_store: RunStore,
        folder: DataFolder,
        blobs: Blobs,
        film_files: FilmFiles,
        media: Media,
        uploads: Uploads,
        tracks: Tracks,
        corrections: Corrections,
        tracking: Tracking,
        sources: Sources,
        recorder: Recorder,
        observations: ObservationStore,
        counters: CounterFiles,
    ) -> None:
        self._inspections = inspections
        self._register = register
        self._store = store
        self._run_store = run_store
        self._folder = folder
        self._blobs = blobs
        self._film_files = film_files
        self._media = media
        self._uploads = uploads
        self._tracks = tracks
        self._corrections = corrections
        self._tracking = tracking
        self._sources = sources
        self._recorder = recorder
        self._observations = observations
        self._counters = counters
        self._recording_on = threading.Lock()

    def create_from_upload(
        self,
        name: str,
        upload_id: str,
        rig: Mapping[str, Any],
        header: Mapping[str, Any],
        who: str,
        counter: KeptCounter = SEARCHED,
    ) -> str:
        """Make an inspection of a complete upload, queue it and return its id.

        If that fails, the upload stays for another try.

        Args:
            name, rig, header, who: Of the inspection.
            upload_id: Of the film.
            counter: What a person has stated about the burnt-in counter.
        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            InvalidRig: The text names field, value and the allowed values.
            UnreadableVideo: The file is not a video that can be tracked.
            RigVideoMismatch: The rig's camera has another picture size.
            PixelOutsidePicture: The box of the counter is not in the picture.
        """
        checked = _checked(rig)
        with self._uploads.take(upload_id) as (path, info):
            return self._create(name, path, info.filename, checked, header, who, counter)

    def import_video(
        self, path: Path, rig: Rig, name: str, header: Mapping[str, Any] | None = None
    ) -> str:
        """Copy a video file of this machine into a new inspection, queue it and return its id.

        Raises:
            UnreadableVideo: The file is not a video that can be tracked.
            RigVideoMismatch: The rig's camera has another picture size.
        """
        self._folder.require_room(path.stat().st_size)
        copy = self._folder.inspections / f"{secrets.token_hex(16)}.import"
        try:
            copy_durably(path, copy)  # the media process reads nothing outside the data folder
            return self._create(name, copy, path.name, rig, header or {}, "chainage")
        finally:
            copy.unlink(missing_ok=True)

    def create_from_copy(
        self,
        inspection_id: str,
        copy: Path,
        filename: str,
        rig: Mapping[str, Any],
        add: Add,
        *,
        name: str,
        header: Mapping[str, Any],
        who: str,
        priority: int,
    ) -> None:
        """Make the inspection of this id of a file in the data folder, which becomes its film, and
        queue it; what an interrupted try left of it is removed.

        Args:
            inspection_id: Id that no inspection in the database has.
            copy: The file.
            filename: Name of the film.
            rig, name, header, who, priority: Of the inspection.
            add: Adds it to the database.
        Raises:
            InvalidRig: The text names field, value and the allowed values.
            UnreadableVideo: The file is not a video that can be tracked.
            RigVideoMismatch: The rig's camera has another picture size.
        """
        self._blobs.delete_all(keys.inspection(inspection_id))
        self._create(
            name, copy, filename, _checked(rig), header, who,
            inspection_id=inspection_id, priority=priority, add=add,
        )  # fmt: skip

    def _create(
        self,
        name: str,
        source: Path,
        filename: str,
        rig: Rig,
        header: Mapping[str, Any],
        who: str,
        counter: KeptCounter = SEARCHED,
        *,
        inspection_id: str | None = None,
        priority: int = DESK_PRIORITY,
        add: Add | None = None,
    ) -> str:
        probed = self._media.probe(source, filename)
        rig.require_picture_size(probed.width, probed.height)
        counter.require_picture_size(probed.width, probed.height)
        inspection = self._new_inspection(
            name,
            rig,
            header,
            id=inspection_id or secrets.token_hex(16),
            status="queued",
            priority=priority,
            source_kind="upload",
            source_filename=filename,
            source_size=source.stat().st_size,
            source_sha256=sha256_of(source),
            video_file=file_name(probed),
            video=video_columns(probed),
        )
        with self._removed_unless_added(inspection):
            self._keep_rig(inspection.id, inspection.rig)
            self._blobs.adopt(keys.film(inspection.id, inspection.video_file), source)
            self._counters.put(inspection.id, counter)
            (add or self._store.add)(inspection, who)
        logger.info("Inspection %s (%s) made from %s.", inspection.id, name, filename)
        self._tracking.wake()
        return inspection.id

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
        checked = _checked(rig)
        width, height = checked.camera.width, checked.camera.height
        source = self._sources.resolve(url, (width, height))
        self._folder.require_room(_LEAST_ROOM_TO_RECORD)
        inspection = self._new_inspection(
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
        with self._removed_unless_added(inspection):
            self._make_place(inspection.id)
            self._keep_rig(inspection.id, inspection.rig)
            self._store.add(inspection, who)
        logger.info("Inspection %s (%s) made from %s.", inspection.id, name, source.shown)
        self._recorder.begin(inspection, source)
        return inspection.id

    def _new_inspection(
        self, name: str, rig: Rig, header: Mapping[str, Any], **source: Any
    ) -> Inspection:
        """Return a new inspection, whose header has what the register knows of its asset."""
        return Inspection(
            name=name,
            rig=rig.model_dump(mode="json"),
            header=self._register.completed(header),
            frames_done=0,
            created_at=datetime.now(UTC),
            queued_at=datetime.now(UTC),
            **source,
        )

    @contextmanager
    def _removed_unless_added(self, inspection: Inspection) -> Iterator[None]:
        """Remove the blobs of a new inspection again if the block fails."""
        try:
            yield
        except (OSError, DiskFull, StoreUnavailable, NoLongerWanted):
            with suppress(OSError, StoreUnavailable):
                self._blobs.delete_all(keys.inspection(inspection.id))
            raise

    def _make_place(self, inspection_id: str) -> None:
        """Make the folder in which a recording grows, unless it exists."""
        place = self._folder.inspection(inspection_id)
        place.mkdir(exist_ok=True)
        sync_folder(place.parent)

    def _keep_rig(self, inspection_id: str, rig: Mapping[str, Any]) -> None:
        """Store the rig beside the film; the database has it too."""
        self._blobs.put(keys.rig(inspection_id), json.dumps(rig, indent=2).encode())

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
            self._record_on(self._inspections.row(inspection_id), url, between, who)

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
        film = self._film_files.of(row)
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

    def finish(
        self,
        inspection_id: str,
        who: str,
        end_condition: str,
        abandon_reason: str | None,
        known_length_m: float | None,
    ) -> None:
        """State how the run ended; a live inspection ends and can then be reviewed.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            OpenStretches: A stretch has no finish; the text names it.
        """
        self._inspections.row(inspection_id)  # raises unless it exists
        still_open = open_stretches(self._observations.listed(inspection_id))
        if still_open:
            raise OpenStretches(
                f"Started and not finished: {', '.join(still_open)}. Finish them first."
            )
        stated: dict[str, Any] = {"end_condition": end_condition}
        if abandon_reason is not None:
            stated["abandon_reason"] = abandon_reason
        if known_length_m is not None:
            stated["known_length_m"] = known_length_m
        self._inspections.finish(inspection_id, who, stated)
        self._recorder.finish(inspection_id)

    def track_with(self, inspection_id: str, rig: Mapping[str, Any], who: str) -> None:
        """Track all frames again, with this rig; tags stay.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            StillRunning: It is queued or running.
            NothingRecorded: There is no film.
            InvalidRig: The text names field, value and the allowed values.
            RigVideoMismatch: The rig's camera has another picture size.
        """
        row = self._inspections.row(inspection_id)
        checked = _checked(rig)
        checked.require_picture_size(row.video["width"], row.video["height"])
        self._tracking.require_film(row)
        stated = checked.model_dump(mode="json")
        self._run_store.change_rig(inspection_id, who, stated)
        self._keep_rig(inspection_id, stated)
        self._corrections.forget(inspection_id)
        self._tracking.queued(inspection_id)
        logger.info("Inspection %s is tracked again for %s.", inspection_id, who)


def _checked(rig: Mapping[str, Any]) -> Rig:
    """Parse a stated rig; raise InvalidRig if its camera cannot see the wall."""
    checked = Rig.parse(dict(rig))
    require_wall_in_view(checked)
    return checked
