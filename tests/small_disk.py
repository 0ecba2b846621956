"""A disk of a few MiB that tests can fill."""

from __future__ import annotations

import contextlib
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

_PAGE = 4096


class SmallDisk:
    """A file system in memory; `fill` leaves so many free bytes, none if it is not asked to."""

    def __init__(self, place: Path) -> None:
        self.place = place
        self._filler = place / "filler"

    def fill(self, *, leaving: int = 0) -> None:
        with self._filler.open("ab", buffering=0) as filler, contextlib.suppress(OSError):
            while filler.write(bytes(_PAGE)):
                pass
        if leaving:
            os.truncate(self._filler, self._filler.stat().st_size - leaving)

    def make_room(self) -> None:
        self._filler.unlink()


@contextlib.contextmanager
def small_disk(place: Path, megabytes: int = 24) -> Iterator[SmallDisk]:
    """Mount the disk at `place` until the block ends."""
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", str(place)]
    made = subprocess.run(mount, capture_output=True, text=True)
    if made.returncode:
        pytest.fail(f"A full disk needs a small one, so the tests run as root: {made.stderr}")
    try:
        yield SmallDisk(place)
    finally:
        subprocess.run(["umount", "--lazy", str(place)], check=True)
