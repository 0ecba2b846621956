"""A thread that does work as it comes up, until it is stopped."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod


class Worker(ABC):
    """What a service with such a thread is made of; its own state says what is to be done."""

    def __init__(self, name: str, *, stop_timeout_s: float) -> None:
        self._changed = threading.Condition()
        """Guards `_stopping` and what is to be done; notified when either changes."""
        self._stopping = False
        self._stop_timeout_s = stop_timeout_s
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """Finish what is in hand, and end."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        self._thread.join(self._stop_timeout_s)

    def is_alive(self) -> bool:
        """Whether the thread runs."""
        return self._thread.is_alive()

    @abstractmethod
    def _work(self) -> None:
        """Of the thread: returns when `_stopping` is set."""
