"""The photos of each observation: original pictures of frames, found by presentation time.

The tables say which photos are missing, so nothing is lost when the server ends. One thread makes
them; a request for a photo waits briefly for it.
"""

from __future__ import annotations

import hashlib
import logging
from typing import Protocol, TypeVar

from app.errors import (
    AttachmentNotFound,
    BlobChanged,
    BlobNotFound,
    DamagedTrack,
    DiskFull,
    ObservationNotFound,
    PhotoNotFound,
    StoreUnavailable,
)
from app.jobs.track.parts import NOT_RECORDED
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs, Readable, StoredBlob, as_stored
from app.storage.database.tables import ENDED, Inspection
from app.storage.records.attachments import AttachmentStore
from app.storage.records.inspections import InspectionStore
from app.storage.records.observations import ObservationStore
from app.storage.storage import Storage
from app.survey.distances.track_rows import estimate_at
from app.survey.observations.attachments import Attachment
from app.survey.observations.records import Observation
from app.tracking.live import Event, FindingsChanged, Live, Update, WallChanged
from app.tracking.pictures.film_files import FilmFiles
from app.tracking.pictures.media import Media
from app.tracking.pictures.videos import NO_FILM
from app.tracking.tracks import Tracks
from app.tracking.worker import InspectionWorker
from vo_core.errors import ChainageError

logger = logging.getLogger(__name__)

_WAIT_FOR_PHOTO_S = 3.0
_STOP_TIMEOUT_S = 40.0


Photographed = Observation | Attachment
"""What has a photo: an observation, or a picture attached to one."""

Row = TypeVar("Row", Observation, Attachment)


class Ledger(Protocol[Row]):
    """A table that says which photos are missing."""

    def get(self, inspection_id: str, row_id: str, /) -> Row:
        """Return a row."""

    def inspections_without_photos(self) -> list[str]:
        """Return the ids of inspections that lack a photo."""

    def without_photo(self, inspection_id: str, /) -> list[Row]:
        """Return the rows whose photo is neither made nor given up."""

    def record_photo(self, shown: Row, sha256: str, /) -> None:
        """Record the photo of a row."""

    def record_photo_error(self, shown: Row, error: str, /) -> None:
        """Record why a row has no photo."""


class Photos(InspectionWorker):
    """Makes missing photos and finds existing ones."""

    def __init__(
        self,
        storage: Storage,
        observations: ObservationStore,
        media: Media,
        tracks: Tracks,
        live: Live,
    ) -> None:
        super().__init__("photos", stop_timeout_s=_STOP_TIMEOUT_S)
        self._inspections = InspectionStore(storage.database)
        self._observations = observations
        self._attachments = AttachmentStore(storage.database)
        self._blobs = storage.blobs
        self._films = FilmFiles(storage.blobs, storage.folder)
        self._media = media
        self._tracks = tracks
        self._live = live

    def start(self) -> None:
        """Make also the photos that the server left missing when it ended."""
        missing = self._observations.inspections_without_photos()
        attached = self._attachments.inspections_without_photos()
        for inspection_id in dict.fromkeys((*missing, *attached)):
            self.announce(inspection_id)
        super().start()

    def on_event(self, event: Event) -> None:
        """Handle an event: a tag or the end of a track may allow more photos."""
        if isinstance(event, WallChanged | FindingsChanged):
            return
        if isinstance(event, Update) and event.state not in ENDED:
            return
        self.announce(event.inspection_id)

    def wait_for(self, inspection_id: str, observation_id: str) -> None:
        """Wait briefly until the photo of an observation is made or has failed."""
        self._wait_for(self._observations, inspection_id, observation_id)

    def wait_for_attached(self, inspection_id: str, attachment_id: str) -> None:
        """Wait briefly until an attached picture is made or has failed."""
        self._wait_for(self._attachments, inspection_id, attachment_id)

    def _wait_for(self, ledger: Ledger[Row], inspection_id: str, row_id: str) -> None:
        with self._changed:
            self._changed.wait_for(
                lambda: self._is_settled(ledger, inspection_id, row_id), _WAIT_FOR_PHOTO_S
            )

    def _is_settled(self, ledger: Ledger[Row], inspection_id: str, row_id: str) -> bool:
        try:
            row = ledger.get(inspection_id, row_id)
        except (ObservationNotFound, AttachmentNotFound):
            return True
        if row.photo_error is not None or row.is_photographed:
            return True
        return row.frame >= len(self._tracks.get(inspection_id))  # not before it is tracked

    def jpeg(self, row: Photographed) -> bytes:
        """Return the photo of an observation or an attachment.

        Raises:
            PhotoNotFound: There is no photo, or only that of an earlier frame.
            BlobChanged: Its file is not the one that was stored.
        """
        if not row.has_photo:
            raise PhotoNotFound(row.photo_error or "The photo is not made yet.")
        try:
            return photo_of(self._blobs, row).read_bytes()
        except BlobChanged:
            raise
        except BlobNotFound as error:
            raise PhotoNotFound("The file of this photo is missing in the server's store.") from (
                error
            )

    def _look_at(self, inspection_id: str) -> None:
        """Make the photos that are missing."""
        inspection = self._inspections.get(inspection_id)
        try:
            self._make_all(inspection, self._observations)
            self._make_all(inspection, self._attachments)
        except DamagedTrack as damage:  # the end of another run looks at it again
            logger.warning("Photos of inspection %s: %s", inspection_id, damage)

    def _make_all(self, inspection: Inspection, ledger: Ledger[Row]) -> None:
        for row in ledger.without_photo(inspection.id):
            if self._stopping:
                return
            self._make(inspection, ledger, row)

    def _make(self, inspection: Inspection, ledger: Ledger[Row], row: Row) -> None:
        estimate = estimate_at(self._tracks.get(inspection.id), row.frame)
        if estimate is None and inspection.status not in ENDED:
            return  # its time is known once its frame is tracked
        if not inspection.has_film:
            ledger.record_photo_error(row, NO_FILM)
        elif estimate is None:
            ledger.record_photo_error(
                row, "This frame was not tracked, so its picture cannot be found."
            )
        elif not self._tracks.is_recorded(inspection.id, row.frame):
            ledger.record_photo_error(row, NOT_RECORDED)
        else:
            self._cut(inspection, ledger, row, estimate.time_s)
        with self._changed:
            self._changed.notify_all()

    def _cut(self, inspection: Inspection, ledger: Ledger[Row], row: Row, time_s: float) -> None:
        # Looked up anew: a recording becomes another file when it ends.
        inspection = self._inspections.get(inspection.id)
        try:
            with self._films.film_of(inspection).local() as video:
                jpeg = self._media.picture(video, time_s, may_begin_anew=inspection.may_begin_anew)
            self._blobs.put(keys.photo(inspection.id, row.id, row.frame), jpeg)
        except (DiskFull, StoreUnavailable):
            raise  # it can be made later
        except ChainageError as failure:
            ledger.record_photo_error(row, str(failure))
        else:
            ledger.record_photo(row, hashlib.sha256(jpeg).hexdigest())


def photo_of(blobs: Blobs, row: Photographed) -> Readable:
    """Return the photo of an observation or an attachment, which may be missing."""
    stored = StoredBlob(blobs, keys.photo(row.inspection_id, row.id, row.frame))
    return as_stored(stored, row.photo_sha256)
