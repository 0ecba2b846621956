"""The live socket: pose and picture of the same frame in one message, newest wins."""

from __future__ import annotations

import asyncio
import json
import time
from contextlib import AsyncExitStack
from typing import Annotated, Literal

import msgspec
from fastapi import APIRouter, Query, WebSocket, WebSocketDisconnect

from app import errors
from app.access.access import Principal
from app.inspections.corrections import Corrections
from app.inspections.inspections import Inspections
from app.inspections.presence import Presence, Seat
from app.reports.content.words import LANGUAGE
from app.survey.distances.notices import Notice
from app.tracking.live import (
    DistancesCorrected,
    Event,
    FindingsChanged,
    Live,
    ObservationsChanged,
    Update,
)
from app.viewer.clicks import Click, Clicks
from app.viewer.geometry import Cut
from app.viewer.scenes import PageView, Scenes
from app.viewer.wording import Units, Wording
from app.web.answers import body_of
from app.web.changes import EVERY_S, Changes
from app.web.deps import PAGE_ID, InspectionId, Service, page_of, viewer
from app.web.schemas.inspection.live import click_message, live_header, people_message
from vo_core.track import Estimate

router = APIRouter()

MAX_IN_FLIGHT = 2
CLOSE_NOT_FOUND = 4404
CLOSE_BAD_MESSAGE = 1011


class _Ack(msgspec.Struct, tag="ack", tag_field="type"):
    seq: int


class _Ping(msgspec.Struct, tag="ping", tag_field="type"):
    t: float


class _Show(msgspec.Struct, tag="show", tag_field="type"):
    frame: Annotated[int, msgspec.Meta(ge=0, le=2**31)] | None
    """None: the robot follows the tracking again."""


class _Camera(msgspec.Struct, tag="camera", tag_field="type"):
    mode: Literal["follow", "overview", "inside"]


class _Select(msgspec.Struct, tag="select", tag_field="type"):
    observation: Annotated[str, msgspec.Meta(max_length=36)] | None
    """The pin to highlight; None: none."""


class _Words(msgspec.Struct, tag="words", tag_field="type"):
    """Language and unit of the labels of the 3D view."""

    language: Annotated[str, msgspec.Meta(pattern=LANGUAGE)]
    units: Units
    late: bool = False
    """Whether to omit the robot's distance, as the page draws seldom."""


class _Cut(msgspec.Struct, tag="cut", tag_field="type"):
    half: Cut


class _Here(msgspec.Struct, tag="here", tag_field="type"):
    """A person works on this page, and edits this observation; other pages show it."""

    editing: Annotated[str, msgspec.Meta(max_length=36)] | None


class _Measure(msgspec.Struct, tag="measure", tag_field="type"):
    """Whether clicks in the 3D view measure instead of tagging."""

    on: bool


_Share = Annotated[float, msgspec.Meta(ge=0, le=1)]


class _Point(msgspec.Struct, tag="point", tag_field="type"):
    """Where the pointer is in the 3D view; None: elsewhere."""

    at: tuple[_Share, _Share] | None


_Command = _Ack | _Ping | _Show | _Camera | _Select | _Words | _Cut | _Here | _Measure | _Point
_commands: msgspec.json.Decoder[_Command] = msgspec.json.Decoder(_Command)


