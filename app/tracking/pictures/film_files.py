"""Where the film of an inspection is: in the store, or on the server's disk while it grows."""

from __future__ import annotations

from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs, StoredBlob
from app.storage.blobs.folder import FolderBlobs
from app.storage.database.tables import Inspection
from app.storage.folder.files import Places


class FilmFiles:
    """Finds the film of an inspection."""

    def __init__(self, blobs: Blobs, places: Places) -> None:
        self._blobs = blobs
        self._recordings = FolderBlobs(places.root)

    def film_of(self, row: Inspection) -> StoredBlob:
        """Return the film, which may be missing; a recording as far as it has come."""
        return self.film_at(keys.film(row.id, row.video_file))

    def film_at(self, key: str) -> StoredBlob:
        """Return the film of this key."""
        is_here = key.endswith(f"/{keys.RECORDING}") and self._recordings.exists(key)
        return StoredBlob(self._recordings if is_here else self._blobs, key)
