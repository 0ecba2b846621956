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

_GRACE_S = 20.0
"""A child that does not end within this time hangs; on a busy machine ending takes seconds."""
_SEND_S = 10.0
"""A child that does not accept a message for this long hangs."""


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

        Raises:
            TimeoutError: Nothing came in time, or a message stopped halfway.
            EOFError: The child died, closed its end, or sent no valid message.
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
