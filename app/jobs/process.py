"""A child process with a pipe: fresh interpreter, no inherited files, no server environment."""

from __future__ import annotations

import logging
import os
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Pipe
from pathlib import Path
from typing import Any, Self, TypeVar

import msgspec

import app
from app.errors import InvalidCalibration, MediaFailed, MediaTimeout
from app.jobs.messages import MAX_MESSAGE_BYTES, Answer, Failed, Part, encode
from vo_core.errors import UnreadableVideo

logger = logging.getLogger(__name__)

_GRACE_S = 20.0
"""A child that does not end within this time hangs; on a busy machine ending takes seconds."""
_LOOK_AGAIN_S = 1.0
_SEND_S = 10.0
"""A child that does not accept a message for this long hangs."""

Result = TypeVar("Result")
_MESSAGES: msgspec.msgpack.Decoder[Part | Answer | Failed] = msgspec.msgpack.Decoder(
    Part | Answer | Failed
)


class ChildFault(Exception):
    """A child gave no answer; the text says why."""


class Stalled(ChildFault):
    """It sent nothing for too long, and was killed."""


class Died(ChildFault):
    """It ended before its answer, or sent what it may not send; the text says how it ended."""

    def __init__(self, how: str, exit_code: int | None = None) -> None:
        super().__init__(how)
        self.exit_code = exit_code


class Refused(ChildFault):
    """It says itself why it failed."""

    def __init__(self, failed: Failed) -> None:
        super().__init__(failed.detail)
        self.code = failed.code
        self._trace = failed.trace

    def log(self, work: str) -> None:
        """Log a fault of the program."""
        if self._trace:
            logger.error("%s: %s %s", work, self, self._trace)


@dataclass(frozen=True)
class _Work:
    """What the threads of a process have done since its start; nothing once it has ended."""

    ran_s: float = 0.0
    """Processor time."""
    waited_s: float = 0.0
    """Time in which they waited for a processor, up to the last that they got."""
    is_runnable: bool = False
    """Whether one of them runs, or waits for a processor now."""

    @classmethod
    def done_by(cls, pid: int) -> _Work:
        """Read what Linux says, https://man7.org/linux/man-pages/man5/proc_pid_stat.5.html."""
        ticks = waited_ns = 0
        states = set[str]()
        with suppress(FileNotFoundError, ProcessLookupError):  # it, or a thread, has ended
            for thread in Path(f"/proc/{pid}/task").iterdir():
                fields = (thread / "stat").read_text().rpartition(")")[2].split()
                states.add(fields[0])
                ticks += int(fields[11]) + int(fields[12])
                # Not every kernel counts it.
                with suppress(FileNotFoundError):
                    waited_ns += int((thread / "schedstat").read_text().split()[1])
        return cls(ticks / os.sysconf("SC_CLK_TCK"), waited_ns / 1e9, "R" in states)


