"""Inspections: created from an upload or a file, listed, renamed, deleted."""

from __future__ import annotations

import json
import logging
import secrets
import shutil
import threading
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import (
    DiskFull,
    FrameNotFound,
    LiveSourceRefused,
    NotAllTracked,
    NothingRecorded,
    OpenStretches,
    StillRunning,
)
from app.inspections.corrections import Corrections
from app.inspections.uploads import Uploads
from app.jobs import parts
from app.jobs.parts import NOT_RECORDED, Between, Mark
from app.settings import MIB
from app.storage.files import (
    RECORDING,
    DataFolder,
    copy_durably,
    move_durably,
    sha256_of,
    sync_folder,
    write_durably,
)
from app.storage.inspections import InspectionStore, Summary
from app.storage.observations import ObservationStore
from app.storage.runs import RunStore
from app.storage.tables import ENDED, Inspection
from app.survey.stretches import open_stretches
from app.survey.track_rows import estimate_at, since
from app.survey.versions import require_version, version_of
from app.tracking.cameras import Sources
from app.tracking.live import CameraStatus, Live, Progress
from app.tracking.media import Media
from app.tracking.queue import Tracking, track_metadata
from app.tracking.recorder import Recorder
from app.tracking.runs import Runs
from app.tracking.tracks import Tracks
from app.tracking.videos import NO_FILM, file_name, unrecorded_columns, video_columns
from vo_core import Estimate, Rig, Track
from vo_core.geometry.rectify import require_wall_in_view

logger = logging.getLogger(__name__)

_FRAME_JPEG_QUALITY = 80
_LEAST_ROOM_TO_RECORD = 64 * MIB


@dataclass(frozen=True)
class InspectionView:
    """An inspection with its counts and measurements."""

    row: Inspection
    progress: Progress
    distance_mm: float | None
    """Corrected distance of the last frame; its standard deviation follows."""
    sigma_distance_mm: float | None
    raw_distance_mm: float | None
    is_corrected: bool
    defects: int
    worst_severity: int | None
    camera: CameraStatus | None
    """State of the camera during a recording."""
    warning: str | None
    """A sentence about a fault of the video or the run, or about why its end is delayed."""

    @property
    def version(self) -> str:
        """Version of name and header."""
        return version_of(self.row.editable())


