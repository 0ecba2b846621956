"""Gives an entry of the report its photos and voice notes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace

from app.reports.content.marked_photo import MarkedPhoto
from app.reports.report import Entry, Photo, Taken, VoiceNote
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs, Readable, StoredBlob
from app.survey.observations.attachments import VOICE_SUFFIXES, Attachment, Stroke
from app.survey.observations.records import Observation


class Attached:
    """The files of the entries of one report."""

    def __init__(
        self,
        blobs: Blobs,
        asset: str,
        attachments: Sequence[Attachment],
        caption_of: Callable[[Entry, Taken | None], str] | None,
        taken_at: Callable[[int], Taken],
        mark: str | None,
    ) -> None:
        """Sort the attachments by observation.

        Args:
            blobs: Where the files are.
            asset: Stem of all names.
            attachments: Those of the inspection, in their order.
            caption_of: What is burnt into a photo of an entry, by where it was taken if that is
                not the entry's frame; None for nothing.
            taken_at: Where the camera was in a frame.
            mark: What is written across every photo; None for nothing.
        """
        self._blobs = blobs
        self._asset = asset
        self._caption_of = caption_of
        self._taken_at = taken_at
        self._mark = mark
        self._of: dict[str, list[Attachment]] = defaultdict(list)
        for attachment in attachments:
            self._of[attachment.observation_id].append(attachment)

    def added_to(self, entry: Entry, row: Observation) -> Entry:
        """Return the entry with its files; the photo of lowest rank is the main one."""
        found = self._of.get(row.id, [])
        pictures = [one for one in found if one.kind != "voice" and one.is_photographed]
        by_age = sorted(pictures, key=lambda one: (one.created_at, one.id))
        ranked = [
            (one.rank, self._picture(one, row, by_age.index(one) + 2, entry)) for one in pictures
        ]
        own = self._own(row, entry)
        if own is not None:
            ranked.append((0, own))
        # The sort is stable, so the own photo is put before others of rank 0.
        ranked.sort(key=lambda one: (one[0], one[1] is not own))
        photos = tuple(photo for _, photo in ranked)
        notes = [one for one in found if one.kind == "voice"]
        return replace(
            entry,
            photo=photos[0] if photos else None,
            more_photos=photos[1:],
            voice_notes=tuple(self._note(note, row, n) for n, note in enumerate(notes, 1)),
        )

    def _own(self, row: Observation, entry: Entry) -> Photo | None:
        if stated := row.tag.photo_name:
            return Photo(stated, None, None)
        if not row.is_photographed:
            return None
        name = f"{self._asset}-{row.seq:03d}.jpg"
        jpeg = self._photo(row.inspection_id, row.id, row.frame) if row.has_photo else None
        photo = Photo(name, jpeg, row.photo_sha256, of=row.id)
        return self._marked(photo, (), entry)

    def _picture(self, one: Attachment, row: Observation, n: int, entry: Entry) -> Photo:
        jpeg = self._photo(one.inspection_id, one.id, one.frame) if one.has_photo else None
        name = f"{self._asset}-{row.seq:03d}-{n}.jpg"
        taken = None if one.frame == row.frame else self._taken_at(one.frame)
        photo = Photo(name, jpeg, one.sha256, of=one.id, taken=taken)
        return self._marked(photo, one.strokes, entry)

    def _marked(self, photo: Photo, strokes: Sequence[Stroke], entry: Entry) -> Photo:
        caption = self._caption_of(entry, photo.taken) if self._caption_of else None
        if photo.original is None or not (strokes or caption or self._mark):
            return photo
        return replace(photo, marked=MarkedPhoto(photo.original, strokes, caption, self._mark))

    def _photo(self, inspection_id: str, row_id: str, frame: int) -> Readable:
        return StoredBlob(self._blobs, keys.photo(inspection_id, row_id, frame))

    def _note(self, note: Attachment, row: Observation, n: int) -> VoiceNote:
        suffix = VOICE_SUFFIXES[note.media_type or ""]
        key = keys.voice(note.inspection_id, note.id, suffix)
        name = f"{self._asset}-{row.seq:03d}-{n}{suffix}"
        return VoiceNote(name, StoredBlob(self._blobs, key), note.sha256, note.id)
