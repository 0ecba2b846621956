"""Threads that work on demand until they are stopped, one step after the other."""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod

from app.errors import Busy, DiskFull, InspectionNotFound, StoreUnavailable
from app.logs import about
from app.tracking.live import Event
from app.watched import Watched

logger = logging.getLogger(__name__)

HINDRANCES = (Busy, DiskFull, StoreUnavailable)
"""What is wrong with the server and not with what is worked on."""
_PAUSE_AFTER_FAULT_S = 5.0
_LOOK_AGAIN_S = 2.0


class Worker(Watched, ABC):
    """Base of services with such a thread; their own state defines the work."""

    def __init__(self, name: str, *, stop_timeout_s: float) -> None:
        super().__init__(name, self._work, stop_timeout_s=stop_timeout_s)
        self._changed = threading.Condition()
        """Guards `_stopping` and the pending work; notified when either changes."""
        self._stopping = False
        self._is_woken = False

    def on_event(self, event: Event) -> None:
        """Follow what happens to inspections; most do."""

    def stop(self) -> None:
        """Finish the current work and stop."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        super().stop()

    def wake(self) -> None:
        """Let the next step begin at once."""
        with self._changed:
            self._is_woken = True
            self._changed.notify_all()

    @abstractmethod
    def _step(self) -> float | None:
        """Do the next piece of work.

        Returns:
            Seconds until the next step, unless the thread is woken before; None to wait for that.
        """

    def _work(self) -> None:
        while not self._stopping:
            try:
                pause_s = self._step()
            except HINDRANCES as hindrance:
                logger.warning("%s waits: %s", self.name, hindrance)
                self._pause(_PAUSE_AFTER_FAULT_S)
                continue
            with self._changed:
                self._changed.wait_for(lambda: self._is_woken or self._stopping, pause_s)
                self._is_woken = False

    def _pause(self, seconds: float) -> bool:
        """Wait so long, or until the thread must stop; return whether it must."""
        with self._changed:
            return self._changed.wait_for(lambda: self._stopping, seconds)


class InspectionWorker(Worker):
    """Looks at inspections that were announced; one that could not be looked at is due again."""

    def __init__(self, name: str, *, stop_timeout_s: float) -> None:
        super().__init__(name, stop_timeout_s=stop_timeout_s)
        self._due: dict[str, bool] = {}
        """Inspections to look at, the oldest first, and whether a person waits for it; `_changed`
        guards them."""

    def announce(self, inspection_id: str, *, is_asked: bool = False) -> None:
        """Look at an inspection soon."""
        with self._changed:
            self._due[inspection_id] = is_asked or self._due.get(inspection_id, False)
        self.wake()

    @abstractmethod
    def _look_at(self, inspection_id: str) -> None:
        """Do what is to be done about an inspection."""

    def _may_take(self, *, is_asked: bool) -> bool:
        """Whether an inspection may be looked at now."""
        return True

    def _step(self) -> float | None:
        asked = self._take(is_asked=True)
        inspection_id = asked or self._take(is_asked=False)
        if inspection_id is None:
            return _LOOK_AGAIN_S if self._due else None
        try:
            with about(inspection_id):
                self._look_at(inspection_id)
        except InspectionNotFound:
            logger.debug("Inspection %s was deleted meanwhile.", inspection_id)
        except HINDRANCES:
            self.announce(inspection_id, is_asked=asked is not None)
            raise
        except Exception:
            logger.exception("%s: inspection %s is tried again.", self.name, inspection_id)
            self.announce(inspection_id, is_asked=asked is not None)
            self._pause(_PAUSE_AFTER_FAULT_S)
        return 0.0

    def _take(self, *, is_asked: bool) -> str | None:
        """Take the oldest inspection for which a person waits, or the oldest other one."""
        with self._changed:
            found = next((each for each, asked in self._due.items() if asked == is_asked), None)
        if found is None or not self._may_take(is_asked=is_asked):
            return None
        with self._changed:
            self._due.pop(found, None)
        return found
