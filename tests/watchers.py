"""Viewers of the live socket, as programs: some acknowledge, some are slow, some never read."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from builders import BLOCK
from websockets.asyncio.client import connect

SLOW_S = 1.0
"""Time that a slow reader takes for each message."""
_READ_NUMBER_EVERY = 60


@dataclass
class Seen:
    """The messages that one viewer got."""

    arrived_s: list[float] = field(default_factory=list)
    """Arrival times by `time.time`."""
    time_s: list[float] = field(default_factory=list)
    """Times of the frames on the clock of the recording."""
    frames: list[int] = field(default_factory=list)
    numbers: list[tuple[float, int]] = field(default_factory=list)
    """For some messages, `time_s` and the number shown in the picture."""


@dataclass(frozen=True)
class Viewer:
    """What to watch, and how long to take for a message."""

    url: str
    origin: str
    token: str
    pause_s: float = 0.0


def watch(viewers: Sequence[Viewer], until_s: float) -> list[Seen]:
    """Run all viewers concurrently until this moment by `time.time`; call it in a separate
    process.
    """

    async def all_of_them() -> list[Seen]:
        return await asyncio.gather(*(_watch(viewer, until_s) for viewer in viewers))

    return asyncio.run(all_of_them())


async def _watch(viewer: Viewer, until_s: float) -> Seen:
    seen = Seen()
    headers = {"Authorization": f"Bearer {viewer.token}"}
    async with connect(
        viewer.url, origin=viewer.origin, additional_headers=headers, max_size=None,
        compression=None, max_queue=2,
    ) as socket:  # fmt: skip
        while (left_s := until_s - time.time()) > 0:
            try:
                message = await asyncio.wait_for(socket.recv(), left_s)
            except TimeoutError:
                break
            if isinstance(message, bytes):
                seq = _note(seen, message)
                await asyncio.sleep(min(viewer.pause_s, max(until_s - time.time(), 0.0)))
                await socket.send(json.dumps({"type": "ack", "seq": seq}))
    return seen


def _note(seen: Seen, message: bytes) -> int:
    """Add a message; return its number."""
    end = 4 + int.from_bytes(message[:4], "big")
    header = json.loads(message[4:end])
    if header["age_ms"] is not None and len(message) > end:
        seen.arrived_s.append(time.time())
        seen.time_s.append(header["time_s"])
        seen.frames.append(header["frame"])
        if len(seen.frames) % _READ_NUMBER_EVERY == 1:
            seen.numbers.append((header["time_s"], number_of(message[end:])))
    return int(header["seq"])


def number_of(jpeg: bytes) -> int:
    """Return the number in the picture of a numbered camera."""
    picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    row = picture[BLOCK // 2, BLOCK // 2 : 16 * BLOCK : BLOCK]
    return sum(1 << i for i, grey in enumerate(row) if grey > 127)
