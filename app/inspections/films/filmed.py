"""What the film of an inspection and its track show: the film itself, single frames, the rows."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from app.errors import FrameNotFound, NothingRecorded
from app.inspections.corrections import Corrections
from app.jobs.track.parts import NOT_RECORDED
from app.storage.blobs.blobs import StoredBlob
from app.storage.database.tables import Inspection
from app.storage.records.inspections import InspectionStore
from app.storage.storage import Storage
from app.survey.distances.track_rows import estimate_at, since
from app.tracking.films.runs import track_metadata
from app.tracking.pictures.film_files import FilmFiles
from app.tracking.pictures.media import Media
from app.tracking.pictures.videos import NO_FILM
from app.tracking.tracks import Tracks
from vo_core import Track

_FRAME_JPEG_QUALITY = 80


class Filmed:
    """Reads films and tracks."""

    def __init__(
        self, storage: Storage, media: Media, tracks: Tracks, corrections: Corrections
    ) -> None:
        self._store = InspectionStore(storage.database)
        self._films = FilmFiles(storage.blobs, storage.folder)
        self._media = media
        self._tracks = tracks
        self._corrections = corrections

    def inspection(self, inspection_id: str) -> Inspection:
        """Return the stored row.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        return self._store.get(inspection_id)

    def film(self, inspection: Inspection) -> StoredBlob:
        """Return the original film, or the recording so far.

        Raises:
            NothingRecorded: The camera delivered no picture, or the survey was imported.
        """
        if not inspection.has_film:
            raise NothingRecorded(NO_FILM)
        film = self._films.film_of(inspection)
        if not film.exists():
            raise NothingRecorded("The camera delivered no picture, so there is no video.")
        return film

    def track_as(self, inspection_id: str, kind: str, first: int) -> tuple[str, str]:
        """Return the corrected track from frame `first` on as csv, tum or json, with its media
        type.
        """
        metadata = dict(track_metadata(self._store.get(inspection_id)))
        metadata |= self._corrections.adjusted(inspection_id).metadata()
        track = since(self._corrections.track(inspection_id), first)
        raw_mm = since(self._tracks.get(inspection_id), first).distance_mm[: len(track)]
        return _written(track, kind, metadata, distance_raw_mm=raw_mm)

    def raw_track_as(self, inspection_id: str, kind: str, first: int) -> tuple[str, str]:
        """Return the raw track from frame `first` on, in the same formats."""
        metadata = track_metadata(self._store.get(inspection_id))
        return _written(since(self._tracks.get(inspection_id), first), kind, metadata)

    def picture(self, inspection_id: str, frame: int) -> bytes:
        """Return a tracked frame as JPEG.

        Raises:
            FrameNotFound: The frame is not tracked, so its time is unknown.
        """
        row = self._store.get(inspection_id)
        estimate = estimate_at(self._tracks.get(inspection_id), frame)
        if estimate is None:
            raise FrameNotFound(f"Frame {frame} is not tracked, so its picture cannot be found.")
        if not self._tracks.is_recorded(inspection_id, frame):
            raise FrameNotFound(NOT_RECORDED)
        with self.film(row).local() as video:
            return self._media.picture(
                video,
                estimate.time_s,
                _FRAME_JPEG_QUALITY,
                may_begin_anew=row.may_begin_anew,
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
