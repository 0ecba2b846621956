"""The unrolled wall of every inspection: tiles from the tracking, stored as blobs.

Tiles are derived from the video, so they are replaced whole but synced with a checkpoint only. A
tile that cannot be written waits in memory for the next one, at the latest for the end of the run.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import PurePath

from app.errors import AppError, BlobNotFound, TileNotFound
from app.jobs.track.batches import WallPicture
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.tracking.live import Live
from vo_core import Rig
from vo_core.mosaic.layout import Layout

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Tile:
    """A picture of the wall over raw axial coordinates [index, index + 1) tiles."""

    index: int
    revision: int
    """Another one whenever the picture changes, also when the inspection is tracked again."""


class Unrolled:
    """Stores tiles and returns their pictures."""

    def __init__(self, blobs: Blobs, live: Live) -> None:
        self._blobs = blobs
        self._live = live
        self._unwritten: dict[str, dict[int, bytes]] = {}
        """Newest pictures that could not be written, by inspection; each run has its thread."""
        self._refused: set[str] = set()
        """Deleted inspections whose run has not ended yet; they stay deleted."""

    def begin(self, inspection_id: str) -> None:
        """Start without tiles, as tracking starts again."""
        self._unwritten.pop(inspection_id, None)
        self._blobs.delete_all(keys.wall(inspection_id))

    def take(self, inspection_id: str, tiles: Sequence[WallPicture]) -> None:
        """Store new pictures, and notify the listeners."""
        if not tiles or inspection_id in self._refused:
            return
        unwritten = self._unwritten.setdefault(inspection_id, {})
        unwritten.update((tile.index, tile.content) for tile in tiles)
        try:
            self.catch_up(inspection_id)
        except (AppError, OSError) as error:
            logger.warning("The unrolled wall of %s is not written: %s", inspection_id, error)

    def catch_up(self, inspection_id: str) -> None:
        """Write the pictures that could not be written before, and notify the listeners.

        Raises:
            DiskFull, StoreUnavailable: It is still not possible; nothing is lost.
        """
        waiting = self._unwritten.get(inspection_id, {})
        written = []
        try:
            for index in list(waiting):
                self._blobs.put_again(keys.tile(inspection_id, index), waiting[index])
                del waiting[index]
                written.append(index)
        finally:
            if written:
                self._live.wall_changed(inspection_id, tuple(written))
        self._unwritten.pop(inspection_id, None)

    def refuse(self, inspection_id: str) -> None:
        """Take no more pictures of an inspection that is deleted while it runs."""
        self._refused.add(inspection_id)

    def end(self, inspection_id: str) -> None:
        """Forget a run that has ended."""
        self._unwritten.pop(inspection_id, None)
        self._refused.discard(inspection_id)

    def sync(self, inspection_id: str, indices: Iterable[int]) -> None:
        """Make the pictures of these tiles durable.

        Raises:
            DiskFull, StoreUnavailable: One of them is not written yet.
        """
        self.catch_up(inspection_id)
        self._blobs.sync(keys.tile(inspection_id, index) for index in indices)

    def tiles(self, inspection_id: str) -> list[Tile]:
        """Return all tiles along the pipe, possibly none."""
        tiles = [
            Tile(int(PurePath(blob.key).stem), blob.revision)
            for blob in self._blobs.listed(keys.wall(inspection_id))
        ]
        return sorted(tiles, key=lambda tile: tile.index)

    def picture(self, inspection_id: str, index: int) -> bytes:
        """Return a tile as JPEG.

        Raises:
            TileNotFound: This part of the wall was not seen.
        """
        try:
            return self._blobs.get(keys.tile(inspection_id, index))
        except BlobNotFound:
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
