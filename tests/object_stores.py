"""A real S3 server for the tests, and a line to it that can be cut."""

from __future__ import annotations

import contextlib
import itertools
import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from urllib.parse import urlsplit

import httpx
from builders import PATIENCE_S, wait_until
from ports import free_port

CREDENTIALS = {"AWS_ACCESS_KEY_ID": "tests", "AWS_SECRET_ACCESS_KEY": "a-secret-of-the-tests"}


class ObjectStore:
    """A moto server; its content ends with its process."""

    def __init__(self, port: int) -> None:
        self.port = port
        self._numbers = itertools.count()

    def new(self, port: int | None = None) -> str:
        """Make a bucket; return the URL of a store in it, through another port if one is given."""
        bucket = f"films-{next(self._numbers)}"
        made = httpx.put(f"http://127.0.0.1:{self.port}/{bucket}", timeout=PATIENCE_S)
        assert made.is_success, made.text
        return self.url(bucket, port)

    def keys(self, url: str) -> set[str]:
        """Return all keys in the bucket of a store."""
        bucket = f"http://127.0.0.1:{self.port}/{urlsplit(url).hostname}"
        listed = httpx.get(bucket, timeout=PATIENCE_S)
        return set(re.findall("<Key>(.*?)</Key>", listed.text))

    def url(self, bucket: str, port: int | None = None) -> str:
        """Return the URL of a store in a bucket, which may be missing."""
        return f"s3://{bucket}/archive?endpoint=http://127.0.0.1:{port or self.port}"


@contextlib.contextmanager
def moto() -> Iterator[ObjectStore]:
    """Run a server until the block ends; its credentials are in the environment meanwhile."""
    port = free_port()
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    before = dict(os.environ)
    os.environ.update(CREDENTIALS)
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, stdout=quiet, stderr=quiet) as server:
        try:
            wait_until(lambda: _answers(port) or server.poll() is not None)
            assert server.poll() is None, "moto did not start."
            yield ObjectStore(port)
        finally:
            server.kill()
            os.environ.clear()
            os.environ.update(before)


class Line:
    """Forwards a port to another one until it is cut."""

    def __init__(self, target: int) -> None:
        self._target = target
        self.received = 0
        """Bytes that came from the target."""
        self._open: set[socket.socket] = set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._serve()

    def cut(self) -> None:
        """Refuse connections from now on, and end those that exist."""
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for end in list(self._open):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def mend(self) -> None:
        """Forward the same port again."""
        self._listener = socket.create_server(("127.0.0.1", self.port))
        self._serve()

    def _serve(self) -> None:
        threading.Thread(target=self._accept, args=(self._listener,), daemon=True).start()

    def _accept(self, listener: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while True:
                near = listener.accept()[0]
                far = socket.create_connection(("127.0.0.1", self._target))
                self._open |= {near, far}
                for ends in ((near, far, 0), (far, near, 1)):
                    threading.Thread(target=self._copy, args=ends, daemon=True).start()

    def _copy(self, source: socket.socket, target: socket.socket, counts: int) -> None:
        with contextlib.suppress(OSError):
            while block := source.recv(2**16):
                self.received += len(block) * counts
                target.sendall(block)
        for end in (source, target):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
        self._open.discard(source)
        source.close()


def _answers(port: int) -> bool:
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
        return True
    return False
