"""The unrolled wall of every inspection: tiles from the tracking, stored as files.

Tiles are derived from the video, so they are replaced whole but synced with a checkpoint only, and
a tile that cannot be written is only logged.
"""

from __future__ import annotations

import logging
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from app.errors import TileNotFound
from app.storage.files import Places, replace_file, sync_file, sync_folder
from app.tracking.live import Live
from vo_core import Rig
from vo_core.mosaic.mosaic import Layout

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Tile:
    """A picture of the wall over raw axial coordinates [index, index + 1) tiles."""

    index: int
    revision: int
    """Rises whenever the picture changes, also when the inspection is tracked again."""


class Unrolled:
    """Stores tiles and returns their pictures."""

    def __init__(self, folder: Places, live: Live) -> None:
        self._folder = folder
        self._live = live

    def begin(self, inspection_id: str) -> None:
        """Start without tiles, as tracking starts again."""
        with suppress(FileNotFoundError):
            shutil.rmtree(self._folder.wall(inspection_id))

    def take(self, inspection_id: str, pictures: Mapping[int, bytes]) -> None:
        """Store new pictures, JPEG by index, and notify the listeners."""
        if not pictures:
            return
        folder = self._folder.wall(inspection_id)
        try:
            folder.mkdir(exist_ok=True)  # not its parent: a deleted inspection stays deleted
            for index, jpeg in pictures.items():
                replace_file(_file(folder, index), jpeg)
        except OSError as error:
            logger.warning("The unrolled wall of %s is not written: %s.", inspection_id, error)
            return
        self._live.wall_changed(inspection_id, tuple(pictures))

    def sync(self, inspection_id: str, indices: Iterable[int]) -> None:
        """Sync the pictures of these tiles."""
        folder = self._folder.wall(inspection_id)
        with suppress(FileNotFoundError):  # failed writes were logged
            for index in indices:
                sync_file(_file(folder, index))
            sync_folder(folder)

    def tiles(self, inspection_id: str) -> list[Tile]:
        """Return all tiles along the pipe, possibly none."""
        tiles = []
        with suppress(FileNotFoundError):
            for path in self._folder.wall(inspection_id).glob("*.jpg"):
                # The modification time survives a restart; microseconds are exact in JavaScript.
                tiles.append(Tile(int(path.stem), path.stat().st_mtime_ns // 1000))
        return sorted(tiles, key=lambda tile: tile.index)

    def picture(self, inspection_id: str, index: int) -> bytes:
        """Return a tile as JPEG.

        Raises:
            TileNotFound: This part of the wall was not seen.
        """
        try:
            return _file(self._folder.wall(inspection_id), index).read_bytes()
        except FileNotFoundError:
            raise TileNotFound(f"The unrolled wall has no tile {index}.") from None

    def layout(self, rig: Rig) -> Layout:
        """Return the raster of the tiles.

        Raises:
            InvalidRig: The camera sees no wall.
        """
        return _layout(rig.model_dump_json())


@lru_cache(maxsize=64)
def _layout(rig_json: str) -> Layout:
    """Compute the raster in a few milliseconds of ray casting; equal for every request."""
    return Layout.of(Rig.model_validate_json(rig_json))


def _file(folder: Path, index: int) -> Path:
    return folder / f"{index}.jpg"
