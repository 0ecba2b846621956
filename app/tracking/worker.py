"""A thread that works on demand until it is stopped."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod

from app.watched import Watched


class Worker(Watched, ABC):
    """Base of services with such a thread; their own state defines the work."""

    def __init__(self, name: str, *, stop_timeout_s: float) -> None:
        super().__init__(name, self._work, stop_timeout_s=stop_timeout_s)
        self._changed = threading.Condition()
        """Guards `_stopping` and the pending work; notified when either changes."""
        self._stopping = False

    def stop(self) -> None:
        """Finish the current work and stop."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        super().stop()

    def _pause(self, seconds: float) -> bool:
        """Wait so long, or until the thread must stop; return whether it must."""
        with self._changed:
            return self._changed.wait_for(lambda: self._stopping, seconds)

    @abstractmethod
    def _work(self) -> None:
        """Run in the thread; return when `_stopping` is set. It is called again after a fault."""
