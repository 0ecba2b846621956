"""The clip of some seconds around each observation, cut by presentation time in a child process.

A clip is made when somebody wants it, and kept: it can be made again at any time.
"""

from __future__ import annotations

from app.errors import FrameNotFound, NothingRecorded
from app.jobs.messages import Limits
from app.jobs.permits import Permits
from app.jobs.process import Child, ask_about_media
from app.jobs.requests.clipper import ClipRequest
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs, StoredBlob
from app.storage.records.inspections import InspectionStore
from app.storage.records.observations import ObservationStore
from app.survey.distances.track_rows import estimate_at
from app.tracking.pictures.film_files import FilmFiles
from app.tracking.pictures.videos import NO_FILM
from app.tracking.tracks import Tracks

BEFORE_S, AFTER_S = 3.0, 3.0
CPU_S = 180
"""Processor time limit; six seconds of a 4K film take about a third of it on a slow machine."""
_ANSWER_TIMEOUT_S = 240.0


class Clips:
    """Cuts clips, one at a time."""

    def __init__(
        self,
        inspections: InspectionStore,
        observations: ObservationStore,
        blobs: Blobs,
        films: FilmFiles,
        tracks: Tracks,
        limits: Limits,
    ) -> None:
        self._inspections = inspections
        self._observations = observations
        self._blobs = blobs
        self._films = films
        self._tracks = tracks
        self._limits = limits
        self._permits = Permits("Other clips are being cut; try again in a moment.")

    def clip(self, inspection_id: str, observation_id: str) -> StoredBlob:
        """Return the clip around an observation as MP4, which is cut unless it was before.

        Raises:
            InspectionNotFound, ObservationNotFound: There is none with this id.
            FrameNotFound: There is no film, or the frame is not tracked yet.
            NothingRecorded: The film is still being recorded.
            UnreadableVideo, MediaFailed, MediaTimeout: The film cannot be decoded there.
            Busy: Many clips are being cut.
        """
        inspection = self._inspections.get(inspection_id)
        row = self._observations.get(inspection_id, observation_id)
        if not inspection.has_film:
            raise FrameNotFound(NO_FILM)
        if not inspection.source_sha256:
            raise NothingRecorded("The film is still being recorded; a clip is cut when it ends.")
        key = keys.clip(inspection_id, row.id, row.frame, inspection.source_sha256)
        clip = StoredBlob(self._blobs, key)
        if clip.exists():
            return clip
        estimate = estimate_at(self._tracks.get(inspection_id), row.frame)
        if estimate is None:
            raise FrameNotFound(f"Frame {row.frame} is not tracked yet.")
        with self._films.film_of(inspection).local() as video:
            start_s = max(estimate.time_s - BEFORE_S, 0.0)
            end_s = estimate.time_s + AFTER_S
            request = ClipRequest(
                str(video), start_s, end_s, self._limits, inspection.may_begin_anew
            )
            self._cut(clip, request)
        return clip

    def content_of(self, inspection_id: str, observation_id: str) -> bytes:
        """Return the same clip as bytes; raises the same errors."""
        return self.clip(inspection_id, observation_id).read_bytes()

    def _cut(self, clip: StoredBlob, request: ClipRequest) -> None:
        with self._permits:
            if clip.exists():  # somebody else has waited for the same one
                return
            with Child("app.jobs.requests.clipper") as child:
                mp4 = ask_about_media(
                    child, request, bytes, work="Cutting the clip", stall_s=_ANSWER_TIMEOUT_S
                )
            self._blobs.put(clip.key, mp4)
