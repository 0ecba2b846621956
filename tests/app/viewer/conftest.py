"""A scene behind its pump in a real server on loopback."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from viewer_client import Served, make_rig, serving

from app.viewer.scene import CulvertScene


@pytest.fixture(scope="session", autouse=True)
def _leave_out_what_there_was() -> None:
    """A scene that is closed collects garbage, and would go through all that the tests import."""
    gc.freeze()


@pytest.fixture
def socket_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("v") / "private" / "a.sock"


@pytest.fixture
def serve() -> Iterator[Callable[[CulvertScene], Served]]:
    with ExitStack() as stack:
        yield lambda scene: stack.enter_context(serving(scene))


@pytest.fixture
def served(socket_path: Path, serve: Callable[[CulvertScene], Served]) -> Iterator[Served]:
    scene = CulvertScene(make_rig(), socket_path)
    yield serve(scene)
    scene.close()
