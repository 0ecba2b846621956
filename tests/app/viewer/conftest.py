"""A scene behind its pump in a real server on loopback."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import uvicorn
from viewer_client import LIMIT_S, Served, make_rig

from app.viewer.scene import CulvertScene


@pytest.fixture
def socket_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("v") / "private" / "a.sock"


@pytest.fixture
def serve() -> Iterator[Callable[[CulvertScene], Served]]:
    running: list[tuple[uvicorn.Server, threading.Thread]] = []

    def start(scene: CulvertScene) -> Served:
        served = Served(scene)
        listener = socket.create_server(("127.0.0.1", 0))
        served.port = listener.getsockname()[1]
        config = uvicorn.Config(
            served.app(), log_level="warning", ws_per_message_deflate=False, lifespan="off"
        )
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        running.append((server, thread))
        return served

    yield start
    for server, thread in running:
        server.should_exit = True
        thread.join(LIMIT_S)


@pytest.fixture
def served(socket_path: Path, serve: Callable[[CulvertScene], Served]) -> Iterator[Served]:
    scene = CulvertScene(make_rig(), socket_path)
    yield serve(scene)
    scene.close()
