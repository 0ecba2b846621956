"""Stores inspections that came as files: their blobs first, then their rows, all or nothing."""

from __future__ import annotations

import json
import logging
import secrets
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from app.storage import keys
from app.storage.blobs import Blobs
from app.storage.files import DataFolder
from app.storage.imports import ImportStore
from app.storage.tables import Base, Inspection
from app.storage.unfinished import Unfinished
from app.survey.records import Event, Observation
from app.survey.track_rows import estimate_at
from app.tracking.runs import track_metadata
from app.tracking.tracks import Tracks
from vo_core import Track
from vo_core.geometry.stance import AS_STATED, Stance
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.finder import Sighting
from vo_core.track import Estimate

logger = logging.getLogger(__name__)

_BYTES_A_ROW = 200
"""Bytes of a track row on the disk, to check the free space."""


@dataclass(frozen=True)
class Imported:
    """The result of an import."""

    inspection_ids: tuple[str, ...]
    """Ids in the order of the file."""
    warnings: tuple[str, ...]
    """Sentences about what is odd or left out."""


@dataclass(frozen=True)
class Run:
    """The results of a run, as an import stores them."""

    track: Track
    health: Sequence[Health] = ()
    sightings: Sequence[Sighting] = ()
    tilt: MountTilt | None = None
    stance: Stance = AS_STATED

    def estimates(self) -> Iterator[Estimate]:
        """Yield the estimates row by row."""
        for frame in range(len(self.track)):
            estimate = estimate_at(self.track, frame)
            assert estimate is not None  # noqa: S101  (within its length)
            yield estimate


@dataclass(frozen=True)
class Rows:
    """What the database gets beside the inspection."""

    observations: Sequence[Observation]
    events: Sequence[Event]
    """The oldest first."""
    labels: Sequence[str] = ()
    more: Sequence[Base] = ()


class Keeper:
    """Stores one inspection at a time, or nothing of it."""

    def __init__(
        self,
        store: ImportStore,
        folder: DataFolder,
        blobs: Blobs,
        tracks: Tracks,
        unfinished: Unfinished,
    ) -> None:
        self._store = store
        self._folder = folder
        self._blobs = blobs
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

    def keep(self, inspection: Inspection, run: Run, rows: Rows) -> None:
        """Write the track, then commit, in the block of its `place`.

        Raises:
            DiskFull: There is no room for it.
        """
        inspection.frames_done = len(run.track)
        self._folder.require_room(_BYTES_A_ROW * len(run.track))
        try:
            self._put(inspection, run)
            self._store.add(inspection, rows.observations, rows.events, rows.labels, rows.more)
        except BaseException:
            self._tracks.forget(inspection.id)
            raise
        logger.info("Inspection %s (%s) imported.", inspection.id, inspection.name)

    def _put(self, inspection: Inspection, run: Run) -> None:
        rig = json.dumps(inspection.rig, indent=2)
        self._blobs.put(keys.rig(inspection.id), rig.encode())
        self._tracks.begin(inspection.id)
        self._tracks.append(inspection.id, run.estimates())
        self._tracks.note(inspection.id, enumerate(run.health), run.sightings, run.tilt, run.stance)
        self._tracks.finish(inspection.id, track_metadata(inspection))
