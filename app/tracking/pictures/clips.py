"""The clip of some seconds around each observation, cut by presentation time in a child process.

A clip is made when somebody wants it, and kept: it can be made again at any time.
"""

from __future__ import annotations

import logging
import threading

import msgspec

from app.errors import Busy, FrameNotFound, MediaFailed, MediaTimeout, NothingRecorded
from app.jobs.messages import Clip, ClipRequest, FromClipper, Limits
from app.jobs.process import Child, describe_exit
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs, StoredBlob
from app.storage.records.inspections import InspectionStore
from app.storage.records.observations import ObservationStore
from app.survey.track_rows import estimate_at
from app.tracking.pictures.film_files import FilmFiles
from app.tracking.pictures.videos import NO_FILM
from app.tracking.tracks import Tracks
from vo_core.errors import UnreadableVideo

logger = logging.getLogger(__name__)

BEFORE_S, AFTER_S = 3.0, 3.0
CPU_S = 180
"""Processor time limit; six seconds of a 4K film take about a third of it on a slow machine."""
_ANSWER_TIMEOUT_S = 240.0
_WAIT_FOR_TURN_S = 60.0


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
        self._turn = threading.Lock()
        self._answers = msgspec.msgpack.Decoder(FromClipper)

    def of(self, inspection_id: str, observation_id: str) -> StoredBlob:
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
        with self._films.of(inspection).local() as video:
            start_s = max(estimate.time_s - BEFORE_S, 0.0)
            end_s = estimate.time_s + AFTER_S
            request = ClipRequest(
                str(video), start_s, end_s, self._limits, inspection.may_begin_anew
            )
            self._cut(clip, request)
        return clip

    def content_of(self, inspection_id: str, observation_id: str) -> bytes:
        """Return the same clip as bytes; raises the same errors."""
        return self.of(inspection_id, observation_id).read_bytes()

    def _cut(self, clip: StoredBlob, request: ClipRequest) -> None:
        if not self._turn.acquire(timeout=_WAIT_FOR_TURN_S):
            raise Busy("Other clips are being cut; try again in a moment.")
        try:
            if not clip.exists():  # somebody else has waited for the same one
                self._blobs.put(clip.key, self._checked(self._exchange(request)))
        finally:
            self._turn.release()

    def _exchange(self, request: ClipRequest) -> bytes:
        child = Child("app.jobs.requests.clipper")
        try:
            child.send(request)
            return child.receive(_ANSWER_TIMEOUT_S)
        except TimeoutError as error:
            raise MediaTimeout("Cutting the clip took too long and was stopped.") from error
        except (EOFError, OSError) as error:
            how = describe_exit(child.end())
            raise MediaFailed(f"The process that cut the clip died: {how}.") from error
        finally:
            child.kill()

    def _checked(self, answer: bytes) -> bytes:
        try:
            message = self._answers.decode(answer)
        except msgspec.MsgspecError as error:
            raise MediaFailed("The process that cut the clip gave an invalid answer.") from error
        if isinstance(message, Clip):
            return message.mp4
        if message.code == "unreadable_video":
            raise UnreadableVideo(message.detail)
        logger.error("Clip: %s %s", message.detail, message.trace)
        raise MediaFailed(message.detail)
