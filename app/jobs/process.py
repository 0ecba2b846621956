"""A child process with a pipe: fresh interpreter, no inherited files, no server environment."""

from __future__ import annotations

import os
import signal
import socket
import struct
import subprocess
import sys
from multiprocessing.connection import Connection, Pipe
from pathlib import Path

import msgspec

import app
from app.jobs.messages import MAX_MESSAGE_BYTES, encode

_GRACE_S = 2.0
_SEND_S = 10.0
"""A child that does not take a message for so long hangs."""


class Child:
    """`python -m module` holding one end of a pipe; ends when the parent's end closes.

    This is what multiprocessing's spawn does, without its two habits that do not fit here: it
    imports the parent's main module (the whole server) into the child, and it unpickles.
    """

    def __init__(self, module: str) -> None:
        self._connection, theirs = Pipe()
        with theirs:
            self._process = subprocess.Popen(  # noqa: S603  (our own interpreter and module)
                [sys.executable, "-P", "-m", module, str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                env=_environment(),
                process_group=0,  # a Ctrl-C in the terminal is for the server to handle
            )

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def send(self, message: msgspec.Struct) -> None:
        """Give it a message.

        Raises:
            TimeoutError: It does not take it.
            OSError: It has died.
        """
        self.send_bytes(encode(message))

    def send_bytes(self, content: bytes) -> None:
        """Give it bytes as they are; raises what `send` does."""
        self._limit(socket.SO_SNDTIMEO, _SEND_S)
        try:
            self._connection.send_bytes(content)
        except BlockingIOError as error:
            raise TimeoutError from error

    def receive(self, timeout_s: float) -> bytes:
        """Its next message.

        Raises:
            TimeoutError: Nothing came in time, or it stopped in the middle of a message.
            EOFError: It has died or closed its end, or what it sends is no message.
        """
        if not self._connection.poll(timeout_s):
            raise TimeoutError
        self._limit(socket.SO_RCVTIMEO, timeout_s)
        try:
            return self._connection.recv_bytes(MAX_MESSAGE_BYTES)
        except BlockingIOError as error:
            raise TimeoutError from error
        except OSError as error:
            raise EOFError from error

    def _limit(self, option: int, timeout_s: float) -> None:
        """Bound how long the pipe, which is a pair of sockets, waits for the next bytes."""
        seconds, rest_s = divmod(timeout_s, 1)
        with socket.socket(fileno=os.dup(self._connection.fileno())) as pipe:
            pipe.setsockopt(
                socket.SOL_SOCKET, option, struct.pack("ll", int(seconds), int(1e6 * rest_s))
            )

    def terminate(self) -> None:
        """Ask it to end; whoever waits in `receive` gets EOFError."""
        self._process.terminate()

    def end(self) -> int:
        """Make sure that it has ended; its exit code, negative for a signal."""
        self._connection.close()
        try:
            return self._process.wait(_GRACE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()

    def kill(self) -> int:
        """End it now."""
        self._process.kill()
        return self.end()

    def is_alive(self) -> bool:
        """Whether it runs."""
        return self._process.poll() is None


_HINTS: dict[int, str] = {
    signal.SIGKILL: ", perhaps for lack of memory",
    signal.SIGXCPU: ": it had used all the processor time that it may take",
}


def describe_exit(code: int) -> str:
    """How a process ended, for a person."""
    if code >= 0:
        return f"it ended by itself with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = "unknown"
    return f"it was ended by signal {-code} ({name}{_HINTS.get(-code, '')})"


def connection_from_arguments() -> Connection:
    """The child's end of the pipe; for the `main` of a child."""
    return Connection(int(sys.argv[1]))


def _environment() -> dict[str, str]:
    """Nothing secret: the access token stays with the server."""
    kept = {
        name: os.environ[name] for name in ("PATH", "LANG", "LC_ALL", "TZ") if name in os.environ
    }
    return kept | {
        "PYTHONPATH": str(Path(app.__file__).parent.parent),
        # Each thread of a numerics pool reserves address space, which is limited.
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
    }
