"""The track of every inspection: growing in memory while it runs, a file afterwards."""

from __future__ import annotations

import threading
from array import array
from collections import OrderedDict
from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import TypeVar

import numpy as np

from app.jobs import parts
from app.jobs.parts import Mark
from app.storage.files import Places, write_durably
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.finder import Sighting, from_csv, to_csv
from vo_core.track import COLUMNS, Estimate, Track, metadata_of

HEALTH = tuple(field.name for field in fields(Health))
"""Names of the columns."""

Kept = TypeVar("Kept")

_CACHED = 8
_NUMBERS = tuple(name for name in COLUMNS if name not in ("frame", "status"))


class HealthColumns:
    """`Health` of the frames of a run, as columns: 20 bytes a frame.

    A frame without a measurement of its own, because it came too fast to be tracked, has that of
    the one after it.
    """

    def __init__(self) -> None:
        self.columns = {name: array("f") for name in HEALTH}

    def __len__(self) -> int:
        return len(self.columns[HEALTH[0]])

    def note(self, frame: int, health: Health) -> None:
        """Add a frame; one that is there already stays."""
        missing = frame + 1 - len(self)
        for name, column in self.columns.items():
            column.extend([getattr(health, name)] * missing)

    def since(self, frame: int) -> list[Health]:
        """Of every frame from this one on."""
        columns = [column[frame:] for column in self.columns.values()]
        return [Health(*values) for values in zip(*columns, strict=True)]

    def copy(self) -> HealthColumns:
        """As it is now."""
        same = HealthColumns()
        same.columns = {name: column[:] for name, column in self.columns.items()}
        return same

    def to_csv(self) -> str:
        """health.csv: a header, then a row a frame."""
        rows = zip(*self.columns.values(), strict=True)
        lines = (f"{n}," + ",".join(f"{v:.4f}" for v in row) for n, row in enumerate(rows))
        return "\n".join([",".join(("frame", *HEALTH)), *lines]) + "\n"

    @classmethod
    def from_csv(cls, text: str) -> HealthColumns:
        """Read what `to_csv` made."""
        read = cls()
        for line in text.splitlines()[1:]:
            frame, *values = line.split(",")
            read.note(int(frame), Health(*map(float, values)))
        return read


class _Growing:
    """Columns of a track that is still being made: 116 bytes a frame, and what it showed."""

    def __init__(self) -> None:
        self.health = HealthColumns()
        self.sightings: list[Sighting] = []
        self.tilt: MountTilt | None = None
        self.left_out: list[Mark] = []
        self.columns = {name: array("d") for name in _NUMBERS}
        self.status: list[str] = []

    def append(self, estimate: Estimate) -> None:
        for name, column in self.columns.items():
            column.append(getattr(estimate, name))
        self.status.append(estimate.status)

    def track(self) -> Track:
        return Track(
            frame=np.arange(len(self.status)),
            status=np.array(self.status, np.str_),
            **{name: np.array(column) for name, column in self.columns.items()},
        )


