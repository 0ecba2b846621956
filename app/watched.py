"""Threads that work as long as the server runs: one that fails begins again, and can say so."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from app.back_off import BackOff
from vo_core.errors import ChainageError

logger = logging.getLogger(__name__)

_PAUSES = BackOff(first_s=0.1, longest_s=10.0)
_IN_A_ROW_S = 60.0
"""Time after a failure from which on another one is no longer of the same row."""
_MANY = 3
"""Failures in a row that are a trouble."""


class Watched:
    """A thread that begins its work again, after growing pauses, whenever that raises."""

    def __init__(self, name: str, work: Callable[[], None], *, stop_timeout_s: float) -> None:
        """Prepare the thread.

        Args:
            name: Of the thread.
            work: What it does; it returns when it is to stop, which its owner tells it.
            stop_timeout_s: How long `stop` waits for that.
        """
        self.name = name
        self._stop_timeout_s = stop_timeout_s
        self._run_work = work
        self._is_over = threading.Event()
        self._failures = 0
        """Failures in a row; the next fields are the last one's."""
        self._failed_s = 0.0
        self._fault = ""
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Wait for the work to end; it does not begin again."""
        self._is_over.set()
        if self._thread.is_alive():
            self._thread.join(self._stop_timeout_s)

    def trouble(self) -> str | None:
        """Return a sentence about a thread that is dead, or fails again and again."""
        if self._is_over.is_set() or self._thread.ident is None:
            return None
        if not self._thread.is_alive():
            return f"{self.name} is dead; restart the server."
        if self._failures < _MANY or time.monotonic() > self._failed_s + _IN_A_ROW_S:
            return None
        return (
            f"{self.name} has failed {self._failures} times in a row ({self._fault}) and is tried "
            "again; the server's log says why."
        )

    def _run(self) -> None:
        while not self._is_over.is_set():
            try:
                self._run_work()
            except BaseException as fault:  # whatever it is, the server needs this thread
                # What is raised on purpose says in a sentence what is wrong.
                trace = None if isinstance(fault, ChainageError) else fault
                logger.log(
                    logging.ERROR, "Thread %s begins again: %s", self.name, fault, exc_info=trace
                )
                now_s = time.monotonic()
                is_other_row = now_s > self._failed_s + _IN_A_ROW_S
                self._failures = 1 if is_other_row else self._failures + 1
                self._failed_s, self._fault = now_s, type(fault).__name__
                self._is_over.wait(_PAUSES.pause_s(self._failures - 1))
            else:
                return
