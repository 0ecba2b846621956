"""The photos and voice notes of a report, as files that travel with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from app.imports.moved.archive_manifest import PHOTOS, VOICE
from app.reports.report import Entry, Report, WhyLost, why_lost
from app.storage.blobs.blobs import Readable


@dataclass(frozen=True)
class MediaFile:
    """A photo as it was taken, or a voice note."""

    path: str
    """`photos/<asset>-<number>.jpg`, or `voice/...`."""
    stored: Readable | None
    """A blob that may be missing; None in an import, whose photos are elsewhere."""
    entry: Entry


def media_of(report: Report) -> Mapping[str, MediaFile]:
    """Return the files by the id of their observation or attachment."""
    found = {}
    for entry in report.entries:
        for photo in entry.photos:
            if photo.of:  # a photo of another program's survey has a name only
                found[photo.of] = MediaFile(PHOTOS + photo.name, photo.original, entry)
        for note in entry.voice_notes:
            found[note.of] = MediaFile(VOICE + note.name, note.original, entry)
    return found


def read_stored(stored: Readable | None) -> bytes | WhyLost:
    """Return the content of a stored file, or why it is lost."""
    if stored is None:
        return "gone"
    try:
        return stored.read_bytes()
    except FileNotFoundError as error:
        return why_lost(error)
