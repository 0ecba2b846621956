"""Stores inspections that came as files: their blobs first, then their rows, all or nothing."""

from __future__ import annotations

import logging
import secrets
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from app.imports.surveys.survey import Caveat
from app.inspections.films.making import keep_rig
from app.jobs.track.batches import Batch
from app.storage.database.tables import Inspection
from app.storage.folder.unfinished import Unfinished
from app.storage.records.imports import ImportStore, Rows
from app.storage.storage import Storage
from app.survey.distances.track_rows import estimate_at
from app.tracking.films.runs import track_metadata
from app.tracking.tracks import Tracks
from vo_core import Track
from vo_core.geometry.initial_pose import AS_STATED, InitialPose
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting
from vo_core.track import Estimate

logger = logging.getLogger(__name__)

_BYTES_A_ROW = 200
"""Bytes of a track row on the disk, to check the free space."""


@dataclass(frozen=True)
class Imported:
    """The result of an import."""

    inspection_ids: tuple[str, ...]
    """Ids in the order of the file; none if nothing in it can be read, and the warnings say why."""
    warnings: tuple[Caveat, ...]
    """What is odd or left out."""


@dataclass(frozen=True)
class Run:
    """The results of a run, as an import stores them."""

    track: Track
    health: Sequence[Health] = ()
    sightings: Sequence[Sighting] = ()
    tilt: MountTilt | None = None
    initial_pose: InitialPose = AS_STATED

    def estimates(self) -> Iterator[Estimate]:
        """Yield the estimates row by row."""
        for frame in range(len(self.track)):
            estimate = estimate_at(self.track, frame)
            assert estimate is not None  # noqa: S101  (within its length)
            yield estimate


class Keeper:
    """Stores the inspections of a file, all of them or nothing."""

    def __init__(self, storage: Storage, tracks: Tracks, unfinished: Unfinished) -> None:
        self._store = ImportStore(storage.database)
        self._folder = storage.folder
        self._blobs = storage.blobs
        self._tracks = tracks
        self._unfinished = unfinished

    @contextmanager
    def place(self, wanted: str | None = None) -> Iterator[str]:
        """Give the id of a new inspection; what the block stores under it goes if the block fails.

        Args:
            wanted: Id that it gets if this server never had an inspection of it.
        """
        with ExitStack() as stack:
            inspection_id = wanted or secrets.token_hex(16)
            try:
                stack.enter_context(self._unfinished.making(inspection_id))
            except FileExistsError:
                inspection_id = secrets.token_hex(16)
                stack.enter_context(self._unfinished.making(inspection_id))
            yield inspection_id

    def keep(self, made: Sequence[tuple[Rows, Run]]) -> None:
        """Write the tracks, then commit, in the blocks of their places.

        Raises:
            DiskFull: There is no room for them.
        """
        self._folder.require_room(_BYTES_A_ROW * sum(len(run.track) for _, run in made))
        try:
            for rows, run in made:
                rows.inspection.frames_done = len(run.track)
                self._put(rows.inspection, run)
            self._store.add([rows for rows, _ in made])
        except BaseException:
            for rows, _ in made:
                self._tracks.forget(rows.inspection.id)
            raise
        for rows, _ in made:
            name = rows.inspection.name
            logger.info("Inspection %s (%s) imported.", rows.inspection.id, name)

    def _put(self, inspection: Inspection, run: Run) -> None:
        keep_rig(self._blobs, inspection.id, inspection.rig)
        self._tracks.begin(inspection.id)
        batch = Batch(
            list(run.estimates()),
            health=list(enumerate(run.health)),
            sightings=list(run.sightings),
            tilt=run.tilt,
            initial_pose=run.initial_pose,
        )
        self._tracks.append(inspection.id, batch)
        self._tracks.finish(inspection.id, track_metadata(inspection))
