"""Determines the kind of a test: `unit`, `render`, `server` or `browser`, by what it works with.

The most expensive import of the test's file, or the most expensive fixture, decides.  A unit test
runs no other process, no server and no browser and renders no frames; a process or a socket in one
fails it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

BROWSER = {"browser", "page", "window"}
"""Fixtures that use Chromium."""

SERVER = {
    "server", "shared", "survey", "done", "chainage", "served", "serve", "postgres",
    "database_kind", "object_store", "subprocess", "socket", "asyncio", "serving", "LiveServer",
    "Client", "Process", "process", "Child", "ReadyTracker", "Storm", "FileReader", "listening",
    "create_app", "MjpegCamera", "collection",
}  # fmt: skip
"""Fixtures, and names in a test file, that are a server or another process."""

RENDER = {
    "render", "simulate", "film", "follow", "texture", "pair", "Odometry", "time_track",
    "run_trials", "World", "Studio", "WallCaster", "make_clip", "CounterFilm",
}  # fmt: skip
"""Names in a test file that render a wall, or track it."""


_STARTS = {"subprocess.Popen", "os.posix_spawn", "os.fork", "os.exec", "socket.bind"}
"""Audit events that no unit test may cause."""

_LISTS_FONTS = "fc-list"
"""Matplotlib runs it, the first time that it draws on a machine."""


def kind_of(item: pytest.Item) -> str:
    """Return the kind of a test."""
    fixtures = set(getattr(item, "fixturenames", ()))
    names = fixtures | vars(getattr(item, "module", item)).keys()
    if fixtures & BROWSER:
        return "browser"
    if names & SERVER:
        return "server"
    return "render" if names & RENDER else "unit"


class _Guard:
    """An audit hook, which stays installed, and whether it is active."""

    def __init__(self) -> None:
        self.test: str | None = None
        self._is_set = False

    def set_up(self) -> None:
        if not self._is_set:
            sys.addaudithook(self._refuse)
            self._is_set = True

    def _refuse(self, event: str, arguments: tuple[Any, ...]) -> None:
        if self.test is not None and event in _STARTS and _LISTS_FONTS not in arguments[:1]:
            raise AssertionError(f"{self.test} is a unit test, and causes {event}.")


_guard = _Guard()


@contextmanager
def nothing_is_started(test: str) -> Iterator[None]:
    """Activate the hook while a unit test runs."""
    _guard.set_up()
    _guard.test = test
    try:
        yield
    finally:
        _guard.test = None
