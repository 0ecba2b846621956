"""Work that few may do at a time."""

from __future__ import annotations

import threading

from app.errors import Busy

_WAIT_S = 60.0


class Permits:
    """Lets callers do something, so many at once; others wait for a minute."""

    def __init__(self, busy: str, *, at_once: int = 1) -> None:
        """Prepare the permits; `busy` is the sentence of the error after that minute."""
        self._busy = busy
        self._free = threading.Semaphore(at_once)

    def __enter__(self) -> None:
        if not self._free.acquire(timeout=_WAIT_S):
            raise Busy(self._busy)

    def __exit__(self, *_: object) -> None:
        self._free.release()
