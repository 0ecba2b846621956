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
from dataclasses import dataclass

from app.storage.database.tables import ENDED
from vo_core.image.health import Health
from vo_core.track import Estimate

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Progress:
    """Progress of the tracking."""

    frames_done: int
    frames_total: int | None
    """Number stated by the container; exact only when tracking is done."""
    fps: float | None
    """Frames tracked per second."""
    eta_s: float | None


@dataclass(frozen=True)
class CameraStatus:
    """State of the camera of a live inspection."""

    connected: bool
    reconnects: int
    dropped: int
    """Frames that are in the recording but came too fast to be tracked."""
    recorded_s: float
    detail: str | None
    """A sentence that says why there is no picture."""
    free_bytes: int
    """Free space for the rest of the recording."""
    is_recording: bool = True
    """False while the disk is full; tracking goes on."""


@dataclass(frozen=True)
class Update:
    """New results of tracking, or a new state of the inspection."""

    inspection_id: str
    seq: int
    """Rises with every update of the server, so that readers can order updates."""
    state: str
    """queued, running, done, failed or cancelled."""
    progress: Progress
    estimates: tuple[Estimate, ...] = ()
    """Estimates since the previous update; `jpeg` shows the last of their frames."""
    jpeg: bytes = b""
    captured_s: float | None = None
    """Time when the frame of `jpeg` came from the camera, by `time.monotonic`."""
    camera: CameraStatus | None = None
    """None for files."""
    health: Health | None = None
    """Picture health of the last frame."""


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
class WallChanged:
    """Tiles of the unrolled wall have a new picture."""

    inspection_id: str
    indices: tuple[int, ...]


Event = Update | ObservationsChanged | DistancesCorrected | WallChanged
Listener = Callable[[Event], None]


class Live:
    """Publishes the events of every inspection to their listeners."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._seq = itertools.count(1)
        self._newest: dict[str, Update] = {}
        self._listeners: dict[str | None, list[Listener]] = {}

    def publish(
        self,
        inspection_id: str,
        state: str,
        progress: Progress,
        estimates: tuple[Estimate, ...] = (),
        jpeg: bytes = b"",
        *,
        captured_s: float | None = None,
        camera: CameraStatus | None = None,
        health: Health | None = None,
    ) -> None:
        """Notify the listeners; the newest update of an active inspection is stored."""
        with self._lock:  # of two concurrent updates the one with the higher number is stored
            update = Update(
                inspection_id,
                next(self._seq),
                state,
                progress,
                estimates,
                jpeg,
                captured_s,
                camera,
                health,
            )
            if state in ENDED:
                self._newest.pop(inspection_id, None)
            else:
                self._newest[inspection_id] = update
        self._notify(update)

    def observations_changed(self, inspection_id: str) -> None:
        """Notify the listeners that what people state must be read again."""
        self._notify(ObservationsChanged(inspection_id))

    def wall_changed(self, inspection_id: str, indices: tuple[int, ...]) -> None:
        """Notify the listeners that these tiles of the unrolled wall must be read again."""
        self._notify(WallChanged(inspection_id, indices))

    def corrected(self, inspection_id: str) -> None:
        """Notify the listeners that published distances have changed."""
        self._notify(DistancesCorrected(inspection_id))

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
