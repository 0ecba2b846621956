"""The track of every inspection: growing in memory while it runs, a file afterwards."""

from __future__ import annotations

import threading
from array import array
from collections import OrderedDict
from collections.abc import Iterable, Mapping

import numpy as np

from app.storage.files import DataFolder, write_durably
from vo_core.track import Estimate, Track

_CACHED = 8
_NUMBERS = ("time_s", "x_mm", "y_mm", "yaw_deg", "distance_mm", "sigma_distance_mm", "quality")


class _Growing:
    """Columns of a track that is still being made: 64 bytes a frame."""

    def __init__(self) -> None:
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

    def __init__(self, folder: DataFolder) -> None:
        self._folder = folder
        self._lock = threading.Lock()
        self._growing: dict[str, _Growing] = {}
        self._read: OrderedDict[str, Track] = OrderedDict()

    def begin(self, inspection_id: str) -> None:
        """Start an empty track; an earlier one is dropped."""
        with self._lock:
            self._growing[inspection_id] = _Growing()
            self._read.pop(inspection_id, None)
        self._folder.track(inspection_id).unlink(missing_ok=True)

    def append(self, inspection_id: str, estimates: Iterable[Estimate]) -> None:
        """Add the next frames."""
        with self._lock:
            growing = self._growing[inspection_id]
            for estimate in estimates:
                growing.append(estimate)

    def finish(self, inspection_id: str, metadata: Mapping[str, object]) -> None:
        """Write track.csv, as far as the track is."""
        track = self.get(inspection_id)
        write_durably(self._folder.track(inspection_id), track.to_csv(metadata).encode())
        with self._lock:
            self._remember(inspection_id, track)
            del self._growing[inspection_id]

    def forget(self, inspection_id: str) -> None:
        """Drop what is held in memory."""
        with self._lock:
            self._growing.pop(inspection_id, None)
            self._read.pop(inspection_id, None)

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

    def _remember(self, inspection_id: str, track: Track) -> None:
        self._read[inspection_id] = track
        while len(self._read) > _CACHED:
            self._read.popitem(last=False)


def estimate_at(track: Track, frame: int) -> Estimate | None:
    """The estimate of one frame, None where the track has not arrived."""
    if not 0 <= frame < len(track):
        return None
    values = {name: float(getattr(track, name)[frame]) for name in _NUMBERS}
    return Estimate(frame=frame, status=str(track.status[frame]), **values)  # type: ignore[arg-type]


def since(track: Track, frame: int) -> Track:
    """Only the rows from `frame` on."""
    columns = {name: getattr(track, name)[frame:] for name in ("frame", "status", *_NUMBERS)}
    return Track(**columns)