class Child:
    """Runs `python -m module` with one end of a pipe; the child ends when the parent's end closes.

    It works like multiprocessing's spawn, without importing the parent's main module (the whole
    server) into the child, and without unpickling.
    """

    def __init__(self, module: str) -> None:
        self._connection, theirs = Pipe()
        with theirs:
            self._process = subprocess.Popen(  # noqa: S603  (our own interpreter and module)
                [sys.executable, "-P", "-m", module, str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                env=_environment(),
                process_group=0,  # the server handles a Ctrl-C in the terminal
            )

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def ask(
        self,
        request: object,
        kind: type[Result],
        *,
        stall_s: float,
        part: Any = None,
        on_part: Callable[[Any], None] = lambda part: None,
        on_sent: Callable[[], object] = lambda: None,
    ) -> Result:
        """Send a request, and receive all messages up to the answer.

        Args:
            request: For the child.
            kind: Type of the answer.
            stall_s: Longest time without a message.
            part: Type of the results before the answer, if there are any.
            on_part: Called with each of them.
            on_sent: Called when the request was sent.
        Raises:
            Stalled, Died, Refused: There is no answer; without one, only a child that refused runs.
        """
        parts, answers = msgspec.msgpack.Decoder(part), msgspec.msgpack.Decoder(kind)
        with self._explained():
            self.send(request)
        on_sent()
        while True:
            with self._explained():
                message = _MESSAGES.decode(self.receive(stall_s))
                if isinstance(message, Failed):
                    raise Refused(message)
                if isinstance(message, Answer):
                    return answers.decode(message.value)
                found = parts.decode(message.value)
            on_part(found)

    @contextmanager
    def _explained(self) -> Iterator[None]:
        """Turn errors of the pipe into faults of the child, and make sure that it has ended."""
        try:
            yield
        except TimeoutError as error:
            self.kill()
            raise Stalled("it was silent for too long and was ended") from error
        except (EOFError, OSError) as error:
            code = self.end()
            raise Died(describe_exit(code), code) from error
        except msgspec.MsgspecError as error:
            self.kill()
            raise Died("it gave an invalid answer") from error

    def send(self, message: object) -> None:
        """Send a message to the child.

        Raises:
            TimeoutError: The child does not accept it.
            OSError: The child has died.
        """
        self._limit(socket.SO_SNDTIMEO, _SEND_S)
        try:
            self._connection.send_bytes(encode(message))
        except BlockingIOError as error:
            raise TimeoutError from error

    def receive(self, timeout_s: float) -> bytes:
        """Return the child's next message.

        Time in which the child waits for a processor does not count: on a busy machine it may get
        one for a hundredth of the time.

        Raises:
            TimeoutError: Nothing came in time, or a message stopped halfway.
            EOFError: The child died, closed its end, or sent no valid message.
        """
        if not self._has_message_within(timeout_s):
            raise TimeoutError
        self._limit(socket.SO_RCVTIMEO, timeout_s)
        try:
            return self._connection.recv_bytes(MAX_MESSAGE_BYTES)
        except BlockingIOError as error:
            raise TimeoutError from error
        except OSError as error:
            raise EOFError from error

    def _has_message_within(self, timeout_s: float) -> bool:
        began_s = time.monotonic()
        pause_s = min(_LOOK_AGAIN_S, timeout_s / 10)
        if self._connection.poll(pause_s):  # as nearly always, without looking at the process
            return True
        before = _Work.done_by(self.pid)
        pause_s = timeout_s - pause_s
        while not self._connection.poll(pause_s):
            now = _Work.done_by(self.pid)
            ran_s, waited_s = now.ran_s - before.ran_s, now.waited_s - before.waited_s
            idle_s = time.monotonic() - began_s - waited_s
            if ran_s >= timeout_s or (idle_s >= timeout_s and not now.is_runnable):
                return False
            pause_s = max(timeout_s - max(ran_s, idle_s), min(_LOOK_AGAIN_S, timeout_s / 10))
        return True

    def _limit(self, option: int, timeout_s: float) -> None:
        """Limit how long the pipe, a pair of sockets, waits for the next bytes."""
        seconds, rest_s = divmod(timeout_s, 1)
        with socket.socket(fileno=os.dup(self._connection.fileno())) as pipe:
            pipe.setsockopt(
                socket.SOL_SOCKET, option, struct.pack("ll", int(seconds), int(1e6 * rest_s))
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()

    def terminate(self) -> None:
        """Ask the child to end; a waiting `receive` gets EOFError."""
        self._process.terminate()

    def end(self) -> int:
        """Make sure that the child has ended; return its exit code, negative for a signal."""
        self._connection.close()
        try:
            return self._process.wait(_GRACE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()

    def kill(self) -> int:
        """Kill the child; return its exit code."""
        self._process.kill()
        return self.end()

    def is_alive(self) -> bool:
        """Return whether the child runs."""
        return self._process.poll() is None


_HINTS: dict[int, str] = {
    signal.SIGKILL: ", perhaps for lack of memory",
    signal.SIGXCPU: ": it had used all the processor time that it may take",
}


def describe_exit(code: int) -> str:
    """Describe for a person how a process ended."""
    if code >= 0:
        return f"it ended by itself with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = "unknown"
    return f"it was ended by signal {-code} ({name}{_HINTS.get(-code, '')})"


def ask_about_media(
    child: Child,
    request: object,
    kind: type[Result],
    *,
    work: str,
    stall_s: float,
    part: Any = None,
    on_part: Callable[[Any], None] = lambda part: None,
) -> Result:
    """Ask a child as `Child.ask` does.

    Args:
        work: What the child does, as the beginning of a sentence.
    Raises:
        UnreadableVideo, InvalidCalibration: The child says that the film cannot be used.
        MediaTimeout, MediaFailed: It took too long, died, or failed.
    """
    try:
        return child.ask(request, kind, stall_s=stall_s, part=part, on_part=on_part)
    except Stalled as error:
        raise MediaTimeout(f"{work} made no progress for {stall_s:g} s and was stopped.") from error
    except Died as death:
        raise MediaFailed(f"{work} failed, as its process died: {death}.") from death
    except Refused as refusal:
        refusal.log(work)
        told = {"unreadable_video": UnreadableVideo, "invalid_calibration": InvalidCalibration}
        raise told.get(refusal.code, MediaFailed)(str(refusal)) from refusal


def _environment() -> dict[str, str]:
    """Return an environment without secrets: the access token stays with the server."""
    kept = {
        name: os.environ[name] for name in ("PATH", "LANG", "LC_ALL", "TZ") if name in os.environ
    }
    return kept | {
        "PYTHONPATH": str(Path(app.__file__).parent.parent),
        # Each thread of a numerical library's pool reserves address space, which is limited, and
        # takes a processor from another film while it waits for small work.
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "OPENCV_FOR_THREADS_NUM": "1",
    }
