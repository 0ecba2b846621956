"""Where inspections are stored."""

from __future__ import annotations

from dataclasses import dataclass

from app.storage.blobs.blobs import Blobs
from app.storage.database.database import Database
from app.storage.folder.files import DataFolder, Places


@dataclass(frozen=True)
class Stored:
    """The database, the data folder, and the blobs: films, photos, tiles and tracks."""

    database: Database
    folder: Places
    blobs: Blobs


@dataclass(frozen=True)
class Storage(Stored):
    """The same where a server writes: it has locked the folder."""

    folder: DataFolder
