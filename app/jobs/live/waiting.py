"""The queue of frames between a camera and the tracker."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass, field

from vo_core.sources import Frame

MOST = 3
"""Most waiting frames: 100 ms at 30 a second, a typical delay on a busy machine."""


@dataclass
class Captured:
    """A frame for the tracker."""

    frame: Frame
    captured_s: float
    """Arrival time of its packet, by `time.monotonic`."""
    skipped: list[tuple[int, float]] = field(default_factory=list)
    """Number and time of the frames that were dropped just before it."""


class Waiting:
    """The newest untaken frames; when there are too many, the oldest is dropped.

    The very first frame is never dropped, as the track begins there. A patient queue drops nothing
    and makes the source wait.
    """

    def __init__(self, *, is_patient: bool) -> None:
        self._changed = threading.Condition()
        self._frames: deque[Captured] = deque()
        self._is_patient = is_patient
        self._is_begun = self._is_closed = False
        self._dropped = 0

    @property
    def dropped(self) -> int:
        """Number of frames dropped so far."""
        with self._changed:
            return self._dropped

    def add(self, captured: Captured) -> None:
        """Add the newest frame."""
        with self._changed:
            if self._is_patient:  # this ends: the tracker takes one or ends with the whole process
                self._changed.wait_for(lambda: len(self._frames) < MOST or self._is_closed)
            self._frames.append(captured)
            if len(self._frames) > MOST:
                self._leave_out(0 if self._is_begun else 1)
            self._changed.notify_all()

    def _leave_out(self, position: int) -> None:
        left_out = self._frames[position]
        after = self._frames[position + 1]
        number_and_time = (left_out.frame.index, left_out.frame.t_s)
        after.skipped = [*left_out.skipped, number_and_time, *after.skipped]
        del self._frames[position]
        self._dropped += 1

    def take(self, timeout_s: float) -> Captured | None:
        """Return the oldest frame; None if none comes in time, or ever."""
        with self._changed:
            self._changed.wait_for(lambda: self._frames or self._is_closed, timeout_s)
            if not self._frames:
                return None
            self._is_begun = True
            self._changed.notify_all()
            return self._frames.popleft()

    def close(self) -> None:
        """Close the queue: waiting frames can still be taken."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()

    @property
    def is_over(self) -> bool:
        """Whether it is closed and empty."""
        with self._changed:
            return self._is_closed and not self._frames
