"""Clips that are made once, and a server that several tests of a file share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from builders import Client, make_clip, serving

LONG_FRAMES = 1500


@pytest.fixture(scope="session")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second and a half of driving forward."""
    return make_clip(tmp_path_factory.mktemp("clips") / "short.mp4", 40)


@pytest.fixture(scope="session")
def long_clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Long enough to be interrupted while it is tracked."""
    return make_clip(tmp_path_factory.mktemp("clips") / "long.mp4", LONG_FRAMES)


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """One server for the tests of a file that do not disturb each other."""
    with serving(tmp_path_factory.mktemp("data")) as client:
        yield client


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Client]:
    """A server of a test's own."""
    with serving(tmp_path / "data") as client:
        yield client


@pytest.fixture(scope="module")
def done(shared: Client, clip: Path) -> str:
    """Id of a tracked inspection on the shared server; tests add to it but do not change it."""
    return shared.tracked(clip)
