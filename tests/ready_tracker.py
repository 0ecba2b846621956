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
from dataclasses import asdict, astuple, dataclass
from functools import partial
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from typing import Any

import msgspec

from app.jobs import child, confinement
from app.jobs.messages import Answer, Failed, Limits, Part, Problem, encode
from app.jobs.requests import media
from app.jobs.requests.media import PictureRequest, ProbeRequest
from app.jobs.track import tracker
from app.jobs.track.batches import Batch
from app.jobs.track.messages import Checkpoint, Passing, TrackRequest
from vo_core import Rig
from vo_core.errors import RigVideoMismatch
from vo_core.video_info import VideoInfo

LIMITS = Limits(768 * 2**20, cpu_s=20)
"""The smallest limits that an operator may set."""
WALL_CLOCK_S = 120.0
"""A file that takes this long hangs; one that is worked on meets its limit before."""
_MESSAGES = msgspec.msgpack.Decoder(Part | Answer | Failed)


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
    media.warm_up()
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
        confinement.set_limits(LIMITS)
        for request in (ProbeRequest(video), PictureRequest(video, 0.2, 80)):
            child.answer(connection, partial(media.result_of, request), "Reading the video")
        sys.argv[1:] = [str(connection.fileno())]
        with suppress(EOFError):  # the parent has seen enough
            tracker.main()
    finally:
        os._exit(0)


def _drained(connection: Connection, request: TrackRequest, begun_s: float) -> tuple[str, str, int]:
    """Return what a parent would conclude from the children's messages."""
    parts = msgspec.msgpack.Decoder(Batch | Checkpoint | Passing)
    times_s: list[float] = []
    try:
        probed, picture = (_received(connection, begun_s) for _ in range(2))
        for answer in (probed, picture):
            if isinstance(answer, Failed) and answer.trace:
                return "unforeseen", answer.trace, 0
        if isinstance(probed, Answer):
            info = msgspec.msgpack.decode(probed.value, type=VideoInfo)
            json.dumps(asdict(info), allow_nan=False)
            Rig.parse(request.rig).require_picture_size(info.width, info.height)
        connection.send_bytes(encode(request))
        while isinstance(message := _received(connection, begun_s), Part):
            part = parts.decode(message.value)
            for estimate in part.estimates if isinstance(part, Batch) else ():
                numbers = [v for v in astuple(estimate) if not isinstance(v, str)]
                if estimate.frame != len(times_s) or not all(map(math.isfinite, numbers)):
                    said = f"{numbers} after {len(times_s)} frames"
                    return "unforeseen", said, len(times_s)
                times_s.append(estimate.time_s)
    except RigVideoMismatch as error:
        return "rig_video_mismatch", str(error), 0
    except TimeoutError:
        return "timed out", "", len(times_s)
    except (EOFError, ConnectionError):
        return "crashed", "", len(times_s)
    if isinstance(message, Answer):
        problem = msgspec.msgpack.decode(message.value, type=Problem).sentence
        return "partial" if problem else "whole", problem or "", len(times_s)
    if message.trace:
        return "unforeseen", message.trace, len(times_s)
    return message.code, message.detail, len(times_s)


def _received(connection: Connection, begun_s: float) -> Part | Answer | Failed:
    if not connection.poll(max(begun_s + WALL_CLOCK_S - time.monotonic(), 0)):
        raise TimeoutError
    return _MESSAGES.decode(connection.recv_bytes())


if __name__ == "__main__":
    _serve()