class _Outbox:
    """The newest update that the browser has not seen, and the number of unacknowledged ones."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._may_send = asyncio.Event()
        self._newest: Update | None = None
        self._in_flight: list[int] = []

    def listen(self, event: Event) -> None:
        """Receive an event; called from any thread."""
        if isinstance(event, Update):
            self._loop.call_soon_threadsafe(self.put, event)

    def put(self, update: Update) -> None:
        """Store an update: the newest wins, but the end of an inspection is not lost."""
        if self._newest is None or update.seq > self._newest.seq:
            self._newest = update
        self._wake()

    def acknowledge(self, seq: int) -> None:
        self._in_flight = [sent for sent in self._in_flight if sent > seq]
        self._wake()

    async def next(self) -> Update:
        """Wait for the next update to send."""
        while True:
            await self._may_send.wait()
            update, self._newest = self._newest, None
            self._wake()
            if update is not None:
                self._in_flight.append(update.seq)
                self._wake()
                return update

    def _wake(self) -> None:
        if self._newest is not None and len(self._in_flight) < MAX_IN_FLIGHT:
            self._may_send.set()
        else:
            self._may_send.clear()


@router.websocket("/api/inspections/{inspection_id}/live")
@viewer
async def live(
    socket: WebSocket,
    inspection_id: InspectionId,
    inspections: Service[Inspections],
    live: Service[Live],
    presence: Service[Presence],
    clicks: Service[Clicks],
    corrections: Service[Corrections],
    scenes: Service[Scenes],
    page: Annotated[str | None, Query(pattern=PAGE_ID)] = None,
) -> None:
    """Send updates of an inspection; receive acknowledgements and commands.

    `page` pairs the socket with the 3D view `/viewer/{inspection_id}/?page=`, which its commands
    control. A socket with a page also gets notes of what others change and who they are; a program
    that reads updates gets nothing else.
    """
    await socket.accept()
    try:
        current = await asyncio.to_thread(_current, inspections, live, inspection_id)
    except errors.InspectionNotFound as error:
        await _refuse(socket, error, CLOSE_NOT_FOUND)
        return
    outbox = _Outbox()
    changes, findings = Changes(ObservationsChanged, DistancesCorrected), Changes(FindingsChanged)
    principal: Principal = socket.state.principal
    async with AsyncExitStack() as stack:
        stack.enter_context(live.listening(inspection_id, outbox.listen))
        stack.enter_context(live.listening(inspection_id, changes.listen))
        stack.enter_context(live.listening(inspection_id, findings.listen))
        seat = stack.enter_context(presence.seat(inspection_id, principal))
        of_page = page_of(socket)
        own_clicks = stack.enter_context(clicks.listening(inspection_id, of_page))
        outbox.put(current)
        view = await stack.enter_async_context(scenes.page(inspection_id, of_page))
        tasks = {
            asyncio.create_task(_send(socket, outbox, corrections)),
            asyncio.create_task(_send_clicks(socket, own_clicks)),
            asyncio.create_task(_receive(socket, outbox, view, seat)),
        }
        if page is not None:
            tasks.add(asyncio.create_task(_send_changes(socket, changes, "changed")))
            tasks.add(asyncio.create_task(_send_changes(socket, findings, "findings")))
            tasks.add(asyncio.create_task(_send_people(socket, seat)))
        stack.push_async_callback(_end, tasks)
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            fault = task.exception()
            if isinstance(fault, msgspec.MsgspecError):
                await _refuse(socket, fault, CLOSE_BAD_MESSAGE)
            elif fault is not None and not isinstance(fault, WebSocketDisconnect):
                raise fault


async def _send(socket: WebSocket, outbox: _Outbox, corrections: Corrections) -> None:
    while True:
        update = await outbox.next()
        now = await asyncio.to_thread(_corrected, corrections, update)
        fields = live_header(update, *now, time.monotonic())
        header = json.dumps(fields, allow_nan=False).encode()
        await socket.send_bytes(len(header).to_bytes(4, "big") + header + update.jpeg)


def _corrected(
    corrections: Corrections, update: Update
) -> tuple[Estimate | None, int | None, int | None, list[Notice]]:
    """Return the corrected last estimate, revision, number of known joints, and notices."""
    try:
        revision = corrections.revision(update.inspection_id)
        solved = corrections.newest(update.inspection_id)
        joints = len(solved.joints) + len(solved.expected_joints)
        last = update.estimates[-1] if update.estimates else None
        corrected = None if last is None else corrections.estimate(update.inspection_id, last)
        notices = corrections.notices(update.inspection_id)
    except (
        errors.InspectionNotFound,
        errors.DamagedTrack,
    ):  # the update, or what the page asks for, says so
        return None, None, None, []
    return corrected, revision, joints, notices


async def _send_clicks(socket: WebSocket, clicks: asyncio.Queue[Click]) -> None:
    while True:
        await socket.send_json(click_message(await clicks.get()))


async def _send_changes(socket: WebSocket, changes: Changes, kind: str) -> None:
    while True:
        await changes.next()
        await socket.send_json({"type": kind})
        await asyncio.sleep(EVERY_S)


async def _send_people(socket: WebSocket, seat: Seat) -> None:
    while True:
        await socket.send_json(people_message(await seat.news()))
        await asyncio.sleep(EVERY_S)


async def _receive(socket: WebSocket, outbox: _Outbox, view: PageView, seat: Seat) -> None:
    while True:
        match await _next_command(socket):
            case _Ack(seq):
                outbox.acknowledge(seq)
            case _Ping(t):
                await socket.send_json({"type": "pong", "t": t})
            case _Show(frame):
                view.change(frame=frame)
            case _Camera(mode):
                view.change(mode=mode)
            case _Select(observation):
                view.change(selected=observation)
            case _Cut(half):
                view.change(cut=half)
            case _Measure(on):
                view.change(is_measuring=on)
            case _Here(editing):
                seat.state(editing)
            case _Point(at):
                view.point_at(at)
            case _Words(language, units, late):
                view.change(wording=Wording(language, units, is_late=late))


async def _next_command(socket: WebSocket) -> _Command:
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message["code"])
    return _commands.decode(message.get("text") or message.get("bytes") or b"")


def _current(inspections: Inspections, live: Live, inspection_id: str) -> Update:
    """Return the first update for a browser that has just connected."""
    newest = live.newest(inspection_id)
    if newest is not None:
        return newest
    view = inspections.get(inspection_id)
    try:
        last = inspections.last_estimate(inspection_id)
    except errors.DamagedTrack:
        last = None
    return Update(inspection_id, view.row.status, view.progress, (last,) if last else ())


async def _end(tasks: set[asyncio.Task[None]]) -> None:
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


async def _refuse(socket: WebSocket, error: Exception, code: int) -> None:
    if isinstance(error, msgspec.MsgspecError):
        body = {"code": "invalid_message", "detail": f"The message is not understood: {error}."}
    else:
        _, body = body_of(error)
    await socket.send_json(body)
    await socket.close(code)
