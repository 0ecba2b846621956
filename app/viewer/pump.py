"""Connects a logged-in browser with the viser server of its scene.

viser knows no users, so rights are enforced here: everything passes to the browser, only an
allow-list to viser. The router checks session and Origin before it calls `pump`.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Literal, Protocol

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, unix_connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.typing import Subprotocol

from app.viewer.geometry import PinHit, WallHit

logger = logging.getLogger(__name__)

OnClick = Callable[[WallHit | PinHit], Awaitable[None]]

_MAY_CLICK = frozenset({"operator", "admin"})
_CLOSE_BAD_MESSAGE = 1011
_CLOSE_TRY_AGAIN = 1013

_Vector = tuple[float, float, float]


class Scene(Protocol):
    """The part of a `CulvertScene` that the pump needs."""

    @property
    def socket_path(self) -> Path:
        """Socket on which its viser server listens."""

    def pick(self, origin: _Vector, direction: _Vector) -> WallHit | PinHit | None:
        """Return what a ray in scene coordinates meets."""


class _Camera(
    msgspec.Struct, tag_field="type", tag="ViewerCameraMessage", forbid_unknown_fields=True
):
    """Pose of a browser's camera; viser computes with it, so it is checked."""

    wxyz: tuple[float, float, float, float]
    position: _Vector
    fov: float
    near: float
    far: float
    image_height: int
    image_width: int
    look_at: _Vector
    up_direction: _Vector

    def is_sound(self) -> bool:
        numbers = [*self.wxyz, *self.position, *self.look_at, *self.up_direction]
        return (
            all(map(math.isfinite, [*numbers, self.fov, self.near, self.far]))
            and 0 < self.image_height < 100_000
            and 0 < self.image_width < 100_000
            and math.dist(self.position, self.look_at) > 0
            and math.hypot(*self.up_direction) > 0
            and math.hypot(*self.wxyz) > 0
        )


class _Click(msgspec.Struct, tag_field="type", tag="ScenePointerMessage"):
    event_type: Literal["click", "rect-select"]
    ray_origin: _Vector | None
    ray_direction: _Vector | None

    def is_sound(self) -> bool:
        return all(map(math.isfinite, [*(self.ray_origin or ()), *(self.ray_direction or ())]))


class _Type(msgspec.Struct):
    type: str


_ALLOWED: dict[str, type[_Camera | _Click]] = {
    "ViewerCameraMessage": _Camera,
    "ScenePointerMessage": _Click,
}


async def pump(ws: WebSocket, scene: Scene, role: str, on_click: OnClick | None = None) -> None:
    """Serve one browser until it leaves or the scene is closed.

    Args:
        ws: The web socket, not yet accepted; session and Origin have been checked.
        scene: The scene whose viser server is used.
        role: `viewer` may look; `operator` and `admin` may also shift-click.
        on_click: Awaited for each shift-click with the pin, or else the wall point.

    Closes with 1013 when the scene has just been stopped, with 1011 after a malformed message.
    """
    offered = [Subprotocol(name) for name in ws.scope["subprotocols"]]
    try:
        upstream = await unix_connect(
            str(scene.socket_path),
            "ws://localhost/",
            subprotocols=offered or None,
            compression=None,
            max_size=None,  # the replay for a late joiner is one frame of any size
            max_queue=2,
            ping_interval=None,
        )
    except (OSError, InvalidHandshake):
        await ws.accept(subprotocol=offered[0] if offered else None)
        await ws.close(_CLOSE_TRY_AGAIN, "The 3D view is being restarted.")
        return
    try:
        await ws.accept(subprotocol=upstream.subprotocol)
        code = await _first_of(
            _to_viser(ws, upstream, scene, role, on_click), _to_browser(ws, upstream)
        )
    finally:
        await upstream.close()
    if code is not None:
        await ws.close(code)


async def _first_of(*ways: Awaitable[int | None]) -> int | None:
    tasks = [asyncio.ensure_future(way) for way in ways]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        return done.pop().result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _to_browser(ws: WebSocket, upstream: ClientConnection) -> int | None:
    """Forward everything that viser sends; return the browser's close code, None when it has
    gone.
    """
    try:
        async for frame in upstream:
            await ws.send_bytes(frame)  # type: ignore[arg-type]  # viser sends binary frames only
    except ConnectionClosed:
        return _CLOSE_TRY_AGAIN
    except WebSocketDisconnect:
        return None
    return _CLOSE_TRY_AGAIN


async def _to_viser(
    ws: WebSocket, upstream: ClientConnection, scene: Scene, role: str, on_click: OnClick | None
) -> int | None:
    """Forward what the role may send; return the browser's close code, None when it has gone."""
    while (event := await ws.receive())["type"] != "websocket.disconnect":
        raw = event.get("bytes") or b""
        try:
            kind = _ALLOWED.get(msgspec.msgpack.decode(raw, type=_Type).type)
            message = None if kind is None else msgspec.msgpack.decode(raw, type=kind)
        except (msgspec.DecodeError, UnicodeDecodeError):
            return _CLOSE_BAD_MESSAGE
        if message is None:  # everything else in viser's protocol has unwanted side effects
            continue
        if not message.is_sound():
            return _CLOSE_BAD_MESSAGE
        if isinstance(message, _Camera):
            try:
                await upstream.send(raw)
            except ConnectionClosed:
                return _CLOSE_TRY_AGAIN
        elif on_click is not None and role in _MAY_CLICK:
            await _forward_click(message, scene, on_click)
    return None


async def _forward_click(click: _Click, scene: Scene, on_click: OnClick) -> None:
    if click.event_type != "click" or click.ray_origin is None or click.ray_direction is None:
        return
    hit = scene.pick(click.ray_origin, click.ray_direction)
    if hit is not None:
        await on_click(hit)
