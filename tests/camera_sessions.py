"""A camera process, or its code in a thread, and its messages."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from ipaddress import ip_network
from pathlib import Path

import msgspec
from builders import HEIGHT, PATIENCE_S, WIDTH, clip_rig
from in_process import CameraThread

from app.jobs.messages import (
    Batch,
    CameraInput,
    CameraState,
    Done,
    Failed,
    FromCamera,
    Limits,
    LiveRequest,
    Row,
    StopCapture,
)
from app.jobs.process import Child
from app.tracking.cameras import Sources

LOOPBACK = Sources([ip_network("127.0.0.0/8")], None)
LIMITS = Limits(1536 * 2**20, file_bytes=2**30)


@dataclass
class Session:
    """A camera whose pictures are recorded and tracked."""

    camera: CameraInput
    recording: Path
    limits: Limits = LIMITS
    reserve_bytes: int = 0
    last: Row | None = None
    zero_s: float | None = None
    child: Child | CameraThread = field(default_factory=CameraThread)
    rows: list[Row] = field(default_factory=list)
    states: list[CameraState] = field(default_factory=list)
    end: Done | Failed | None = None

    def __post_init__(self) -> None:
        self.child.send(
            LiveRequest(
                self.camera,
                clip_rig(),
                str(self.recording),
                str(self.recording.with_name("parts.csv")),
                self.limits,
                self.reserve_bytes,
                self.last,
                self.zero_s,
            )
        )
        self._decoder = msgspec.msgpack.Decoder(FromCamera)

    def until(self, condition: Callable[[], object]) -> Session:
        """Listen until it is so or the end."""
        deadline = time.monotonic() + PATIENCE_S
        while self.end is None and not condition():
            assert time.monotonic() < deadline, self.states
            match self._decoder.decode(self.child.receive(PATIENCE_S)):
                case Batch() as batch:
                    self.rows += batch.rows
                case CameraState() as state:
                    self.states.append(state)
                case Done() | Failed() as end:
                    self.end = end
        return self

    def until_end(self) -> Session:
        self.until(lambda: False)
        self.child.end()
        return self

    def stop(self) -> Session:
        with suppress(BrokenPipeError):  # it may have ended by itself
            self.child.send(StopCapture())
        return self.until_end()

    def frames(self, count: int) -> Session:
        return self.until(lambda: len(self.rows) >= count)

    def until_said(self, words: str = "") -> Session:
        """Listen until a state says why there is no picture, in a sentence with these words."""
        return self.until(lambda: any(s.detail and words in s.detail for s in self.states))


def session(url: str, folder: Path, **more: object) -> Session:
    """Record a source on loopback into a folder."""
    found = LOOPBACK.resolve(url, (WIDTH, HEIGHT)).camera
    return Session(found, folder / "recording.mkv", **more)  # type: ignore[arg-type]
