"""PostgreSQL servers of the tests, each on a socket of its own."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psycopg
import pytest
from debian import found_or_installed

ON_BOTH = pytest.mark.parametrize(
    "database_kind", ["sqlite", "postgresql"], indirect=True, scope="module"
)
"""Runs a test, or a file of tests by `pytestmark`, on both kinds of databases."""
_PACKAGES = Path("/", "usr", "lib", "postgresql")
"""Where Debian installs every version."""
_UNSAFE = ("-c", "fsync=off", "-c", "full_page_writes=off")
"""Faster, and what was committed still survives a kill, though no power cut."""
_NO_SERVER = (
    "There is no PostgreSQL. Install it with `apt-get install postgresql`, then run the tests of "
    "the database again."
)


class PostgresServer:
    """A server with databases of the tests."""

    def __init__(self, folder: Path, programs: Path, owner: str | None, *, is_safe: bool) -> None:
        self.folder = folder
        """Where its socket is."""
        self._data = folder / "data"
        self._postgres = programs / "postgres"
        self._owner = owner
        self._flags = () if is_safe else _UNSAFE
        self._give(folder)
        made = subprocess.run(
            [
                str(programs / "initdb"), "--pgdata", str(self._data), "--auth=trust", "--no-sync",
                "--username=chainage", "--encoding=UTF8", "--locale=C.UTF-8",
            ],
            user=owner, group=owner, cwd=folder, capture_output=True, text=True,
        )  # fmt: skip
        assert made.returncode == 0, made.stderr
        self.start()

    def _give(self, folder: Path) -> None:
        if self._owner is not None:
            shutil.chown(folder, self._owner, self._owner)

    def start(self) -> None:
        """Start it, also after a kill, and wait until it answers."""
        with (self.folder / "log").open("ab") as log:
            self._process = subprocess.Popen(
                [
                    str(self._postgres), "-D", str(self._data), "-k", str(self.folder),
                    "-c", "listen_addresses=", "-c", "max_connections=60",
                    "-c", "shared_buffers=16MB", *self._flags,
                ],
                user=self._owner, group=self._owner, cwd=self.folder, stdout=log, stderr=log,
            )  # fmt: skip
        deadline = time.monotonic() + 60
        while True:
            try:
                psycopg.connect(self.url("postgres")).close()
            except psycopg.OperationalError:
                assert time.monotonic() < deadline, (self.folder / "log").read_text()
                assert self._process.poll() is None, (self.folder / "log").read_text()
                time.sleep(0.02)
            else:
                return

    def kill(self) -> None:
        """Kill the server and every process of it, as the kernel does without memory."""
        children = Path(f"/proc/{self._process.pid}/task/{self._process.pid}/children").read_text()
        for pid in (self._process.pid, *map(int, children.split())):
            os.kill(pid, signal.SIGKILL)
        self._process.wait()
        for pid in map(int, children.split()):  # they are ours no longer, so nobody reports them
            while Path(f"/proc/{pid}").exists() and " Z " not in _state(pid):
                time.sleep(0.01)
        (self._data / "postmaster.pid").unlink(missing_ok=True)

    def end(self) -> None:
        """End it and remove its data."""
        self._process.send_signal(signal.SIGQUIT)
        self._process.wait()
        shutil.rmtree(self.folder)

    def url(self, name: str) -> str:
        """Return the address of a database."""
        return f"postgresql://chainage@/{name}?host={self.folder}"

    def new_database(self, *, folder: Path | None = None, options: str = "") -> str:
        """Make an empty database, in a folder if one is given; return its address."""
        name = f"test_{uuid.uuid4().hex}"
        create = f"CREATE DATABASE {name} TEMPLATE template0 STRATEGY file_copy {options}"
        with psycopg.connect(self.url("postgres"), autocommit=True) as connection:
            if folder is not None:
                self._give(folder)
                connection.execute(f"CREATE TABLESPACE {name} LOCATION '{folder}'")
                create += f" TABLESPACE {name}"
            connection.execute(create)
        return self.url(name)

    def drop(self, url: str) -> None:
        """Drop a database with the tablespace of its folder."""
        name = url.partition("@/")[2].partition("?")[0]
        with psycopg.connect(self.url("postgres"), autocommit=True) as connection:
            connection.execute(f"DROP DATABASE {name} WITH (FORCE)")
            connection.execute(f"DROP TABLESPACE {name}")


def _state(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return " Z "


@contextmanager
def postgres_server(*, is_safe: bool = False) -> Iterator[PostgresServer]:
    """Run a server until the block ends; a safe one syncs every commit."""
    programs = found_or_installed(_newest, "postgresql")
    if programs is None:
        pytest.fail(_NO_SERVER)
    owner = "postgres" if os.geteuid() == 0 else None  # it refuses to run as root
    folder = Path(tempfile.mkdtemp(prefix="pg-"))  # a short path, as that of a socket has to be
    server = PostgresServer(folder, programs, owner, is_safe=is_safe)
    try:
        yield server
    finally:
        server.end()


def _newest() -> Path | None:
    """Return the folder of the newest version's programs."""
    on_path = shutil.which("initdb")
    found = sorted(_PACKAGES.glob("*/bin/initdb"), key=lambda path: int(path.parts[-3]))
    return found[-1].parent if found else Path(on_path).parent if on_path else None
