"""A camera process, or its code in a thread, and its messages."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from ipaddress import ip_network
from pathlib import Path

import msgspec
from builders import HEIGHT, PATIENCE_S, WIDTH, clip_rig
from in_process import CameraThread

from app.jobs.live.messages import CameraInput, CameraState, LiveRequest
from app.jobs.messages import Answer, Failed, Limits, Part, Problem
from app.jobs.process import Child
from app.jobs.track.batches import Batch
from app.tracking.cameras import Sources
from vo_core import Estimate

LOOPBACK = Sources([ip_network("127.0.0.0/8")], None)
LIMITS = Limits(1536 * 2**20, file_bytes=2**30)


@dataclass
class Session:
    """A camera whose pictures are recorded and tracked."""

    camera: CameraInput
    recording: Path
    limits: Limits = LIMITS
    reserve_bytes: int = 0
    last: Estimate | None = None
    zero_s: float | None = None
    child: Child | CameraThread = field(default_factory=CameraThread)
    rows: list[Estimate] = field(default_factory=list)
    states: list[CameraState] = field(default_factory=list)
    end: Problem | Failed | None = None

    def __post_init__(self) -> None:
        self.child.send(
            LiveRequest(
                self.camera,
                clip_rig(),
                str(self.recording),
                str(self.recording.with_name("parts.csv")),
                self.limits,
                self.reserve_bytes,
                asdict(self.last) if self.last else None,
                self.zero_s,
            )
        )
        self._messages = msgspec.msgpack.Decoder(Part | Answer | Failed)
        self._parts = msgspec.msgpack.Decoder(Batch | CameraState)

    def until(self, condition: Callable[[], object]) -> Session:
        """Listen until it is so or the end."""
        deadline = time.monotonic() + PATIENCE_S
        while self.end is None and not condition():
            assert time.monotonic() < deadline, self.states
            match self._messages.decode(self.child.receive(PATIENCE_S)):
                case Part(value):
                    self._take(self._parts.decode(value))
                case Answer(value):
                    self.end = msgspec.msgpack.decode(value, type=Problem)
                case Failed() as failed:
                    self.end = failed
        return self

    def _take(self, part: Batch | CameraState) -> None:
        if isinstance(part, Batch):
            self.rows += part.estimates
        else:
            self.states.append(part)

    def until_end(self) -> Session:
        self.until(lambda: False)
        self.child.end()
        return self

    def stop(self) -> Session:
        with suppress(BrokenPipeError):  # it may have ended by itself
            self.child.send(None)
        return self.until_end()

    def frames(self, count: int) -> Session:
        return self.until(lambda: len(self.rows) >= count)

    def until_said(self, words: str = "") -> Session:
        """Listen until a state says why there is no picture, in a sentence with these words."""
        return self.until(
            lambda: any(s.status.detail and words in s.status.detail for s in self.states)
        )


def session(url: str, folder: Path, **more: object) -> Session:
    """Record a source on loopback into a folder."""
    found = LOOPBACK.resolve(url, (WIDTH, HEIGHT)).camera
    return Session(found, folder / "recording.mkv", **more)  # type: ignore[arg-type]
