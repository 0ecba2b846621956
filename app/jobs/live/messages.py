"""What a camera process and its parent send each other."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from app.jobs.live.load import Shed
from app.jobs.messages import Limits
from app.jobs.track.parts import Between, Mark


class CameraInput(msgspec.Struct, frozen=True):
    """An allowed live source, with the options for FFmpeg."""

    kind: Literal["rtsp", "mjpeg", "usb", "file", "pipe"]
    location: str
    """May contain a password: never shown, never logged."""
    options: dict[str, str] = {}
    peer: str | None = None
    """The only address to which connections are allowed."""


class LiveRequest(msgspec.Struct, frozen=True):
    """Capture, record and track until the parent sends anything else.

    Batches and states come before the answer, a `Problem`.
    """

    camera: CameraInput
    rig: dict[str, Any]
    recording: str
    """File of the recording; an existing one is continued."""
    marks_file: str
    """Its parts.csv."""
    limits: Limits
    reserve_bytes: int
    """Disk space that the recording leaves free."""
    last: dict[str, Any] | None = None
    """Estimate of the last frame that the parent knows, if a recording is continued."""
    zero_s: float | None = None
    """Time 0 of that recording by `time.monotonic`, which all processes share."""
    left_out: list[Mark] = []
    """Frames up to `last` that are not recorded."""
    between: Between | None = None
    """The robot's movement, if a new part begins after `last`."""


class CameraStatus(msgspec.Struct, frozen=True):
    """State of the camera of a live inspection."""

    connected: bool
    reconnects: int
    dropped: int
    """Frames that are in the recording but came too fast to be tracked."""
    recorded_s: float
    detail: str | None
    """A sentence that says why there is no picture."""
    is_recording: bool = True
    """False while the disk is full; tracking goes on."""
    skipped_share: float = 0.0
    """Share of the frames of the last seconds that came too fast to be tracked."""
    shed: tuple[Shed, ...] = ()
    """What the machine leaves out for that reason."""
    free_bytes: int = 0
    """Free space for the rest of the recording; the server knows it, as it does the next one."""
    is_ending: bool = False
    """Whether the recording has ended, and what was captured is still being tracked."""


class CameraState(msgspec.Struct, frozen=True, tag="camera"):
    """Told on every change and twice a second."""

    status: CameraStatus
    """Its counts are those since this process began."""
    zero_s: float | None
    left_out: list[Mark] = []
    """Frames that were not recorded, since the previous state."""


def shown(status: CameraStatus) -> tuple[bool, bool, str | None]:
    """Return the part of the state that a page must show at once when it changes."""
    return status.connected, status.is_recording, status.detail
