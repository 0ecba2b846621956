"""What parent and children say to each other, as msgpack.

A child that decodes hostile media must not be able to run code in the server, so nothing that comes
from it is unpickled: every message is decoded into these types and refused if it does not fit.
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec

MAX_MESSAGE_BYTES = 64 * 2**20


class Limits(msgspec.Struct, frozen=True, tag="limits"):
    """What a child may use, set by itself before it touches any media."""

    memory_bytes: int
    cpu_s: int | None = None


class TrackRequest(msgspec.Struct, frozen=True, tag="track"):
    """Parent to tracker: the one thing it is to do."""

    video: str
    rig: dict[str, Any]
    limits: Limits
    pace: float | None = None
    """At most so many seconds of video a second."""


class Row(msgspec.Struct, frozen=True, array_like=True):
    """An `Estimate` on its way."""

    frame: int
    time_s: float
    x_mm: float
    y_mm: float
    yaw_deg: float
    distance_mm: float
    sigma_distance_mm: float
    quality: float
    status: Literal["ok", "weak", "lost"]


class Batch(msgspec.Struct, frozen=True, tag="batch"):
    """Tracker to parent: the frames since the last batch, and the picture of the last of them."""

    rows: list[Row]
    jpeg: bytes


class Done(msgspec.Struct, frozen=True, tag="done"):
    """Tracker to parent: the video has ended; `problem` says what was wrong with the file."""

    problem: str | None


class Failed(msgspec.Struct, frozen=True, tag="failed"):
    """Either child to parent: it cannot be done."""

    code: str
    detail: str
    trace: str = ""
    """For the server's log."""


class ProbeRequest(msgspec.Struct, frozen=True, tag="probe"):
    """Parent to media worker: what is this file?"""

    video: str


class Probed(msgspec.Struct, frozen=True, tag="probed"):
    """Media worker to parent: `VideoInfo`."""

    width: int
    height: int
    codec: str
    container: str
    pixel_format: str | None
    frames: int | None
    duration_s: float | None
    rate_hz: float | None


class PictureRequest(msgspec.Struct, frozen=True, tag="picture"):
    """Parent to media worker: the frame shown at this time, as JPEG."""

    video: str
    t_s: float
    jpeg_quality: int


class Picture(msgspec.Struct, frozen=True, tag="picture"):
    """Media worker to parent."""

    jpeg: bytes


FromTracker = Batch | Done | Failed
ToMedia = Limits | ProbeRequest | PictureRequest
FromMedia = Probed | Picture | Failed

encode = msgspec.msgpack.Encoder().encode
