"""Inspections: made from an upload or a file, listed, renamed, deleted."""

from __future__ import annotations

import json
import logging
import secrets
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

from app.errors import FrameNotFound
from app.jobs.messages import Probed
from app.services.live import Live, Progress
from app.services.media import Media
from app.services.tracking import Tracking, track_metadata
from app.services.tracks import Tracks, estimate_at, since
from app.services.uploads import Uploads
from app.storage.files import (
    DataFolder,
    copy_durably,
    move_durably,
    sha256_of,
    sync_folder,
    write_durably,
)
from app.storage.inspections import InspectionStore, Summary
from app.storage.tables import ENDED, Inspection
from vo_core import Estimate, Rig

logger = logging.getLogger(__name__)

_KINDS = {
    # FFmpeg's name of the container: suffix of our file, type that we serve it as
    "mp4": (".mp4", "video/mp4"),
    "webm": (".webm", "video/webm"),
    "matroska": (".mkv", "video/x-matroska"),
    "avi": (".avi", "video/x-msvideo"),
    "mpegts": (".ts", "video/mp2t"),
    "mpeg": (".mpg", "video/mpeg"),
}
_WEBM_CODECS = {"vp8", "vp9", "av1", "libdav1d"}
_BROWSERS_PLAY = {"mp4": {"h264", *_WEBM_CODECS}, "webm": _WEBM_CODECS}
_FRAME_JPEG_QUALITY = 80
_BROWSERS_SHOW = {"yuv420p", "yuvj420p"}


@dataclass(frozen=True)
class InspectionView:
    """An inspection with what is counted and measured about it."""

    row: Inspection
    progress: Progress
    distance_mm: float | None
    sigma_distance_mm: float | None
    defects: int
    worst_severity: int | None


