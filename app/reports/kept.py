"""Gathers what an inspection takes along when it moves to another server."""

from __future__ import annotations

from collections.abc import Sequence

from app.imports import archive_manifest
from app.inspections.packs import Packs
from app.reports.report import Kept
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs, StoredBlob
from app.storage.database.tables import Inspection
from app.storage.records.reviews import ReviewStore
from app.survey.attachments import Attachment

_BESIDE_THE_FILM = {
    archive_manifest.COUNTER: keys.counter,
    archive_manifest.READINGS: keys.counter_readings,
    archive_manifest.PARTS: keys.marks,
}


def kept_of(
    row: Inspection,
    attachments: Sequence[Attachment],
    reviews: ReviewStore,
    packs: Packs,
    blobs: Blobs,
) -> Kept:
    """Return what is not in the report of an inspection; nothing large is read."""
    return Kept(
        attachments=tuple(attachments),
        remarks=tuple(reviews.remarks(row.id)),
        files={
            name: StoredBlob(blobs, key_of(row.id)) for name, key_of in _BESIDE_THE_FILM.items()
        },
        pack_table=packs.csv_of(row.header),
    )
