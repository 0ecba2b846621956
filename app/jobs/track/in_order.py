"""A second thread that does one piece of work after the other."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

MOST_WAITING = 4
"""Pieces that may wait; each holds a picture."""


class InOrder:
    """Does work in a thread of its own, in the order in which it is given.

    What a piece of work raises is raised in the thread that gives the next one, or waits; pieces
    after it are not done.
    """

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "look")
        self._given: deque[Future[None]] = deque()
        """Those that are not done, or not known to be, in their order."""

    def do(self, work: Callable[[], None]) -> None:
        """Have a piece of work done after those before it; wait while too many are left."""
        while self._given and (len(self._given) >= MOST_WAITING or self._given[0].done()):
            self._given.popleft().result()
        before = self._given[-1] if self._given else None
        self._given.append(self._thread.submit(_after, before, work))

    def wait(self) -> None:
        """Wait until all work is done."""
        while self._given:
            self._given.popleft().result()

    def stop(self) -> None:
        """End the thread; what it has not begun is not done."""
        self._thread.shutdown(cancel_futures=True)

    def __reduce__(self) -> tuple[type[InOrder], tuple[()]]:
        """Without the thread: a copy has its own."""
        return InOrder, ()


def _after(before: Future[None] | None, work: Callable[[], None]) -> None:
    if before is not None:
        before.result()  # it is done, or has failed, as one thread does all
    work()
