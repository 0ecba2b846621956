"""The track of every inspection: growing in memory while it runs, a file afterwards."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence, Sized
from contextlib import contextmanager
from dataclasses import fields
from typing import Any, TypeVar, get_args
from uuid import uuid4

import numpy as np
from cachetools import LRUCache, cachedmethod
from numpy.typing import NDArray

from app.errors import BlobNotFound, DamagedTrack
from app.jobs.track import parts
from app.jobs.track.batches import Batch
from app.jobs.track.parts import Mark
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.storage.folder.files import Places
from app.tracking.columns import GrowingColumns
from vo_core.errors import InvalidTrack
from vo_core.geometry.initial_pose import AS_STATED, InitialPose
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting, from_csv, to_csv
from vo_core.track import COLUMNS, Estimate, Status, Track, metadata_of

HEALTH = tuple(field.name for field in fields(Health))
"""Names of the columns of health."""

Kept = TypeVar("Kept", bound=Sized)

FRAMES_KEPT = 1_000_000
"""Frames of finished tracks held in memory: 116 bytes each, and 20 of their health."""
_HEAD_BYTES = 2**16
"""Enough for the comments at the head of a track file."""
_LEAST_FRAMES = 1_000
"""A shorter track counts as this many frames, so that the number of tracks is bounded too."""


class HealthColumns(GrowingColumns):
    """`Health` of the frames of a run, as columns: 20 bytes a frame.

    A frame that came too fast to be tracked has the health of the next one.
    """

    def __init__(self) -> None:
        super().__init__(dict.fromkeys(HEALTH, np.float32))

    def note(self, frame: int, health: Health) -> None:
        """Add a frame, unless it exists."""
        missing = frame + 1 - len(self)
        if missing > 0:
            self.extend(missing, {name: np.full(missing, getattr(health, name)) for name in HEALTH})

    def to_csv(self) -> str:
        """Return health.csv: a header, then one row for each frame."""
        rows = zip(*(column.tolist() for column in self.columns().values()), strict=True)
        lines = (f"{n}," + ",".join(f"{v:.4f}" for v in row) for n, row in enumerate(rows))
        return "\n".join([",".join(("frame", *HEALTH)), *lines]) + "\n"

    @classmethod
    def from_csv(cls, text: str) -> HealthColumns:
        """Read the output of `to_csv`."""
        read = cls()
        columns = zip(*(line.split(",") for line in text.splitlines()[1:]), strict=True)
        values = dict(zip(("frame", *HEALTH), columns, strict=False))
        if values:
            read.extend(len(values["frame"]), values)
        return read


class _Growing:
    """Columns of a growing track, 116 bytes a frame, with joints, tilt and initial pose."""

    def __init__(self) -> None:
        self.health = HealthColumns()
        self.sightings: list[Sighting] = []
        self.tilt: MountTilt | None = None
        self.initial_pose = AS_STATED
        self.left_out: list[Mark] = []
        self.columns = GrowingColumns(_DTYPES)
        self.smoothed = GrowingColumns(_DTYPES)
        """The last rows of the run anew, once all of them are here."""

    def append(self, batch: Batch) -> None:
        estimates, begin = batch.estimates, len(self.columns)
        values = _values(estimates)
        # Row i is frame i, whatever number a tracker has assigned.
        values["frame"] = np.arange(begin, begin + len(estimates))
        self.columns.extend(len(estimates), values)
        self.smoothed.extend(len(batch.smoothed), _values(batch.smoothed))
        for frame, health in batch.health:
            self.health.note(frame, health)
        self.sightings.extend(batch.sightings)
        self.tilt = batch.tilt or self.tilt
        self.initial_pose = batch.initial_pose or self.initial_pose

    def track(self) -> Track:
        return Track(**self.columns.columns())

    def final(self) -> Track | None:
        """Return the track with its smoothed rows; None unless there are some, up to the last."""
        end, first = len(self.columns), len(self.columns) - len(self.smoothed)
        if first == end or not np.array_equal(self.smoothed.view("frame"), np.arange(first, end)):
            return None
        live, smoothed = self.columns.columns(), self.smoothed.columns()
        return Track(**{n: np.concatenate([live[n][:first], smoothed[n]]) for n in COLUMNS})


def _values(estimates: Sequence[Estimate]) -> dict[str, Any]:
    return {name: [getattr(each, name) for each in estimates] for name in COLUMNS}


_DTYPES = {name: np.dtype(np.float64) for name in COLUMNS} | {
    "frame": np.dtype(np.int64),
    "status": np.array(get_args(Status)).dtype,
}


class Tracks:
    """Row i of a track is frame i of its video."""

    def __init__(self, blobs: Blobs, places: Places) -> None:
        self._blobs = blobs
        self._places = places
        self._lock = threading.Lock()
        self._growing: dict[str, _Growing] = {}
        self._runs: dict[str, int] = {}
        self._start = uuid4().hex
        """Distinguishes the runs of this start of the server from those of another."""
        self._tracks: LRUCache[Any, Track] = _cache()
        self._health: LRUCache[Any, HealthColumns] = _cache()
        self._is_read = threading.Condition()
        """Guards what was read; notified when a file that several wait for is read."""

    def begin(self, inspection_id: str) -> None:
        """Start an empty track and drop an earlier one."""
        self._grow(inspection_id, _Growing())
        for key in (keys.health, keys.joints, keys.track):
            self._blobs.delete(key(inspection_id))

    def go_on(self, inspection_id: str) -> None:
        """Let a finished track grow again, with all its rows."""
        track, growing = self.get(inspection_id), _Growing()
        growing.health = self.health(inspection_id).copy()
        growing.sightings = self.sightings(inspection_id)
        growing.tilt = self.tilt(inspection_id)
        growing.initial_pose = self.initial_pose(inspection_id)
        growing.columns.extend(len(track), {name: getattr(track, name) for name in COLUMNS})
        self._grow(inspection_id, growing)

    def _grow(self, inspection_id: str, growing: _Growing) -> None:
        with self._lock:
            self._growing[inspection_id] = growing
            self._runs[inspection_id] = self._runs.get(inspection_id, 0) + 1

    def append(self, inspection_id: str, batch: Batch) -> None:
        """Add the next frames, with their health, the joints that were seen, and the newest tilt
        and initial_pose.
        """
        with self._lock:
            self._growing[inspection_id].append(batch)

    def leave_out(self, inspection_id: str, marks: Iterable[Mark]) -> None:
        """Note camera frames that the full disk could not store."""
        with self._lock:
            self._growing[inspection_id].left_out.extend(marks)

    def marks(self, inspection_id: str) -> list[Mark]:
        """Return the frames missing from the film so far, in order."""
        with self._lock:
            growing = self._growing.get(inspection_id)
            known = list(growing.left_out) if growing is not None else []
        return sorted({*self._kept_marks(inspection_id), *known})

    def _kept_marks(self, inspection_id: str) -> list[Mark]:
        """Read the file of the camera's process, or what was kept of it."""
        try:
            content = self._places.marks(inspection_id).read_bytes()
        except FileNotFoundError:
            try:
                content = self._blobs.get(keys.marks(inspection_id))
            except BlobNotFound:
                return []
        with _readable():
            return parts.parsed(content.decode("ascii"))

    def keep_marks(self, inspection_id: str) -> list[Mark]:
        """Store all missing frames, including those that did not fit on the disk before.

        Raises:
            DiskFull: There is still no room.
        """
        marks = self.marks(inspection_id)
        if marks:
            text = parts.text_of(marks)
            self._blobs.put(keys.marks(inspection_id), text.encode())
        return marks

    def is_recorded(self, inspection_id: str, frame: int) -> bool:
        """Return whether the film shows this frame."""
        marks = self.marks(inspection_id)
        return not any(mark.frame == frame and mark.kind == "left_out" for mark in marks)

    def finish(self, inspection_id: str, metadata: Mapping[str, object]) -> None:
        """Write track.csv, health.csv and joints.csv with the rows so far, smoothed ones if there
        are any; those are of another run for whoever has read rows before.
        """
        final = self._final(inspection_id)
        track = self.get(inspection_id) if final is None else final
        health = self.health(inspection_id)
        sightings, tilt = self.sightings(inspection_id), self.tilt(inspection_id)
        initial_pose = self.initial_pose(inspection_id)
        metadata = {**metadata, **(tilt.metadata() if tilt else {}), **initial_pose.metadata()}
        self._blobs.put(keys.joints(inspection_id), to_csv(track, sightings).encode())
        self._blobs.put(keys.track(inspection_id), track.to_csv(metadata).encode())
        self._blobs.put(keys.health(inspection_id), health.to_csv().encode())
        with self._lock:
            # From now on the track is read from its file, so that results are the same after a
            # restart; when it is written again, it is already dropped.
            self._growing.pop(inspection_id, None)
            if final is not None:
                self._runs[inspection_id] = self._runs.get(inspection_id, 0) + 1

    def moved_mm(self, inspection_id: str) -> NDArray[np.float64] | None:
        """Return by how much smoothing moves each frame of a run, (N,) mm along the pipe; None if
        it does not move any.
        """
        final = self._final(inspection_id)
        return None if final is None else final.distance_mm - self.get(inspection_id).distance_mm

    def _final(self, inspection_id: str) -> Track | None:
        with self._lock:
            growing = self._growing.get(inspection_id)
            return None if growing is None else growing.final()

    def forget(self, inspection_id: str) -> None:
        """Drop what is held in memory."""
        with self._lock:
            self._growing.pop(inspection_id, None)
            read = (inspection_id, self._runs.get(inspection_id, 0))
        with self._is_read:
            self._tracks.pop(read, None)
            self._health.pop(read, None)

    def run(self, inspection_id: str) -> tuple[int, bool]:
        """Return the number of the run that made the track, and whether it is running.

        A run only adds rows. Smoothed rows count as those of another run.
        """
        with self._lock:
            return self._runs.get(inspection_id, 0), inspection_id in self._growing

    def run_id(self, inspection_id: str) -> str:
        """Return an id of the run that made the track; no other run has it, nor has the same run
        after a restart of the server.
        """
        number, _ = self.run(inspection_id)
        return f"{self._start}-{number}"

    def get(self, inspection_id: str) -> Track:
        """Return the track so far, possibly empty; that of a running inspection is not copied.

        Raises:
            DamagedTrack: Its file, or another one of the run, cannot be read or is missing. Health,
                sightings and marks raise it as well.
        """
        with self._lock:
            growing, run = self._growing.get(inspection_id), self._runs.get(inspection_id, 0)
            if growing is not None:
                return growing.track()
        return self._track(inspection_id, run)

    def is_readable(self, inspection_id: str) -> bool:
        """Return whether there is a track with rows, and it is not damaged."""
        try:
            return len(self.get(inspection_id)) > 0
        except DamagedTrack:
            return False

    def newest_mm(self, inspection_id: str) -> float:
        """Return the raw distance of the last frame of a running inspection; 0 without one."""
        with self._lock:
            growing = self._growing.get(inspection_id)
            if growing is None or not len(growing.columns):
                return 0.0
            return float(growing.columns.view("distance_mm")[-1])

    def health(self, inspection_id: str) -> HealthColumns:
        """Return the health of the frames tracked so far."""
        with self._lock:
            growing, run = self._growing.get(inspection_id), self._runs.get(inspection_id, 0)
            if growing is not None:
                return growing.health.copy()
        return self._health_of(inspection_id, run)

    @cachedmethod(
        lambda self: self._tracks,
        lambda self, inspection_id, run: (inspection_id, run),
        condition=lambda self: self._is_read,
    )
    def _track(self, inspection_id: str, _run: int) -> Track:
        """Read the file of a run once for all who ask; empty without one."""
        try:
            content = self._blobs.get(keys.track(inspection_id))
        except BlobNotFound:
            # It is stored before the health, and deleted after it.
            if self._blobs.exists(keys.health(inspection_id)):
                raise DamagedTrack("its file is missing.") from None
            return Track.from_estimates(())
        with _readable():
            if not content.endswith(b"\n"):
                raise DamagedTrack("its file breaks off.")
            return Track.from_csv(content.decode())

    @cachedmethod(
        lambda self: self._health,
        lambda self, inspection_id, run: (inspection_id, run),
        condition=lambda self: self._is_read,
    )
    def _health_of(self, inspection_id: str, _run: int) -> HealthColumns:
        try:
            content = self._blobs.get(keys.health(inspection_id))
        except BlobNotFound:
            return HealthColumns()
        with _readable():
            return HealthColumns.from_csv(content.decode())

    def sightings(self, inspection_id: str) -> list[Sighting]:
        """Return the joints that were seen while tracking, in the order of their frames."""
        with self._lock:
            growing = self._growing.get(inspection_id)
            if growing is not None:
                return sorted(growing.sightings, key=lambda sighting: sighting.frame)
        try:
            content = self._blobs.get(keys.joints(inspection_id))
        except BlobNotFound:
            return []
        with _readable():
            return from_csv(content.decode())

    def tilt(self, inspection_id: str) -> MountTilt | None:
        """Return the tilt of the mount against the rig so far; None if it was not measured."""
        with self._lock:
            growing = self._growing.get(inspection_id)
            if growing is not None:
                return growing.tilt
        return MountTilt.from_metadata(self._metadata(inspection_id))

    def initial_pose(self, inspection_id: str) -> InitialPose:
        """Return the pose of the camera in the pipe at the first frame, by the run so far."""
        with self._lock:
            growing = self._growing.get(inspection_id)
            if growing is not None:
                return growing.initial_pose
        return InitialPose.from_metadata(self._metadata(inspection_id))

    def _metadata(self, inspection_id: str) -> dict[str, str]:
        try:
            head = self._blobs.read_range(keys.track(inspection_id), 0, _HEAD_BYTES)
        except BlobNotFound:
            return {}
        return metadata_of(head.decode("utf-8", "replace").splitlines(keepends=True))


def _cache() -> LRUCache[Any, Kept]:
    def frames(kept: Kept) -> int:
        # One that is empty may yet get a file, and is too large to be kept.
        return min(max(len(kept), _LEAST_FRAMES), FRAMES_KEPT) if len(kept) else FRAMES_KEPT + 1

    return LRUCache(FRAMES_KEPT, frames)


@contextmanager
def _readable() -> Iterator[None]:
    """Raise DamagedTrack for a file of a run that is not as it was written."""
    try:
        yield
    except InvalidTrack as error:
        raise DamagedTrack(str(error)) from error
    except (ValueError, KeyError) as error:
        raise DamagedTrack("a file of it cannot be read.") from error
