"""Stores the results of tracking a video up to the last checkpoint.

A crash of the server or of the tracking process then loses only what came after the checkpoint, not
the whole run. The journal only grows. A checkpoint is replaced whole and states how much of the
journal belongs to it, so that the two always match.
"""

from __future__ import annotations

import hashlib
import json
import logging
import sys
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

import msgspec

import app.jobs
import vo_core
from app.errors import DiskFull, StoreUnavailable
from app.jobs.messages import encode
from app.jobs.track.batches import Batch, batches_of, entry_of
from app.jobs.track.messages import Checkpoint, KeptCheckpoint
from app.storage.database.tables import Inspection
from app.storage.folder.files import Places, append_durably, write_durably
from app.tracking.films.runs import TrackedFilm
from app.tracking.unrolled import Unrolled

logger = logging.getLogger(__name__)

_PACKAGES = ("chainage", "av", "numpy", "opencv-python-headless")


@dataclass(frozen=True)
class Resumption:
    """The state from which tracking resumes."""

    checkpoint: Path
    """Checkpoint file for the tracker; the next one belongs to it."""
    journal: Path
    frames: int
    cpu_s: float
    """Processor time used up to the checkpoint."""
    found: list[Batch]
    """Results for the frames up to the checkpoint, without pictures."""


class Journal:
    """The journal of one inspection, used by the thread that follows its tracking."""

    def __init__(
        self,
        folder: Places,
        unrolled: Unrolled,
        inspection: TrackedFilm | Inspection,
        first: int = 0,
    ) -> None:
        """Prepare the journal of a film, or of a chunk of it that begins with the frame `first`."""
        self._id = inspection.id
        self._unrolled = unrolled
        self._journal = folder.journal(inspection.id)
        self._checkpoint = folder.checkpoint(inspection.id)
        self._first = first
        self._stamp = stamp_of(inspection)
        self._bytes = 0
        """Bytes of the journal covered by the checkpoint."""
        self._unsaved = bytearray()
        self._tiles: set[int] = set()
        """Tiles that were painted since the last checkpoint."""

    def read(self) -> Resumption | None:
        """Return the last checkpoint and its results, discarding later ones; None if none fits."""
        self._unsaved, self._tiles, self._bytes = bytearray(), set(), 0
        try:
            kept = msgspec.msgpack.decode(self._checkpoint.read_bytes(), type=KeptCheckpoint)
            if kept.stamp != self._stamp:
                logger.info("The checkpoint of %s is of another program or rig.", self._id)
                return None
            with self._journal.open("rb") as content:
                found = batches_of(content, kept.journal_bytes)
        except FileNotFoundError:
            return None
        except msgspec.MsgspecError:
            logger.exception("The checkpoint of %s cannot be read.", self._id)
            return None
        at = kept.checkpoint
        if sum(len(batch.estimates) for batch in found) != at.frames - self._first:
            logger.error("The journal of %s does not match its checkpoint.", self._id)
            return None
        self._bytes = kept.journal_bytes
        return Resumption(self._checkpoint, self._journal, at.frames, at.cpu_s, found)

    def note(self, batch: Batch) -> None:
        """Add results, which reach the disk with the next checkpoint."""
        self._tiles.update(tile.index for tile in batch.tiles)
        self._unsaved += entry_of(batch)

    def keep(self, checkpoint: Checkpoint) -> bool:
        """Sync all results, then the checkpoint; without free space neither, and return False."""
        try:
            self._unrolled.sync(self._id, self._tiles)
            end = append_durably(self._journal, self._bytes, self._unsaved)
            kept = KeptCheckpoint(self._stamp, end, checkpoint)
            write_durably(self._checkpoint, encode(kept))
        except (DiskFull, StoreUnavailable, OSError):
            # Tracking itself needs neither, and the previous checkpoint is still valid.
            logger.warning("A checkpoint of %s could not be written.", self._id, exc_info=True)
            return False
        self._bytes = end
        self._unsaved, self._tiles = bytearray(), set()
        return True

    def finish(self) -> None:
        """Add the results after the last checkpoint to the file.

        Raises:
            DiskFull: There is no room for them.
        """
        self._bytes = append_durably(self._journal, self._bytes, self._unsaved)
        self._unsaved = bytearray()

    def drop(self) -> None:
        """Delete journal and checkpoint: the run has ended or starts again."""
        self._checkpoint.unlink(missing_ok=True)
        self._journal.unlink(missing_ok=True)


def stamp_of(inspection: TrackedFilm | Inspection) -> str:
    """Return a digest of everything that a result depends on: program, film and rig."""
    rig = json.dumps(dict(inspection.rig), sort_keys=True)
    parts = "\n".join((_program(), inspection.source_sha256, rig))
    return hashlib.sha256(parts.encode()).hexdigest()


@lru_cache(maxsize=1)
def _program() -> str:
    """Return a digest of the tracking code and of the libraries that it calls."""
    digest = hashlib.sha256()
    for package in (app.jobs, vo_core):
        for path in sorted(Path(str(package.__file__)).parent.rglob("*.py")):
            digest.update(path.read_bytes())
    versions = [f"{name} {version(name)}" for name in _PACKAGES]
    return "\n".join((sys.version, *versions, digest.hexdigest()))