class Inspections:
    """Lists inspections and changes them, except for tracking."""

    def __init__(
        self,
        store: InspectionStore,
        run_store: RunStore,
        folder: DataFolder,
        media: Media,
        uploads: Uploads,
        tracks: Tracks,
        corrections: Corrections,
        runs: Runs,
        tracking: Tracking,
        sources: Sources,
        recorder: Recorder,
        observations: ObservationStore,
        live: Live,
    ) -> None:
        self._store = store
        self._run_store = run_store
        self._folder = folder
        self._media = media
        self._uploads = uploads
        self._tracks = tracks
        self._corrections = corrections
        self._runs = runs
        self._tracking = tracking
        self._sources = sources
        self._recorder = recorder
        self._observations = observations
        self._live = live
        self._recording_on = threading.Lock()

    def create_from_upload(
        self,
        name: str,
        upload_id: str,
        rig: Mapping[str, Any],
        header: Mapping[str, Any],
        who: str,
    ) -> str:
        """Make an inspection of a complete upload, queue it and return its id.

        If that fails, the upload stays for another try.

        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            InvalidRig: The text names field, value and the allowed values.
            UnreadableVideo: The file is not a video that can be tracked.
            RigVideoMismatch: The rig's camera has another picture size.
        """
        checked = Rig.parse(dict(rig))
        require_wall_in_view(checked)
        with self._uploads.take(upload_id) as (path, info):
            return self._create(name, path, info.filename, checked, header, who)

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
        checked = Rig.parse(dict(rig))
        require_wall_in_view(checked)
        width, height = checked.camera.width, checked.camera.height
        source = self._sources.resolve(url, (width, height))
        self._folder.require_room(_LEAST_ROOM_TO_RECORD)
        inspection = _new_inspection(
            name,
            checked,
            header,
            status="running",
            source_kind="live",
            source_filename=source.shown,
            source_size=0,
            source_sha256="",
            video_file=RECORDING,
            video=unrecorded_columns(width, height),
        )
        try:
            self._make_place(inspection)
            self._store.add(inspection, who)
        except (OSError, DiskFull):
            shutil.rmtree(self._folder.inspection(inspection.id), ignore_errors=True)
            raise
        logger.info("Inspection %s (%s) made from %s.", inspection.id, name, source.shown)
        self._recorder.begin(inspection, source)
        return inspection.id

    def finish(
        self,
        inspection_id: str,
        who: str,
        end_condition: str,
        abandon_reason: str | None,
        known_length_m: float | None,
    ) -> InspectionView:
        """State how the run ended; a live inspection ends and can then be reviewed.

        Raises:
            InspectionNotFound: No inspection has this id.
            OpenStretches: A stretch has no finish; the text names it.
        """
        self._store.get(inspection_id)
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
        self._store.finish(inspection_id, who, stated)
        self._recorder.finish(inspection_id)
        return self.get(inspection_id)

    def track_with(self, inspection_id: str, rig: Mapping[str, Any], who: str) -> InspectionView:
        """Track all frames again, with this rig; tags stay.

        Raises:
            InspectionNotFound: No inspection has this id.
            StillRunning: It is queued or running.
            NothingRecorded: There is no film.
            InvalidRig: The text names field, value and the allowed values.
            RigVideoMismatch: The rig's camera has another picture size.
        """
        row = self.row(inspection_id)
        checked = Rig.parse(dict(rig))
        require_wall_in_view(checked)
        checked.require_picture_size(row.video["width"], row.video["height"])
        self._tracking.require_film(row)
        stated = checked.model_dump(mode="json")
        self._run_store.change_rig(inspection_id, who, stated)
        write_durably(
            self._folder.inspection(inspection_id) / "rig.json",
            json.dumps(stated, indent=2).encode(),
        )
        self._corrections.forget(inspection_id)
        self._tracking.queued(inspection_id)
        logger.info("Inspection %s is tracked again for %s.", inspection_id, who)
        return self.get(inspection_id)

    def record_on(self, inspection_id: str, url: str, between: Between, who: str) -> InspectionView:
        """Continue the recording of a camera as its next part; every frame keeps its number.

        Args:
            inspection_id: A live inspection that has ended.
            url: The camera, possibly at a new address.
            between: The robot's movement since then.
            who: Name for the history.
        Raises:
            InspectionNotFound: No inspection has this id.
            StillRunning: It is queued or running.
            NothingRecorded: The inspection never was live, or has no film.
            NotAllTracked: The track ends before the film.
            LiveSourceRefused: The server does not open this source, or the source has an end.
            DiskFull: There is no room for another part.
            MediaFailed: The film cannot be converted into a recording.
        """
        with self._recording_on:  # the film becomes a recording once only
            return self._record_on(self.row(inspection_id), url, between, who)

    def _record_on(self, row: Inspection, url: str, between: Between, who: str) -> InspectionView:
        inspection_id = row.id
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
        video, recording = self.video_path(row), self._folder.recording(inspection_id)
        if video != recording:
            self._recorder.reopen(video, recording)
        parts.append(
            self._folder.marks(inspection_id), [Mark(len(track), float(track.time_s[-1]), between)]
        )
        values = {
            "source_filename": source.shown,
            "video_file": RECORDING,
            "video": unrecorded_columns(*size_wh),
        }
        try:
            row = self._run_store.record_on(inspection_id, who, between, values)
        except DiskFull:
            if video != recording:
                recording.unlink()
            raise
        if video != recording:
            video.unlink()
        logger.info("Inspection %s is continued by %s.", inspection_id, who)
        self._recorder.begin(row, source, between)
        return self.get(inspection_id)

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

    def _create(
        self,
        name: str,
        source: Path,
        filename: str,
        rig: Rig,
        header: Mapping[str, Any],
        who: str,
    ) -> str:
        probed = self._media.probe(source, filename)
        rig.require_picture_size(probed.width, probed.height)
        inspection = _new_inspection(
            name,
            rig,
            header,
            status="queued",
            source_kind="upload",
            source_filename=filename,
            source_size=source.stat().st_size,
            source_sha256=sha256_of(source),
            video_file=file_name(probed),
            video=video_columns(probed),
        )
        video = self._folder.inspection(inspection.id) / inspection.video_file
        try:
            self._make_place(inspection)
            move_durably(source, video)
            self._store.add(inspection, who)
        except (OSError, DiskFull):
            if not source.exists():
                move_durably(video, source)
            shutil.rmtree(video.parent, ignore_errors=True)
            raise
        logger.info("Inspection %s (%s) made from %s.", inspection.id, name, filename)
        self._tracking.wake()
        return inspection.id

    def _make_place(self, inspection: Inspection) -> None:
        """Make the inspection's folder, with the rig."""
        place = self._folder.inspection(inspection.id)
        place.mkdir()
        sync_folder(place.parent)
        write_durably(place / "rig.json", json.dumps(inspection.rig, indent=2).encode())

    def all(self) -> list[InspectionView]:
        """Return all inspections, the newest first."""
        return [self._view(summary) for summary in self._store.summaries()]

    def get(self, inspection_id: str) -> InspectionView:
        """Return the inspection with this id.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        return self._view(self._store.summary(inspection_id))

    def row(self, inspection_id: str) -> Inspection:
        """Return the stored row only.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        return self._store.get(inspection_id)

    def video_path(self, inspection: Inspection) -> Path:
        """Return the original file, or the recording so far.

        Raises:
            NothingRecorded: The camera delivered no picture, or the survey was imported.
        """
        if not inspection.has_film:
            raise NothingRecorded(NO_FILM)
        path = self._folder.inspection(inspection.id) / inspection.video_file
        if not path.exists():
            raise NothingRecorded("The camera delivered no picture, so there is no video.")
        return path

    def track_as(self, inspection_id: str, kind: str, first: int) -> tuple[str, str]:
        """Return the corrected track from frame `first` on as csv, tum or json, with its media
        type.
        """
        metadata = dict(track_metadata(self.row(inspection_id)))
        metadata |= self._corrections.adjusted(inspection_id).metadata()
        track = since(self._corrections.track(inspection_id), first)
        raw_mm = since(self._tracks.get(inspection_id), first).distance_mm[: len(track)]
        return _written(track, kind, metadata, distance_raw_mm=raw_mm)

    def raw_track_as(self, inspection_id: str, kind: str, first: int) -> tuple[str, str]:
        """Return the raw track from frame `first` on, in the same formats."""
        metadata = track_metadata(self.row(inspection_id))
        return _written(since(self._tracks.get(inspection_id), first), kind, metadata)

    def last_estimate(self, inspection_id: str) -> Estimate | None:
        """Return the corrected estimate of the newest tracked frame."""
        track = self._tracks.get(inspection_id)
        return estimate_at(track, len(track) - 1)

    def picture(self, inspection_id: str, frame: int) -> bytes:
        """Return a tracked frame as JPEG.

        Raises:
            FrameNotFound: The frame is not tracked, so its time is unknown.
        """
        row = self.row(inspection_id)
        estimate = estimate_at(self._tracks.get(inspection_id), frame)
        if estimate is None:
            raise FrameNotFound(f"Frame {frame} is not tracked, so its picture cannot be found.")
        if not self._tracks.is_recorded(inspection_id, frame):
            raise FrameNotFound(NOT_RECORDED)
        return self._media.picture(self.video_path(row), estimate.time_s, _FRAME_JPEG_QUALITY)

    def change(
        self,
        inspection_id: str,
        who: str,
        name: str | None,
        header: Mapping[str, Any] | None,
        *,
        replaced: str | None = None,
    ) -> InspectionView:
        """Replace the name or the header; None keeps it.

        Raises:
            InspectionNotFound: No inspection has this id.
            PackNotFound: The header names a code pack that does not exist.
            ChangedMeanwhile: Their version is no longer `replaced`; nothing was stored.
        """

        def require(stored: Mapping[str, Any]) -> None:
            sent = {"name": name, "header": None if header is None else dict(header)}
            yours = {**stored, **{key: value for key, value in sent.items() if value is not None}}
            require_version(stored, yours, replaced)

        self._store.change(inspection_id, who, name, header, require)
        return self.get(inspection_id)

    def delete(self, inspection_id: str, who: str) -> None:
        """Stop an inspection and delete it with all its files; its events stay."""
        if self.row(inspection_id).status not in ENDED:
            self._tracking.cancel(inspection_id)
        self._store.delete(inspection_id, who)
        self._tracks.forget(inspection_id)
        self._corrections.forget(inspection_id)
        self._live.publish(inspection_id, "cancelled", Progress(0, None, None, None))
        with suppress(FileNotFoundError):
            shutil.rmtree(self._folder.inspection(inspection_id))
        logger.info("Inspection %s deleted by %s.", inspection_id, who)

    def _view(self, summary: Summary) -> InspectionView:
        row = summary.row
        progress = self._runs.progress(row.id)
        last = self._runs.last_estimate(row.id)
        end: tuple[float | None, float | None]
        if last is not None:
            corrected = self._corrections.estimate(row.id, last)
            end = (corrected.distance_mm, corrected.sigma_distance_mm)
        else:
            end = self._corrections.end(row) or (None, None)
        is_running = row.status == "running"
        total = row.frames_done if row.status == "done" else row.video.get("frames")
        return InspectionView(
            row=row,
            progress=progress or Progress(row.frames_done, total, row.fps, None),
            distance_mm=end[0],
            sigma_distance_mm=end[1],
            is_corrected=self._corrections.is_stated(row),
            raw_distance_mm=last.distance_mm if last else row.distance_mm,
            defects=summary.defects,
            worst_severity=summary.worst_severity,
            camera=self._runs.camera(row.id) if is_running else None,
            warning=(self._runs.hindrance(row.id) if is_running else None) or row.warning,
        )


def _new_inspection(name: str, rig: Rig, header: Mapping[str, Any], **source: Any) -> Inspection:
    return Inspection(
        id=secrets.token_hex(16),
        name=name,
        rig=rig.model_dump(mode="json"),
        header=dict(header),
        frames_done=0,
        created_at=datetime.now(UTC),
        queued_at=datetime.now(UTC),
        **source,
    )


def _written(
    track: Track, kind: str, metadata: Mapping[str, object], **lengths_mm: NDArray[np.float64]
) -> tuple[str, str]:
    """Write a track as csv, tum or json, with its media type; only json takes further columns."""
    if kind == "tum":
        return track.to_tum(), "text/plain; charset=utf-8"
    if kind == "json":
        return track.to_json(metadata, lengths_mm=lengths_mm), "application/json"
    return track.to_csv(metadata), "text/csv; charset=utf-8"