class Tracks:
    """Row i of a track is frame i of its video."""

    def __init__(self, folder: Places) -> None:
        self._folder = folder
        self._lock = threading.Lock()
        self._growing: dict[str, _Growing] = {}
        self._runs: dict[str, int] = {}
        self._read: OrderedDict[str, Track] = OrderedDict()
        self._health: OrderedDict[str, HealthColumns] = OrderedDict()

    def begin(self, inspection_id: str) -> None:
        """Start an empty track; an earlier one is dropped."""
        with self._lock:
            self._growing[inspection_id] = _Growing()
            self._runs[inspection_id] = self._runs.get(inspection_id, 0) + 1
            self._read.pop(inspection_id, None)
            self._health.pop(inspection_id, None)
        for path in (
            self._folder.track(inspection_id),
            self._folder.health(inspection_id),
            self._folder.joints(inspection_id),
        ):
            path.unlink(missing_ok=True)

    def go_on(self, inspection_id: str) -> None:
        """Let a track that was finished grow again, with all that it had."""
        track, growing = self.get(inspection_id), _Growing()
        growing.health = self.health(inspection_id).copy()
        growing.sightings = self.sightings(inspection_id)
        growing.tilt = self.tilt(inspection_id)
        growing.columns = {name: array("d", getattr(track, name)) for name in _NUMBERS}
        growing.status = [str(status) for status in track.status]
        with self._lock:
            self._growing[inspection_id] = growing
            self._runs[inspection_id] = self._runs.get(inspection_id, 0) + 1
            self._read.pop(inspection_id, None)
            self._health.pop(inspection_id, None)

    def append(self, inspection_id: str, estimates: Iterable[Estimate]) -> None:
        """Add the next frames."""
        with self._lock:
            growing = self._growing[inspection_id]
            for estimate in estimates:
                growing.append(estimate)

    def note(
        self,
        inspection_id: str,
        health: Iterable[tuple[int, Health]],
        sightings: Iterable[Sighting],
        tilt: MountTilt | None = None,
    ) -> None:
        """Add how good frames were to measure on, joints that were seen, and the newest tilt."""
        with self._lock:
            growing = self._growing[inspection_id]
            for frame, each in health:
                growing.health.note(frame, each)
            growing.sightings.extend(sightings)
            growing.tilt = tilt or growing.tilt

    def leave_out(self, inspection_id: str, marks: Iterable[Mark]) -> None:
        """Note frames that a camera gave and the disk had no room for."""
        with self._lock:
            self._growing[inspection_id].left_out.extend(marks)

    def marks(self, inspection_id: str) -> list[Mark]:
        """What the film does not show, as far as it is known, by frame."""
        with self._lock:
            growing = self._growing.get(inspection_id)
            known = list(growing.left_out) if growing is not None else []
        return sorted({*parts.read(self._folder.marks(inspection_id)), *known})

    def keep_marks(self, inspection_id: str) -> list[Mark]:
        """Write all of them down, those too for which there was no room before.

        Raises:
            DiskFull: There still is none.
        """
        marks = self.marks(inspection_id)
        if marks:
            text = parts.text_of(marks)
            write_durably(self._folder.marks(inspection_id), text.encode())
        return marks

    def is_recorded(self, inspection_id: str, frame: int) -> bool:
        """Whether the film shows this frame."""
        marks = self.marks(inspection_id)
        return not any(mark.frame == frame and mark.kind == "left_out" for mark in marks)

    def finish(self, inspection_id: str, metadata: Mapping[str, object]) -> None:
        """Write track.csv, health.csv and joints.csv, as far as the track is."""
        track, health = self.get(inspection_id), self.health(inspection_id)
        sightings, tilt = self.sightings(inspection_id), self.tilt(inspection_id)
        metadata = {**metadata, **(tilt.metadata() if tilt else {})}
        write_durably(self._folder.joints(inspection_id), to_csv(track, sightings).encode())
        write_durably(self._folder.health(inspection_id), health.to_csv().encode())
        write_durably(self._folder.track(inspection_id), track.to_csv(metadata).encode())
        with self._lock:
            _remember(self._health, inspection_id, health)
            # The track is read from its file from now on, so that what is worked out of it is the
            # same after a restart; it is gone already if it is written once more.
            self._growing.pop(inspection_id, None)

    def forget(self, inspection_id: str) -> None:
        """Drop what is held in memory."""
        with self._lock:
            self._growing.pop(inspection_id, None)
            self._read.pop(inspection_id, None)
            self._health.pop(inspection_id, None)

    def run(self, inspection_id: str) -> tuple[int, bool]:
        """Which run made the track, and whether it goes on; a run only adds rows."""
        with self._lock:
            return self._runs.get(inspection_id, 0), inspection_id in self._growing

    def get(self, inspection_id: str) -> Track:
        """The track as far as it is, perhaps empty."""
        with self._lock:
            growing = self._growing.get(inspection_id)
            if growing is not None:
                return growing.track()
            known = self._read.get(inspection_id)
            if known is not None:
                self._read.move_to_end(inspection_id)
                return known
        # Read without the lock: a long file must not hold up the tracking of another one.
        path = self._folder.track(inspection_id)
        if not path.exists():
            return Track.from_estimates(())
        track = Track.from_csv(path.read_text("utf-8"))
        with self._lock:
            if inspection_id not in self._growing:
                self._remember(inspection_id, track)
        return track

    def newest_mm(self, inspection_id: str) -> float:
        """Raw distance of the last frame of a run that goes on; 0 without one."""
        with self._lock:
            growing = self._growing.get(inspection_id)
            columns = growing.columns["distance_mm"] if growing is not None else ()
            return columns[-1] if columns else 0.0

    def health(self, inspection_id: str) -> HealthColumns:
        """How good the frames were to measure on, as far as they are tracked."""
        with self._lock:
            growing = self._growing.get(inspection_id)
            if growing is not None:
                return growing.health.copy()
            known = self._health.get(inspection_id)
        if known is not None:
            return known
        path = self._folder.health(inspection_id)
        if not path.exists():
            return HealthColumns()
        health = HealthColumns.from_csv(path.read_text("utf-8"))
        with self._lock:
            if inspection_id not in self._growing:
                _remember(self._health, inspection_id, health)
        return health

    def sightings(self, inspection_id: str) -> list[Sighting]:
        """Joints that were seen while tracking, in the order of their frames."""
        with self._lock:
            growing = self._growing.get(inspection_id)
            if growing is not None:
                return sorted(growing.sightings, key=lambda sighting: sighting.frame)
        path = self._folder.joints(inspection_id)
        return from_csv(path.read_text("utf-8")) if path.exists() else []

    def tilt(self, inspection_id: str) -> MountTilt | None:
        """Of the mount against the rig, as far as the track is; None if nobody has measured it."""
        with self._lock:
            growing = self._growing.get(inspection_id)
            if growing is not None:
                return growing.tilt
        path = self._folder.track(inspection_id)
        if not path.exists():
            return None
        with path.open(encoding="utf-8") as lines:
            return MountTilt.from_metadata(metadata_of(lines))

    def _remember(self, inspection_id: str, track: Track) -> None:
        _remember(self._read, inspection_id, track)


def _remember(cache: OrderedDict[str, Kept], inspection_id: str, kept: Kept) -> None:
    cache[inspection_id] = kept
    while len(cache) > _CACHED:
        cache.popitem(last=False)
