"""A small picture of each inspection: the photo of its worst defect, else a frame of its film.

It is made when somebody wants it, and kept: it can be made again at any time.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from app.errors import BlobNotFound, DiskFull, InspectionNotFound, PhotoNotFound
from app.storage.blobs import keys
from app.storage.database.tables import Inspection
from app.storage.records.attachments import AttachmentStore
from app.storage.records.inspections import InspectionStore
from app.storage.records.observations import ObservationStore
from app.storage.storage import Storage
from app.survey.observations.attachments import Attachment
from app.survey.observations.records import Observation
from app.tracking.pictures.film_files import FilmFiles
from app.tracking.pictures.media import Media
from app.tracking.pictures.photos import photo_of
from app.tracking.pictures.videos import NO_FILM
from vo_core.errors import UnreadableVideo

WIDTH_PX = 240
_JPEG_QUALITY = 80


@dataclass(frozen=True)
class Shown:
    """What the thumbnail of an inspection shows now."""

    inspection: Inspection
    photo: Observation | Attachment | None
    """None for a frame of the film."""

    @property
    def name(self) -> str:
        """Name that differs for every other picture."""
        if self.photo is None:
            return f"film-{self.inspection.source_sha256[:16]}"
        return f"{self.photo.id}-{self.photo.frame}"


class Thumbnails:
    """Makes thumbnails, and keeps them as blobs."""

    def __init__(self, storage: Storage, observations: ObservationStore, media: Media) -> None:
        self._inspections = InspectionStore(storage.database)
        self._observations = observations
        self._attachments = AttachmentStore(storage.database)
        self._blobs = storage.blobs
        self._films = FilmFiles(storage.blobs, storage.folder)
        self._media = media

    def shown(self, inspection_id: str) -> Shown:
        """Return what the thumbnail shows.

        Raises:
            InspectionNotFound: No inspection has this id.
            PhotoNotFound: There is neither a photo nor a film, or it is still being recorded.
        """
        inspection = self._inspections.get(inspection_id)
        photo = worst_photographed(
            self._observations.listed(inspection_id), self._attachments.listed(inspection_id)
        )
        if photo is None and not inspection.has_film:
            raise PhotoNotFound(NO_FILM)
        if photo is None and not inspection.source_sha256:
            raise PhotoNotFound("The film is still being recorded, and there is no photo yet.")
        return Shown(inspection, photo)

    def jpeg(self, shown: Shown) -> bytes:
        """Return the thumbnail as JPEG.

        Raises:
            InspectionNotFound: The inspection was deleted meanwhile.
            PhotoNotFound: The file of the photo or the film is missing.
            UnreadableVideo, MediaFailed, MediaTimeout: It cannot be decoded.
            Busy: Many pictures are being read from films.
        """
        key = keys.thumbnail(shown.inspection.id, shown.name)
        if self._blobs.exists(key):
            return self._blobs.get(key)
        try:
            whole = self._picture(shown)
            jpeg = self._media.reduced(whole, WIDTH_PX, _JPEG_QUALITY)
        except BlobNotFound as error:
            raise PhotoNotFound("The file of this picture is missing.") from error
        with suppress(DiskFull):  # it is made once more
            self._blobs.put_again(key, jpeg)
        try:
            self._inspections.get(shown.inspection.id)
        except InspectionNotFound:  # its files are gone, and this one must not stay behind
            self._blobs.delete(key)
            raise
        return jpeg

    def _picture(self, shown: Shown) -> bytes:
        if shown.photo is not None:
            return photo_of(self._blobs, shown.photo).read_bytes()
        # The middle of the film: at its beginning the robot is often outside the culvert.
        middle_s = (shown.inspection.video.get("duration_s") or 0.0) / 2
        inspection = shown.inspection
        with self._films.film_of(inspection).local() as video:
            try:
                return self._media.picture(
                    video, middle_s, may_begin_anew=inspection.may_begin_anew
                )
            except UnreadableVideo:  # it begins later than its middle, or is one picture
                return self._media.picture(video, None)


def worst_photographed(
    observations: Sequence[Observation], attachments: Sequence[Attachment]
) -> Observation | Attachment | None:
    """Return the source of the worst photographed observation's photo.

    Args:
        observations: Those of an inspection, by their numbers.
        attachments: Those of the same inspection.
    """
    pictures = defaultdict(list)
    for attachment in attachments:
        if attachment.has_photo:
            pictures[attachment.observation_id].append(attachment)
    worst_first = sorted(
        observations,
        key=lambda one: -1 if one.tag.severity is None else one.tag.severity,
        reverse=True,
    )
    return next((main for one in worst_first if (main := _main(one, pictures[one.id]))), None)


def _main(
    observation: Observation, pictures: Sequence[Attachment]
) -> Observation | Attachment | None:
    """Return the photo of lowest rank; the observation's own one is the first of rank 0."""
    before = [one for one in pictures if one.rank < 0 or not observation.has_photo]
    if before:
        return min(before, key=lambda one: one.rank)
    return observation if observation.has_photo else None
