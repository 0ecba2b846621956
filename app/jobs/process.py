"""A child process with a pipe: fresh interpreter, no inherited files, no server environment."""

from __future__ import annotations

import os
import signal
import socket
import struct
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, Pipe
from pathlib import Path

import msgspec

import app
from app.jobs.messages import MAX_MESSAGE_BYTES, encode

_GRACE_S = 20.0
"""A child that does not end within this time hangs; on a busy machine ending takes seconds."""
_LOOK_AGAIN_S = 1.0
_SEND_S = 10.0
"""A child that does not accept a message for this long hangs."""


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
    def of(cls, pid: int) -> _Work:
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

    def send(self, message: msgspec.Struct) -> None:
        """Send a message to the child.

        Raises:
            TimeoutError: The child does not accept it.
            OSError: The child has died.
        """
        self.send_bytes(encode(message))

    def send_bytes(self, content: bytes) -> None:
        """Send bytes unchanged; raises the same errors as `send`."""
        self._limit(socket.SO_SNDTIMEO, _SEND_S)
        try:
            self._connection.send_bytes(content)
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
        began_s, before = time.monotonic(), _Work.of(self.pid)
        pause_s = timeout_s
        while not self._connection.poll(pause_s):
            now = _Work.of(self.pid)
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


def connection_from_arguments() -> Connection:
    """Return the child's end of the pipe; for the `main` of a child."""
    return Connection(int(sys.argv[1]))


def _environment() -> dict[str, str]:
    """Return an environment without secrets: the access token stays with the server."""
    kept = {
        name: os.environ[name] for name in ("PATH", "LANG", "LC_ALL", "TZ") if name in os.environ
    }
    return kept | {
        "PYTHONPATH": str(Path(app.__file__).parent.parent),
        # Each thread of a numerical library's pool reserves address space, which is limited.
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
    }
