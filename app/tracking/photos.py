"""The photo of each observation: the original picture of its frame, found by presentation time.

The table says which photos are missing, so nothing is lost when the server ends. One thread makes
them; a request for a photo waits briefly for it.
"""

from __future__ import annotations

import hashlib
import logging

from app.errors import (
    BlobNotFound,
    DiskFull,
    InspectionNotFound,
    ObservationNotFound,
    PhotoNotFound,
    StoreUnavailable,
)
from app.jobs.parts import NOT_RECORDED
from app.logs import about
from app.storage import keys
from app.storage.blobs import Blobs
from app.storage.inspections import InspectionStore
from app.storage.observations import ObservationStore
from app.storage.tables import ENDED, Inspection
from app.survey.records import Observation
from app.survey.track_rows import estimate_at
from app.tracking.film_files import FilmFiles
from app.tracking.live import Event, Live, Update, WallChanged
from app.tracking.media import Media
from app.tracking.tracks import Tracks
from app.tracking.videos import NO_FILM
from app.tracking.worker import Worker
from vo_core.errors import ChainageError

logger = logging.getLogger(__name__)

_WAIT_FOR_PHOTO_S = 3.0
_PAUSE_AFTER_FAULT_S = 5.0
_STOP_TIMEOUT_S = 40.0


class Photos(Worker):
    """Makes missing photos and finds existing ones."""

    def __init__(
        self,
        inspections: InspectionStore,
        observations: ObservationStore,
        blobs: Blobs,
        films: FilmFiles,
        media: Media,
        tracks: Tracks,
        live: Live,
    ) -> None:
        super().__init__("photos", stop_timeout_s=_STOP_TIMEOUT_S)
        self._inspections = inspections
        self._observations = observations
        self._blobs = blobs
        self._films = films
        self._media = media
        self._tracks = tracks
        self._live = live
        self._dirty: set[str] = set()
        """Inspections that may lack photos; the event of a new photo adds its own as well."""

    def take_over(self) -> None:
        """Make the photos that a server which has ended left missing."""
        missing = self._observations.inspections_without_photos()
        with self._changed:
            self._dirty.update(missing)
            self._changed.notify_all()

    def on_event(self, event: Event) -> None:
        """Handle an event: a tag or the end of a track may allow more photos."""
        if isinstance(event, WallChanged):
            return
        if isinstance(event, Update) and event.state not in ENDED:
            return
        with self._changed:
            self._dirty.add(event.inspection_id)
            self._changed.notify_all()

    def wait_for(self, inspection_id: str, observation_id: str) -> None:
        """Wait briefly until the photo of an observation is made or has failed."""
        with self._changed:
            self._changed.wait_for(
                lambda: self._is_settled(inspection_id, observation_id), _WAIT_FOR_PHOTO_S
            )

    def _is_settled(self, inspection_id: str, observation_id: str) -> bool:
        try:
            row = self._observations.get(inspection_id, observation_id)
        except ObservationNotFound:
            return True
        if row.photo_error is not None or row.is_photographed:
            return True
        return row.frame >= len(self._tracks.get(inspection_id))  # not before it is tracked

    def jpeg(self, row: Observation) -> bytes:
        """Return the photo of an observation.

        Raises:
            PhotoNotFound: There is no photo, or only that of an earlier frame.
        """
        if not row.has_photo:
            raise PhotoNotFound(row.photo_error or "The photo is not made yet.")
        try:
            return self._blobs.get(keys.photo(row.inspection_id, row.id, row.frame))
        except BlobNotFound as error:
            raise PhotoNotFound("The file of this photo is missing in the server's store.") from (
                error
            )

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._stopping or self._dirty)
                if self._stopping:
                    return
                inspection_id = self._dirty.pop()
            try:
                with about(inspection_id):
                    self._make_missing(inspection_id)
            except (DiskFull, StoreUnavailable) as hindrance:
                logger.warning("Photos of inspection %s wait: %s", inspection_id, hindrance)
                self._try_later(inspection_id)
            except Exception:
                logger.exception("Photos of inspection %s could not be made.", inspection_id)
                self._try_later(inspection_id)

    def _try_later(self, inspection_id: str) -> None:
        with self._changed:
            self._dirty.add(inspection_id)
        self._pause(_PAUSE_AFTER_FAULT_S)

    def _make_missing(self, inspection_id: str) -> None:
        try:
            inspection = self._inspections.get(inspection_id)
        except InspectionNotFound:
            return
        for row in self._observations.without_photo(inspection_id):
            if self._stopping:
                return
            self._make(inspection, row)

    def _make(self, inspection: Inspection, row: Observation) -> None:
        estimate = estimate_at(self._tracks.get(inspection.id), row.frame)
        if estimate is None and inspection.status not in ENDED:
            return  # its time is known once its frame is tracked
        if not inspection.has_film:
            self._observations.record_photo_error(row, NO_FILM)
        elif estimate is None:
            self._observations.record_photo_error(
                row, "This frame was not tracked, so its picture cannot be found."
            )
        elif not self._tracks.is_recorded(inspection.id, row.frame):
            self._observations.record_photo_error(row, NOT_RECORDED)
        else:
            self._cut(inspection, row, estimate.time_s)
        with self._changed:
            self._changed.notify_all()

    def _cut(self, inspection: Inspection, row: Observation, time_s: float) -> None:
        # Looked up anew: a recording becomes another file when it ends.
        film = self._films.of(self._inspections.get(inspection.id))
        try:
            with film.local() as video:
                jpeg = self._media.picture(video, time_s)
            self._blobs.put(keys.photo(inspection.id, row.id, row.frame), jpeg)
        except (DiskFull, StoreUnavailable):
            raise  # it can be made later
        except ChainageError as failure:
            self._observations.record_photo_error(row, str(failure))
        else:
            self._observations.record_photo(row, hashlib.sha256(jpeg).hexdigest())