class Inspections:
    """The list of inspections and what may be done with one, besides tracking it."""

    def __init__(
        self,
        store: InspectionStore,
        folder: DataFolder,
        media: Media,
        uploads: Uploads,
        tracks: Tracks,
        tracking: Tracking,
        live: Live,
    ) -> None:
        self._store = store
        self._folder = folder
        self._media = media
        self._uploads = uploads
        self._tracks = tracks
        self._tracking = tracking
        self._live = live

    def create_from_upload(
        self,
        name: str,
        upload_id: str,
        rig: Mapping[str, Any],
        header: Mapping[str, Any],
        who: str,
    ) -> str:
        """Make an inspection of a complete upload and queue it; its id.

        If it cannot be made, the upload stays for another try.

        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no file to work on.
            InvalidRig: The text names field, value and what is allowed.
            UnreadableVideo: The file is not a video that can be tracked.
            RigVideoMismatch: The rig's camera has pictures of another size.
        """
        checked = Rig.parse(dict(rig))
        with self._uploads.take(upload_id) as (path, info):
            return self._create(name, path, info.filename, checked, header, who, move_durably)

    def import_video(
        self, path: Path, rig: Rig, name: str, header: Mapping[str, Any] | None = None
    ) -> str:
        """Copy a video file of this machine into a new inspection and queue it; its id.

        Raises:
            UnreadableVideo: The file is not a video that can be tracked.
            RigVideoMismatch: The rig's camera has pictures of another size.
        """
        self._folder.require_room(path.stat().st_size)
        return self._create(name, path, path.name, rig, header or {}, "chainage", copy_durably)

    def _create(
        self,
        name: str,
        source: Path,
        filename: str,
        rig: Rig,
        header: Mapping[str, Any],
        who: str,
        bring: Callable[[Path, Path], None],
    ) -> str:
        probed = self._media.probe(source, filename)
        rig.require_picture_size(probed.width, probed.height)
        kind = _kind_of(probed)
        suffix, media_type = _KINDS[kind]
        rig_fields = rig.model_dump(mode="json")
        inspection = Inspection(
            id=secrets.token_hex(16),
            name=name,
            status="queued",
            rig=rig_fields,
            header=dict(header),
            source_kind="upload",
            source_filename=filename,
            source_size=source.stat().st_size,
            source_sha256=sha256_of(source),
            video_file=f"video{suffix}",
            video=msgspec.structs.asdict(probed)
            | {"media_type": media_type, "playable": _is_playable(kind, probed)},
            frames_done=0,
            created_at=datetime.now(UTC),
            queued_at=datetime.now(UTC),
        )
        place = self._folder.inspection(inspection.id)
        place.mkdir()
        sync_folder(place.parent)
        write_durably(place / "rig.json", json.dumps(rig_fields, indent=2).encode())
        bring(source, place / inspection.video_file)
        self._store.add(inspection, who)
        logger.info("Inspection %s (%s) made from %s.", inspection.id, name, filename)
        self._tracking.wake()
        return inspection.id

    def all(self) -> list[InspectionView]:
        """All, the newest first."""
        return [self._view(summary) for summary in self._store.summaries()]

    def get(self, inspection_id: str) -> InspectionView:
        """One.

        Raises:
            InspectionNotFound: There is none of this id.
        """
        return self._view(self._store.summary(inspection_id))

    def row(self, inspection_id: str) -> Inspection:
        """Only what is stored.

        Raises:
            InspectionNotFound: There is none of this id.
        """
        return self._store.get(inspection_id)

    def video_path(self, inspection: Inspection) -> Path:
        """The original file."""
        return self._folder.inspection(inspection.id) / inspection.video_file

    def track_as(self, inspection_id: str, kind: str, first: int) -> tuple[str, str]:
        """The track from frame `first` on as csv, tum or json, with its media type."""
        row = self.row(inspection_id)
        track = since(self._tracks.get(inspection_id), first)
        if kind == "tum":
            return track.to_tum(), "text/plain; charset=utf-8"
        if kind == "json":
            return track.to_json(track_metadata(row)), "application/json"
        return track.to_csv(track_metadata(row)), "text/csv; charset=utf-8"

    def last_estimate(self, inspection_id: str) -> Estimate | None:
        """Of the newest tracked frame."""
        track = self._tracks.get(inspection_id)
        return estimate_at(track, len(track) - 1)

    def picture(self, inspection_id: str, frame: int) -> bytes:
        """A tracked frame as JPEG.

        Raises:
            FrameNotFound: It is not tracked, so the time of its picture is not known.
        """
        row = self.row(inspection_id)
        estimate = estimate_at(self._tracks.get(inspection_id), frame)
        if estimate is None:
            raise FrameNotFound(f"Frame {frame} is not tracked, so its picture cannot be found.")
        return self._media.picture(self.video_path(row), estimate.time_s, _FRAME_JPEG_QUALITY)

    def change(
        self, inspection_id: str, who: str, name: str | None, header: Mapping[str, Any] | None
    ) -> InspectionView:
        """Give another name or another header; None leaves it as it is."""
        self._store.change(inspection_id, who, name, header)
        return self.get(inspection_id)

    def delete(self, inspection_id: str, who: str) -> None:
        """Stop it and remove it with all its files; the record of events stays."""
        if self.row(inspection_id).status not in ENDED:
            self._tracking.cancel(inspection_id)
        self._store.delete(inspection_id, who)
        self._tracks.forget(inspection_id)
        self._live.publish(inspection_id, "cancelled", Progress(0, None, None, None))
        with suppress(FileNotFoundError):
            shutil.rmtree(self._folder.inspection(inspection_id))
        logger.info("Inspection %s deleted by %s.", inspection_id, who)

    def _view(self, summary: Summary) -> InspectionView:
        row = summary.row
        progress = self._tracking.progress(row.id)
        last = self._tracking.last_estimate(row.id)
        total = row.frames_done if row.status == "done" else row.video.get("frames")
        return InspectionView(
            row=row,
            progress=progress or Progress(row.frames_done, total, row.fps, None),
            distance_mm=last.distance_mm if last else row.distance_mm,
            sigma_distance_mm=last.sigma_distance_mm if last else row.sigma_distance_mm,
            defects=summary.defects,
            worst_severity=summary.worst_severity,
        )


def _kind_of(probed: Probed) -> str:
    """Which of our kinds FFmpeg's demuxer stands for; its names are lists such as `mov,mp4,m4a`."""
    names = set(probed.container.split(","))
    if "webm" in names:  # FFmpeg has one demuxer for both
        return "webm" if probed.codec in _WEBM_CODECS else "matroska"
    return next(kind for kind in _KINDS if kind in names)


def _is_playable(kind: str, probed: Probed) -> bool:
    """Whether browsers play the original; otherwise single frames are shown."""
    return probed.codec in _BROWSERS_PLAY.get(kind, ()) and probed.pixel_format in _BROWSERS_SHOW
