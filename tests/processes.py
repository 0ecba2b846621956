"""The server as its operator runs it: `chainage serve` in a separate process."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from builders import TOKEN, Client
from forks import Fork


class Process:
    """A running server process; its log is a file, so that it never waits for a reader."""

    url: str
    websocket_url: str

    def __init__(self, data: Path, log: Path, *, is_standby: bool = False, **settings: str) -> None:
        """Start it and, unless it is a standby, wait until it serves."""
        self.log = log
        log.touch()
        given = {"TOKEN": TOKEN, "DISK_RESERVE_BYTES": "0"} | settings
        self._process = Fork(
            ["serve", "--port", "0", "--data", str(data)],
            os.environ | {f"CHAINAGE_{name}": value for name, value in given.items()},
            log,
        )
        if not is_standby:
            self.wait_until_it_serves()

    def wait_until_it_serves(self) -> None:
        line = self._process.stdout.readline()
        assert line.startswith("Open http"), self.log.read_text()
        self.url = line.split()[1].partition("/login")[0]
        self.websocket_url = self.url.replace("http", "ws", 1)

    @property
    def pid(self) -> int:
        return self._process.pid

    def wait(self, patience_s: float = 30) -> int:
        """Wait for its end; return the exit code, of a signal a negative one."""
        return self._process.wait(patience_s)

    def terminate(self, patience_s: float = 30) -> int:
        """Terminate it like a service manager; return the exit code."""
        return self._process.terminate(patience_s)

    def end(self) -> None:
        """End it in whatever state it is."""
        self._process.end()


@contextmanager
def process(data: Path, **settings: str) -> Iterator[Client]:
    """Yield a client of a server process over a data folder; settings without their prefix."""
    server = Process(data, data.with_name(f"{data.name}.log"), **settings)
    try:
        with Client(server, TOKEN) as client:  # type: ignore[arg-type]  # has what it needs
            client.data = data
            yield client
    finally:
        server.end()
