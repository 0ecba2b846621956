"""A process that has loaded the children's code and forks, to try thousands of files under limits.

Run as a program it reads one request a line and answers each in a line, both JSON.  Every file goes
through `app.jobs.requests.media` (probe and a picture) and `app.jobs.track.tracker`, unchanged, in
a forked process that has set its own limits. Only the second that an interpreter takes to start and
load its modules is saved.
"""

from __future__ import annotations

import gc
import json
import math
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from typing import Any

import msgspec

from app.jobs import limits
from app.jobs.messages import (
    Batch,
    Done,
    Failed,
    FromMedia,
    FromTracker,
    Limits,
    PictureRequest,
    Probed,
    ProbeRequest,
    TrackRequest,
    encode,
)
from app.jobs.requests import media
from app.jobs.track import tracker
from vo_core import Rig
from vo_core.errors import RigVideoMismatch

LIMITS = Limits(768 * 2**20, cpu_s=20)
"""The smallest limits that an operator may set."""
WALL_CLOCK_S = 120.0
"""A file that takes this long hangs; one that is worked on meets its limit before."""


@dataclass(frozen=True)
class Verdict:
    """The outcome for a file."""

    end: str
    """`whole`, `partial`, `crashed`, `timed out`, or the code of a failure."""
    said: str
    """The sentence, if there is one."""
    frames: int
    seconds: float


class ReadyTracker:
    """The forking process as a context manager."""

    def __init__(self, rig: dict[str, Any]) -> None:
        self._rig = rig
        tests = Path(__file__).parent
        path = os.pathsep.join((str(tests.parent), str(tests)))
        self._process = subprocess.Popen(
            [sys.executable, "-P", __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            process_group=0,  # its parent handles a Ctrl-C
            env={"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1", "PATH": os.defpath},
        )

    def __enter__(self) -> ReadyTracker:
        return self

    def __exit__(self, *_error: object) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(30)

    def verdict(self, video: Path) -> Verdict:
        """Return the outcome for one file."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps({"video": str(video), "rig": self._rig}) + "\n")
        self._process.stdin.flush()
        return Verdict(**json.loads(self._process.stdout.readline()))


def _serve() -> None:
    media._warm_up()
    import app.jobs.track.follow  # noqa: F401

    gc.collect()
    gc.freeze()  # otherwise every fork would copy the memory that it frees
    for line in sys.stdin:
        request = json.loads(line)
        sys.stdout.write(json.dumps(asdict(_tried(request["video"], request["rig"]))) + "\n")
        sys.stdout.flush()


def _tried(video: str, rig: dict[str, Any]) -> Verdict:
    begun_s = time.monotonic()
    ours, theirs = Pipe()
    pid = os.fork()
    if pid == 0:
        ours.close()
        _child(video, theirs)
    theirs.close()
    with ours:
        end, said, frames = _drained(ours, TrackRequest(video, rig, LIMITS), begun_s)
    if end == "timed out":
        os.kill(pid, signal.SIGKILL)
    _, status = os.waitpid(pid, 0)
    if end == "crashed":
        said = f"signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else f"exit {status >> 8}"
    return Verdict(end, said, frames, time.monotonic() - begun_s)


def _child(video: str, connection: Connection) -> None:
    """Run in the child; never return."""
    try:
        limits.apply(LIMITS)
        for request in (ProbeRequest(video), PictureRequest(video, 0.2, 80)):
            connection.send_bytes(encode(media._answer(request)))
        sys.argv[1:] = [str(connection.fileno())]
        with suppress(EOFError):  # the parent has seen enough
            tracker.main()
    finally:
        os._exit(0)


def _drained(connection: Connection, request: TrackRequest, begun_s: float) -> tuple[str, str, int]:
    """Return what a parent would conclude from the children's messages."""
    from_media = msgspec.msgpack.Decoder(FromMedia)
    from_tracker = msgspec.msgpack.Decoder(FromTracker)
    rows: list[float] = []
    try:
        probed = from_media.decode(_received(connection, begun_s))
        picture = from_media.decode(_received(connection, begun_s))
        for answer in (probed, picture):
            if isinstance(answer, Failed) and answer.trace:
                return "unforeseen", answer.trace, 0
        if isinstance(probed, Probed):
            json.dumps(msgspec.structs.asdict(probed), allow_nan=False)
            Rig.parse(request.rig).require_picture_size(probed.width, probed.height)
        connection.send_bytes(encode(request))
        while not isinstance(
            message := from_tracker.decode(_received(connection, begun_s)), Done | Failed
        ):
            for row in message.rows if isinstance(message, Batch) else ():
                numbers = [v for v in msgspec.structs.astuple(row) if not isinstance(v, str)]
                if row.frame != len(rows) or not all(map(math.isfinite, numbers)):
                    return "unforeseen", f"row {numbers} after {len(rows)} rows", len(rows)
                rows.append(row.time_s)
    except RigVideoMismatch as error:
        return "rig_video_mismatch", str(error), 0
    except TimeoutError:
        return "timed out", "", len(rows)
    except (EOFError, ConnectionError):
        return "crashed", "", len(rows)
    if isinstance(message, Done):
        return "partial" if message.problem else "whole", message.problem or "", len(rows)
    if message.trace:
        return "unforeseen", message.trace, len(rows)
    return message.code, message.detail, len(rows)


def _received(connection: Connection, begun_s: float) -> bytes:
    if not connection.poll(max(begun_s + WALL_CLOCK_S - time.monotonic(), 0)):
        raise TimeoutError
    return connection.recv_bytes()


if __name__ == "__main__":
    _serve()
