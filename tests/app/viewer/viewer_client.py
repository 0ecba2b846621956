"""Builders of the viewer tests: a scene behind its pump, and a client that is no browser."""

from __future__ import annotations

import queue
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import msgspec
import textures
import uvicorn
import zstandard
from builders import PATIENCE_S
from fastapi import FastAPI, Response, WebSocket
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect, unix_connect

from app.viewer import page
from app.viewer.geometry import PinHit, WallHit
from app.viewer.pump import pump
from app.viewer.scene import CulvertScene
from vo_core import Estimate, Rig

LIMIT_S = 10.0

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (-1.0, 0.0, 0.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 600,
    "image_width": 800,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, -1.0),
}


def make_rig(
    *, view: str = "down", shape: str = "circular", segment_length_mm: float | None = 1500.0
) -> Rig:
    pipe: dict[str, Any] = {"shape": shape, "segment_length_mm": segment_length_mm}
    if shape == "flat":
        pipe["diameter_mm"] = None
    return textures.make_rig(mount={"view": view}, pipe=pipe)


def make_estimate(distance_mm: float, *, status: Any = "ok") -> Estimate:
    return Estimate(
        frame=0,
        time_s=0.0,
        x_mm=distance_mm,
        y_mm=0.0,
        yaw_deg=0.0,
        distance_mm=distance_mm,
        sigma_distance_mm=5.0,
        quality=0.9,
        status=status,
        sigma_registration_mm=5.0,
    )


class Served:
    """A scene with its page and pump on a loopback port."""

    def __init__(self, scene: CulvertScene) -> None:
        self.scene = scene
        self.role = "operator"
        self.clicks: queue.Queue[WallHit | PinHit] = queue.Queue()
        self.port = 0

    @property
    def page_url(self) -> str:
        return f"http://127.0.0.1:{self.port}/viewer/x/"

    def app(self) -> FastAPI:
        app = FastAPI()

        @app.get("/viewer/x/")
        def viewer_page() -> Response:
            return Response(page.PAGE, headers=page.HEADERS)

        @app.websocket("/viewer/x")
        async def viewer_socket(ws: WebSocket) -> None:
            async def on_click(hit: WallHit | PinHit) -> None:
                self.clicks.put(hit)

            await pump(ws, self.scene, self.role, on_click)

        return app

    @contextmanager
    def client(self) -> Iterator[Client]:
        with connect(
            f"ws://127.0.0.1:{self.port}/viewer/x",
            subprotocols=["viser-v1.1.1"],  # type: ignore[list-item]
            max_size=None,
            open_timeout=PATIENCE_S,
            compression=None,
        ) as ws:
            yield Client(ws)


@contextmanager
def serving(scene: CulvertScene) -> Iterator[Served]:
    """The scene behind its pump in a real server on loopback, until the block ends."""
    served = Served(scene)
    listener = socket.create_server(("127.0.0.1", 0))
    served.port = listener.getsockname()[1]
    config = uvicorn.Config(
        served.app(), log_level="warning", ws_per_message_deflate=False, lifespan="off"
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        yield served
    finally:
        server.should_exit = True
        thread.join(LIMIT_S)


class Client:
    """A viser client like a browser's, as far as its messages show."""

    def __init__(self, ws: ClientConnection) -> None:
        self.ws = ws
        self.waiting: list[dict[str, Any]] = []

    def send(self, **message: Any) -> None:
        self.ws.send(msgspec.msgpack.encode(message))

    def send_camera(self, **changes: Any) -> None:
        self.send(**{**CAMERA, **changes})

    def click(self, origin: Any, direction: Any) -> None:
        self.send(
            type="ScenePointerMessage",
            event_type="click",
            ray_origin=origin,
            ray_direction=direction,
            screen_pos=((0.5, 0.5),),
            modifier="shift",
        )

    def until(self, found: Callable[[dict[str, Any]], bool]) -> list[dict[str, Any]]:
        """Return all messages up to the first that `found` accepts."""
        seen = []
        while True:
            if not self.waiting:
                self.waiting = decode(self.ws.recv(timeout=LIMIT_S))
            message = self.waiting.pop(0)
            seen.append(message)
            if found(message):
                return seen

    def until_all(
        self, wanted: Callable[[dict[str, Any]], bool], count: int
    ) -> list[dict[str, Any]]:
        """Return the next `count` messages that `wanted` accepts."""
        return [self.until(wanted)[-1] for _ in range(count)]

    def replay(self) -> list[dict[str, Any]]:
        """Return the whole scene, as a late joiner receives it."""
        return self.until(lambda m: m["type"] == "ReplayDoneMessage")

    def until_robot_says(self, text: str) -> list[dict[str, Any]]:
        """Return all messages up to the pose with this label: the barrier of most tests."""
        return self.until(
            lambda m: (
                m.get("name") == "/robot_label"
                and str(m.get("updates", {}).get("text", "")).startswith(text)
            )
        )

    def close_code(self) -> int | None:
        """Read until the server closes; return the code."""
        with suppress(ConnectionClosed):
            while True:
                self.ws.recv(timeout=LIMIT_S)
        return self.ws.close_code


def decode(frame: Any) -> list[dict[str, Any]]:
    """Return the messages of one frame; arrays stay references into its binary part."""
    size = int.from_bytes(frame[8:16], "little")
    packed = zstandard.ZstdDecompressor().decompress(frame[16 : 16 + size])
    return list(msgspec.msgpack.decode(packed)["messages"])


@contextmanager
def late_joiner(scene: CulvertScene) -> Iterator[Client]:
    """Connect a client now, past any pump."""
    with unix_connect(
        str(scene.socket_path),
        "ws://localhost/",
        subprotocols=["viser-v1.1.1"],  # type: ignore[list-item]
        max_size=None,
        open_timeout=PATIENCE_S,
        compression=None,
    ) as ws:
        yield Client(ws)


def messages_kept(scene: CulvertScene) -> int:
    """Return the number of messages that a late joiner receives, which determines the memory of a
    scene.

    Messages that are being replaced at this moment are not counted.
    """
    with late_joiner(scene) as client:
        return len(client.replay())


def is_sent(message: dict[str, Any]) -> bool:
    """Return whether a command moves this browser's camera."""
    return message["type"] == "SetCameraPositionMessage" and not message["initial"]
