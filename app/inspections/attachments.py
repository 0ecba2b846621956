"""Attachments of observations: more photos, drawings on a copy of a photo, voice notes."""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime

from app.errors import AttachmentNotFound, FrameNotFound, InvalidRequest, WrongContentType
from app.inspections.observations import check_frame
from app.storage.blobs import keys
from app.storage.blobs.blobs import StoredBlob, as_stored
from app.storage.records.attachments import AttachmentStore
from app.storage.records.inspections import InspectionStore, require_unlocked
from app.storage.records.observations import ObservationStore
from app.storage.storage import Stored
from app.survey.observations.attachments import VOICE_SUFFIXES, Attachment, Picture
from app.tracking.live import Live
from app.tracking.pictures.videos import NO_FILM
from app.tracking.tracks import Tracks


class Attachments:
    """Stores, lists, deletes and restores attachments."""

    def __init__(
        self,
        stored: Stored,
        observations: ObservationStore,
        tracks: Tracks,
        live: Live,
    ) -> None:
        self._inspections = InspectionStore(stored.database)
        self._observations = observations
        self._store = AttachmentStore(stored.database)
        self._blobs = stored.blobs
        self._tracks = tracks
        self._live = live

    def all(self, inspection_id: str) -> list[Attachment]:
        """Return the attachments of an inspection in their order.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        self._inspections.get(inspection_id)
        return self._store.listed(inspection_id)

    def get(self, inspection_id: str, observation_id: str, attachment_id: str) -> Attachment:
        """Return an attachment of this observation that is not deleted.

        Raises:
            AttachmentNotFound: There is none, or it was deleted.
        """
        found = self._of(inspection_id, observation_id, attachment_id)
        if found.deleted_at is not None:
            raise AttachmentNotFound("This attachment was deleted; it can be restored.")
        return found

    def put_picture(
        self, inspection_id: str, observation_id: str, attachment_id: str, stated: Picture, who: str
    ) -> None:
        """Add a photo or a drawing, or change its rank and strokes; committed when this returns.

        Its frame stays: another frame is another attachment.

        Raises:
            InspectionNotFound, ObservationNotFound, TooManyAttachments: As they say.
            InspectionLocked: It is approved.
            FrameOutsideVideo: The film has no such frame.
            FrameNotFound: The film is not on this server.
            InvalidRequest: The attachment exists and is of another kind, frame or observation.
        """
        inspection = self._inspections.get(inspection_id)
        if not inspection.has_film:
            raise FrameNotFound(NO_FILM)
        check_frame(inspection, len(self._tracks.get(inspection_id)), stated.frame)
        self._put(
            Attachment(
                inspection_id=inspection_id,
                id=attachment_id,
                observation_id=observation_id,
                kind=stated.kind,
                rank=stated.rank,
                frame=stated.frame,
                strokes=tuple(stated.strokes),
                created_at=datetime.now(UTC),
                created_by=who,
            )
        )

    def put_voice(
        self,
        inspection_id: str,
        observation_id: str,
        attachment_id: str,
        sound: bytes,
        media_type: str,
        duration_s: float,
        who: str,
    ) -> None:
        """Add a voice note; it is stored and committed when this returns.

        Args:
            inspection_id, observation_id, attachment_id: The note.
            sound: The file of a browser's recorder.
            media_type: Its type; parameters, such as codecs, are ignored.
            duration_s: How long it is.
            who: Name for the history.
        Raises:
            InspectionNotFound, ObservationNotFound, TooManyAttachments: As they say.
            InspectionLocked: It is approved.
            WrongContentType: No recorder gives this type.
            InvalidRequest: It is empty, or exists with another sound.
        """
        require_unlocked(self._inspections.get(inspection_id))
        frame = self._observations.get(inspection_id, observation_id).frame
        plain = media_type.partition(";")[0].strip().lower()
        if plain not in VOICE_SUFFIXES:
            raise WrongContentType(f"A voice note is one of {', '.join(VOICE_SUFFIXES)}.")
        if not sound:
            raise InvalidRequest("The voice note is empty.")
        note = Attachment(
            inspection_id=inspection_id,
            id=attachment_id,
            observation_id=observation_id,
            kind="voice",
            rank=0,
            frame=frame,
            media_type=plain,
            duration_s=duration_s,
            size=len(sound),
            sha256=hashlib.sha256(sound).hexdigest(),
            created_at=datetime.now(UTC),
            created_by=who,
        )
        self._require_same(note)
        # Before the row, so that no row ever names a file that was not stored.
        self._blobs.put(_voice_key(note), sound)
        self._put(note)

    def voice(self, note: Attachment) -> StoredBlob:
        """Return the file of a voice note, which may be missing.

        Raises:
            AttachmentNotFound: The attachment is a picture.
            BlobChanged: The file is not the one that was stored.
        """
        if note.kind != "voice":
            raise AttachmentNotFound("This attachment is a picture, not a voice note.")
        stored = StoredBlob(self._blobs, _voice_key(note))
        as_stored(stored, note.sha256).read_bytes()
        return stored

    def delete(self, inspection_id: str, observation_id: str, attachment_id: str, who: str) -> None:
        """Delete an attachment; it can be restored, and may be deleted again.

        Raises:
            AttachmentNotFound: The observation never had it.
        """
        self._of(inspection_id, observation_id, attachment_id)
        if self._store.delete(inspection_id, attachment_id, who):
            self._live.observations_changed(inspection_id)

    def restore(
        self, inspection_id: str, observation_id: str, attachment_id: str, who: str
    ) -> None:
        """Undo a deletion.

        Raises:
            AttachmentNotFound: The observation never had it.
        """
        self._of(inspection_id, observation_id, attachment_id)
        if self._store.restore(inspection_id, attachment_id, who):
            self._live.observations_changed(inspection_id)

    def _of(self, inspection_id: str, observation_id: str, attachment_id: str) -> Attachment:
        found = self._store.get(inspection_id, attachment_id)
        if found.observation_id != observation_id:
            raise AttachmentNotFound("There is no such attachment.")
        return found

    def _put(self, attachment: Attachment) -> None:
        self._require_same(attachment)
        if self._store.put(attachment, attachment.created_by):
            self._live.observations_changed(attachment.inspection_id)

    def _require_same(self, attachment: Attachment) -> None:
        """Require that an attachment of this id, if there is one, is the same file."""
        try:
            known = self._store.get(attachment.inspection_id, attachment.id)
        except AttachmentNotFound:
            return
        if _identity(known) != _identity(attachment):
            raise InvalidRequest(
                "This attachment exists with another file; add another one under a new id."
            )


def _identity(attachment: Attachment) -> tuple[object, ...]:
    sound = attachment.sha256 if attachment.kind == "voice" else attachment.frame
    return attachment.observation_id, attachment.kind, sound


def _voice_key(note: Attachment) -> str:
    suffix = VOICE_SUFFIXES[note.media_type or ""]
    return keys.voice(note.inspection_id, note.id, suffix)
