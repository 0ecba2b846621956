"""Where a server stores everything."""

from __future__ import annotations

from dataclasses import dataclass

from app.storage.blobs.blobs import Blobs
from app.storage.database.database import Database
from app.storage.folder.files import DataFolder


@dataclass(frozen=True)
class Storage:
    """The database, the data folder, and the blobs: films, photos, tiles and tracks."""

    database: Database
    folder: DataFolder
    blobs: Blobs
