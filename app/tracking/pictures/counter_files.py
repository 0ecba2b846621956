"""What is known of the burnt-in counter of each film: blobs beside its track."""

from __future__ import annotations

import threading
from datetime import date
from typing import Any, Literal

import msgspec
from cachetools import LRUCache, cachedmethod

from app.burnt_in.box import Box
from app.burnt_in.finder import CounterPlace
from app.burnt_in.readings import CounterReadings
from app.errors import BlobNotFound, PixelOutsidePicture
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from vo_core.scale.counter import Unit

_READINGS_KEPT = 8
"""Inspections whose readings are held in memory, 24 bytes for each frame."""


class KeptCounter(msgspec.Struct, frozen=True):
    """The content of counter.json; the readings are in counter.csv."""

    state: Literal["waiting", "read", "failed", "cancelled", "declined"]
    """"declined": a person has said that the film shows no counter."""
    within: Box | None = None
    """A box drawn by a person; without it, the counter is searched."""
    unit: Unit | None = None
    """Stated by a person."""
    percent: float | None = None
    """Standard uncertainty of its way, stated by a person; None for the usual one."""
    place: CounterPlace | None = None
    """Where it was read; None if the film shows none."""
    film_date: date | None = None
    """Burnt into the film that was read; None if it shows none."""
    film_bytes: int = 0
    """Size of the film that was read; a recording that was continued is read again."""
    detail: str | None = None
    """A sentence that says why it failed, or what was wrong with the film."""

    def differs_in_meaning(self, stated: KeptCounter) -> bool:
        """Whether this was read as is stated now, except for what its readings mean."""
        is_same = (self.state, self.within, stated.state) == ("read", stated.within, "waiting")
        return is_same and (self.unit, self.percent) != (stated.unit, stated.percent)

    def require_picture_size(self, width: int, height: int) -> None:
        """Raise PixelOutsidePicture if the drawn box is not in a picture of this size."""
        if self.within is not None and (self.within.right > width or self.within.bottom > height):
            raise PixelOutsidePicture(
                f"The box of the counter ends at {self.within.right}, {self.within.bottom}; the "
                f"picture has {width}x{height} px."
            )


SEARCHED = KeptCounter("waiting")
"""Nobody has stated anything: the counter is searched once the film is there."""


class CounterFiles:
    """Reads and writes these blobs."""

    def __init__(self, blobs: Blobs) -> None:
        self._blobs = blobs
        self._readings: LRUCache[Any, CounterReadings] = LRUCache(_READINGS_KEPT)
        self._lock = threading.Lock()

    def get(self, inspection_id: str) -> KeptCounter | None:
        """Return what is known; None if nobody has asked for the counter."""
        try:
            content = self._blobs.get(keys.counter(inspection_id))
        except BlobNotFound:
            return None
        return msgspec.json.decode(content, type=KeptCounter)

    def put(self, inspection_id: str, counter: KeptCounter) -> None:
        """Replace what is known; it is synced on return."""
        self._blobs.put(keys.counter(inspection_id), msgspec.json.encode(counter))

    def put_readings(self, inspection_id: str, counter: KeptCounter, csv: str) -> None:
        """Store readings, then that they exist."""
        self._blobs.put(keys.counter_readings(inspection_id), csv.encode())
        self.put(inspection_id, counter)

    def readings(self, inspection_id: str, counter: KeptCounter) -> CounterReadings:
        """Return the readings of a counter whose state is `read`."""
        return self._read(inspection_id, self.version(inspection_id), counter.place)

    @cachedmethod(
        lambda self: self._readings,
        lambda self, inspection_id, version, place: (inspection_id, version),
        lock=lambda self: self._lock,
    )
    def _read(
        self, inspection_id: str, _version: str, place: CounterPlace | None
    ) -> CounterReadings:
        csv = self._blobs.get(keys.counter_readings(inspection_id)).decode()
        return CounterReadings.from_csv(csv, place)

    def version(self, inspection_id: str) -> str:
        """Return a version of the readings: others have another one."""
        return str(self._blobs.about(keys.counter_readings(inspection_id)).revision)

    def is_waiting(self, inspection_id: str) -> bool:
        """Return whether the counter of an inspection is still to be read."""
        counter = self.get(inspection_id)
        return counter is not None and counter.state == "waiting"
