"""The burnt-in counter of a film beside its track, and what people state about it."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from cachetools import LRUCache, cachedmethod
from numpy.typing import NDArray

from app.burnt_in.comparison import with_track
from app.burnt_in.readings import HEADER, CounterReadings
from app.storage.records.inspections import InspectionStore
from app.tracking.pictures.counter_files import CounterFiles, KeptCounter
from app.tracking.tracks import Tracks
from vo_core.errors import InvalidCorrection
from vo_core.scale.carrying import Readings
from vo_core.scale.counter import COUNTER_SHARE, MM_PER_UNIT, CounterComparison, Unit

CounterState = Literal[
    "unread", "waiting", "read", "not_found", "illegible", "declined", "cancelled", "failed"
]
"""`not_found`: the film shows none; `illegible`: no frame has a reading; `declined`: a person has
said that there is none."""

_COMPARED_KEPT = 8
"""Comparisons held in memory; a page asks several times for one that takes seconds for hours of
film."""


@dataclass(frozen=True)
class CounterView:
    """What is known of a counter."""

    state: CounterState
    kept: KeptCounter | None
    readings: CounterReadings | None
    """None unless it was found and is legible."""
    unit: Unit | None
    """Of the readings: as the film shows it, or as a person states it."""
    comparison: CounterComparison | None
    """With the raw track; None without readings, a unit or an ended run."""
    version: str = ""
    """Of the readings; empty without them."""

    @property
    def reading_m(self) -> NDArray[np.float64]:
        """(N,) the reading of each frame, NaN where it is not legible; empty without a unit."""
        if self.readings is None or self.unit is None:
            return np.empty(0)
        return self.readings.reading * (MM_PER_UNIT[self.unit] / 1000)

    @property
    def csv(self) -> str:
        """The readings as the file that `chainage counter` writes; only its header without them."""
        return f"{HEADER}\n" if self.readings is None else self.readings.to_csv()


NO_COUNTER = CounterView("unread", None, None, None, None)
"""Nobody has asked for the counter, or there is no film."""


class Counters:
    """Compares counters with tracks."""

    def __init__(self, store: InspectionStore, files: CounterFiles, tracks: Tracks) -> None:
        self._store = store
        self._files = files
        self._tracks = tracks
        self._lock = threading.Lock()
        """Guards the next field."""
        self._compared: LRUCache[Any, CounterComparison | None] = LRUCache(_COMPARED_KEPT)

    def get(self, inspection_id: str) -> CounterView:
        """Return what is known of the counter of an inspection.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        self._store.get(inspection_id)
        view = self._uncompared(inspection_id)
        if view.readings is None or view.unit is None:
            return view
        compared = self._comparison(inspection_id, view.readings, view.unit)
        return replace(view, comparison=compared)

    def readings(self, inspection_id: str) -> Readings | None:
        """Return what the counter says about the frames; None if it is not read, or in no known
        unit.
        """
        view = self._uncompared(inspection_id)
        kept, read, unit = view.kept, view.readings, view.unit
        if kept is None or kept.place is None or read is None or unit is None:
            return None
        return Readings.of_counter(
            read.time_s,
            1000 * view.reading_m,
            tick_mm=MM_PER_UNIT[unit] * 10.0**-kept.place.decimals,
            share=COUNTER_SHARE if kept.percent is None else kept.percent / 100,
        )

    def _uncompared(self, inspection_id: str) -> CounterView:
        kept = self._files.get(inspection_id)
        if kept is None:
            return NO_COUNTER
        if kept.state != "read":
            return CounterView(kept.state, kept, None, kept.unit, None)
        if kept.place is None:
            return CounterView("not_found", kept, None, kept.unit, None)
        readings = self._files.readings(inspection_id, kept)
        if np.isnan(readings.reading).all():
            return CounterView("illegible", kept, None, kept.unit, None)
        unit = kept.place.unit or kept.unit
        return CounterView("read", kept, readings, unit, None, self._files.version(inspection_id))

    def kept(self, inspection_id: str) -> KeptCounter | None:
        """Return what is stored; another one after every change."""
        return self._files.get(inspection_id)

    def _comparison(
        self, inspection_id: str, readings: CounterReadings, unit: Unit
    ) -> CounterComparison | None:
        run, is_growing = self._tracks.run(inspection_id)
        if is_growing:
            return None
        made_of = self._files.version(inspection_id), run, unit
        return self._compare(inspection_id, made_of, readings)

    @cachedmethod(
        lambda self: self._compared,
        lambda self, inspection_id, made_of, readings: (inspection_id, made_of),
        lock=lambda self: self._lock,
    )
    def _compare(
        self, inspection_id: str, made_of: tuple[str, int, Unit], readings: CounterReadings
    ) -> CounterComparison | None:
        track = self._tracks.get(inspection_id)
        try:
            return with_track(readings, track, made_of[-1]) if len(track) else None
        except InvalidCorrection:  # more frames than readings: the recording was continued
            return None
