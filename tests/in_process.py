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

from app.jobs.live import camera
from app.jobs.messages import Checkpoint, FromTracker, LiveRequest, TrackRequest, encode
from app.jobs.track import tracker


class VirtualClock:
    """Stands for the module `time`."""

    process_time = staticmethod(time.process_time)

    def __init__(self) -> None:
        self.now_s = 1000.0

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, pause_s: float) -> None:
        self.now_s += pause_s


class _Parent:
    """Receives what a tracker sends, up to a checkpoint after so many frames if one is given."""

    def __init__(self, leave_at: float) -> None:
        self.messages: list[FromTracker] = []
        self._leave_at = leave_at
        self._decoder: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(FromTracker)

    def send_bytes(self, content: bytes) -> None:
        message = self._decoder.decode(content)
        self.messages.append(message)
        if isinstance(message, Checkpoint) and message.frames >= self._leave_at:
            raise BrokenPipeError


def track(
    request: TrackRequest, *, leave_at: int | None = None
) -> tuple[list[FromTracker], VirtualClock]:
    """All messages of a tracker, and its clock at the end; with `leave_at` up to a checkpoint after
    so many frames.
    """
    parent, clock = _Parent(math.inf if leave_at is None else leave_at), VirtualClock()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tracker, "time", clock)
        if leave_at is None:
            tracker._track(request, parent)  # type: ignore[arg-type]
        else:
            with pytest.raises(BrokenPipeError):
                tracker._track(request, parent)  # type: ignore[arg-type]
    return parent.messages, clock


class CameraThread:
    """The camera process as a thread; the methods are those of `Child`."""

    def __init__(self) -> None:
        self._ours, self._theirs = Pipe()
        self._thread: threading.Thread | None = None

    def send(self, message: msgspec.Struct) -> None:
        if self._thread is not None:
            self._ours.send_bytes(encode(message))
            return
        assert isinstance(message, LiveRequest)
        self._thread = threading.Thread(target=self._run, args=(message,), daemon=True)
        self._thread.start()

    def _run(self, request: LiveRequest) -> None:
        with self._theirs:
            camera.serve(request, self._theirs)

    def receive(self, timeout_s: float) -> bytes:
        if not self._ours.poll(timeout_s):
            raise TimeoutError
        return self._ours.recv_bytes()

    def end(self) -> None:
        self._ours.close()
        if self._thread is not None:
            self._thread.join()
