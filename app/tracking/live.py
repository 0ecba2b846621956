"""Live events for listeners: the live socket, the 3D scene, the photos.

Events are published from the tracking threads and from requests. A listener is called in that
thread, so it must return at once: it stores the newest event or puts it on its own queue.
"""

from __future__ import annotations

import itertools
import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from app.jobs.live.messages import CameraStatus
from app.storage.database.tables import ENDED
from vo_core.image.health import Health
from vo_core.track import Estimate

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Progress:
    """Progress of the tracking."""

    frames_done: int = 0
    frames_total: int | None = None
    """Number stated by the container; exact only when tracking is done."""
    fps: float | None = None
    """Frames tracked per second."""
    eta_s: float | None = None


@dataclass(frozen=True)
class Update:
    """New results of tracking, or a new state of the inspection."""

    inspection_id: str
    state: str
    """queued, running, done, failed or cancelled."""
    progress: Progress = Progress()
    estimates: tuple[Estimate, ...] = ()
    """Estimates since the previous update; `jpeg` shows the last of their frames."""
    jpeg: bytes = b""
    captured_s: float | None = None
    """Time when the frame of `jpeg` came from the camera, by `time.monotonic`."""
    camera: CameraStatus | None = None
    """None for files."""
    health: Health | None = None
    """Picture health of the last frame."""
    seq: int = 0
    """Given when it is published: rises with every update of the server, so that readers can order
    them."""


@dataclass(frozen=True)
class ObservationsChanged:
    """What people state has changed: an observation, its photo or attachments, a remark, the
    review, the name or the header.
    """

    inspection_id: str


@dataclass(frozen=True)
class DistancesCorrected:
    """All distances of the inspection must be read again."""

    inspection_id: str


@dataclass(frozen=True)
class CounterRead:
    """The counter of the film has other readings, or another unit."""

    inspection_id: str


@dataclass(frozen=True)
class WallChanged:
    """Tiles of the unrolled wall have a new picture."""

    inspection_id: str
    indices: tuple[int, ...]


@dataclass(frozen=True)
class FindingsChanged:
    """There are other findings, one was decided about, or their search has another state."""

    inspection_id: str


Event = (
    Update | ObservationsChanged | DistancesCorrected | CounterRead | WallChanged | FindingsChanged
)
Listener = Callable[[Event], None]


class Live:
    """Publishes the events of every inspection to their listeners."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._seq = itertools.count(1)
        self._newest: dict[str, Update] = {}
        self._listeners: dict[str | None, list[Listener]] = {}

    def publish(self, update: Update) -> None:
        """Notify the listeners; the newest update of an active inspection is stored."""
        with self._lock:  # of two concurrent updates the one with the higher number is stored
            update = replace(update, seq=next(self._seq))
            if update.state in ENDED:
                self._newest.pop(update.inspection_id, None)
            else:
                self._newest[update.inspection_id] = update
        self._notify(update)

    def observations_changed(self, inspection_id: str) -> None:
        """Notify the listeners that what people state must be read again."""
        self._notify(ObservationsChanged(inspection_id))

    def wall_changed(self, inspection_id: str, indices: tuple[int, ...]) -> None:
        """Notify the listeners that these tiles of the unrolled wall must be read again."""
        self._notify(WallChanged(inspection_id, indices))

    def findings_changed(self, inspection_id: str) -> None:
        """Notify the listeners that the findings must be read again."""
        self._notify(FindingsChanged(inspection_id))

    def corrected(self, inspection_id: str) -> None:
        """Notify the listeners that published distances have changed."""
        self._notify(DistancesCorrected(inspection_id))

    def counter_read(self, inspection_id: str) -> None:
        """Notify the listeners that the counter says something else."""
        self._notify(CounterRead(inspection_id))

    def newest(self, inspection_id: str) -> Update | None:
        """Return the newest update of an active inspection."""
        with self._lock:
            return self._newest.get(inspection_id)

    @contextmanager
    def listening(self, inspection_id: str | None, listener: Listener) -> Iterator[None]:
        """Call `listener` for every event of an inspection (None: of all) until the block ends."""
        with self._lock:
            self._listeners.setdefault(inspection_id, []).append(listener)
        try:
            yield
        finally:
            with self._lock:
                listeners = self._listeners[inspection_id]
                listeners.remove(listener)
                if not listeners:
                    del self._listeners[inspection_id]

    def _notify(self, event: Event) -> None:
        with self._lock:
            listeners = [
                *self._listeners.get(event.inspection_id, ()),
                *self._listeners.get(None, ()),
            ]
        for listener in listeners:
            try:
                listener(event)
            except Exception:
                # A fault of one listener must not end the tracking that publishes.
                logger.exception("A listener of inspection %s failed.", event.inspection_id)
