"""The code of the children in the process of a test: without an interpreter to start, and the
tracker by a clock that passes only while somebody sleeps.
"""

from __future__ import annotations

import math
import threading
import time
from multiprocessing.connection import Pipe
from typing import Any

import msgspec
import pytest

from app.jobs import child
from app.jobs.live import camera
from app.jobs.live.messages import LiveRequest
from app.jobs.messages import Problem, encode
from app.jobs.track import tracker
from app.jobs.track.batches import Batch
from app.jobs.track.follow import Follower
from app.jobs.track.messages import Checkpoint, Passing, TrackRequest

FromTracker = Batch | Checkpoint | Passing | Problem


class VirtualClock:
    """Stands for the module `time`."""

    process_time = staticmethod(time.process_time)

    def __init__(self) -> None:
        self.now_s = 1000.0

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, pause_s: float) -> None:
        self.now_s += pause_s


class _Parent(child.Parent):
    """Receives what a tracker sends, up to a checkpoint after so many frames if one is given."""

    def __init__(self, leave_at: float) -> None:
        self.messages: list[FromTracker] = []
        self._leave_at = leave_at
        self._decoder: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(
            Batch | Checkpoint | Passing
        )

    def send(self, part: object) -> None:
        message = self._decoder.decode(encode(part))
        self.messages.append(message)
        if isinstance(message, Checkpoint) and message.frames >= self._leave_at:
            raise BrokenPipeError


def track(
    request: TrackRequest, *, leave_at: int | None = None
) -> tuple[list[FromTracker], VirtualClock]:
    """All messages of a tracker with its answer, and its clock at the end; with `leave_at` up to a
    checkpoint after so many frames.
    """
    parent, clock = _Parent(math.inf if leave_at is None else leave_at), VirtualClock()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tracker, "time", clock)
        if leave_at is None:
            parent.messages.append(tracker.track(request, parent))  # type: ignore[arg-type]
        else:
            with pytest.raises(BrokenPipeError):
                tracker.track(request, parent)  # type: ignore[arg-type]
    return parent.messages, clock


def batch_of(follower: Follower) -> Batch:
    """Everything since the last batch."""
    found: list[Batch] = []
    follower.hand_on(found.append)
    follower.wait()
    (batch,) = found
    return batch


class CameraThread:
    """The camera process as a thread; the methods are those of `Child`."""

    def __init__(self) -> None:
        self._ours, self._theirs = Pipe()
        self._thread: threading.Thread | None = None

    def send(self, message: object) -> None:
        if self._thread is not None:
            self._ours.send_bytes(encode(message))
            return
        assert isinstance(message, LiveRequest)
        self._thread = threading.Thread(target=self._run, args=(message,), daemon=True)
        self._thread.start()

    def _run(self, request: LiveRequest) -> None:
        with self._theirs:
            parent = child.Parent(self._theirs)
            child.answer(self._theirs, lambda: camera.record(request, parent), "Tracking")

    def receive(self, timeout_s: float) -> bytes:
        if not self._ours.poll(timeout_s):
            raise TimeoutError
        return self._ours.recv_bytes()

    def end(self) -> None:
        self._ours.close()
        if self._thread is not None:
            self._thread.join()
