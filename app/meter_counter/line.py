"""Chainage as the meter counter of other software: the distance of the running live inspection.

One thread holds the connection. It reads the newest distance when it has time, so that tracking
never waits for it. Memory use does not depend on what the other side sends or fails to read.
"""

from __future__ import annotations

import logging
import select
import socket
import time
from dataclasses import dataclass
from itertools import count

from app.back_off import BackOff
from app.errors import AppError, InspectionNotFound
from app.inspections.corrections import Corrections
from app.logs import about
from app.meter_counter.protocol import (
    ChangeRequest,
    Listener,
    MessageId,
    changed,
    choose_version,
    refused,
    status,
)
from app.survey.distances.stated import Zero
from app.survey.rounding import metres, rounded
from app.tracking.live import Event, Update
from app.tracking.worker import Worker
from vo_core.errors import ChainageError
from vo_core.track import Estimate

logger = logging.getLogger(__name__)

NAME = "Meter counter"
"""Author of its entries in the history."""

_SEND_EVERY_S = 0.2
_CONNECT_S = 5.0
_SEND_S = 5.0
"""A peer that reads nothing for this long is disconnected."""
_BACK_OFF = BackOff(first_s=1.0, longest_s=30.0)
_READ_BYTES = 4096
_NOTED_AT_MOST = 50
_STOP_TIMEOUT_S = 8.0
_FARTHEST_M = 10_000.0
"""Largest offset of the zero."""


@dataclass(frozen=True)
class Peer:
    """Address of the other software."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


@dataclass(frozen=True)
class Connection:
    """State of the connection to the other software."""

    peer: str | None
    """Address of the peer; None where none is configured."""
    is_connected: bool
    detail: str | None
    """The sentence that says why there is no connection."""


class MeterCounter(Worker):
    """Reports the distance to other software and lets it set the distance."""

    def __init__(self, peer: Peer | None, corrections: Corrections) -> None:
        super().__init__("meter-counter", stop_timeout_s=_STOP_TIMEOUT_S)
        self._peer = peer
        self._corrections = corrections
        self._running: dict[str, Estimate | None] = {}
        """The running live inspections, the newest last, each with its last frame; `_changed`
        guards this and the next three fields."""
        self._failures = 0
        """Connections in a row that did not last."""
        self._is_connected = False
        self._detail: str | None = None
        self._socket: socket.socket | None = None

    def start(self) -> None:
        """Connect, and retry until stopped."""
        if self._peer is not None:
            super().start()

    def stop(self) -> None:
        """Disconnect."""
        with self._changed:
            self._stopping = True
            if self._socket is not None:
                _hang_up(self._socket)
        super().stop()

    def connection(self) -> Connection:
        """Return the current state of the connection."""
        with self._changed:
            peer = None if self._peer is None else str(self._peer)
            return Connection(peer, self._is_connected, self._detail)

    def on_event(self, event: Event) -> None:
        """Handle an event: which live inspections run, and their last frames."""
        if not isinstance(event, Update):
            return
        with self._changed:
            if event.state != "running":
                self._running.pop(event.inspection_id, None)
            elif event.camera is not None:
                before = self._running.get(event.inspection_id)
                last = event.estimates[-1] if event.estimates else before
                self._running[event.inspection_id] = last

    def _newest(self) -> tuple[str, Estimate] | None:
        """Return the live inspection that started last, if it has a frame."""
        with self._changed:
            for inspection_id, estimate in reversed(self._running.items()):
                return None if estimate is None else (inspection_id, estimate)
        return None

    def _step(self) -> float:
        """Hold one connection; return the pause before the next try."""
        began_s = time.monotonic()
        try:
            self._talk()
        except OSError as error:
            self._lost(_reason(error))
        except Exception:
            self._lost("The connection has failed; the server's log says why.")
            raise
        if time.monotonic() > began_s + _BACK_OFF.longest_s:  # the connection had lasted
            self._failures = 0
        self._failures += 1
        return _BACK_OFF.pause_s(self._failures - 1)

    def _talk(self) -> None:
        """Exchange messages while the connection holds."""
        assert self._peer is not None  # noqa: S101  (the thread runs only with one)
        with socket.create_connection((self._peer.host, self._peer.port), _CONNECT_S) as opened:
            opened.settimeout(_SEND_S)
            with self._changed:
                self._socket = opened
            try:
                if not self._stopping:
                    _Conversation(self, opened).hold()
            finally:
                with self._changed:
                    self._socket = None

    def found(self) -> None:
        """Record that the other side has accepted the connection."""
        with self._changed:
            self._is_connected, self._detail = True, None
        logger.info("The meter counter is connected to %s.", self._peer)

    def _lost(self, detail: str) -> None:
        with self._changed:
            is_news = self._is_connected or self._detail != detail
            self._is_connected, self._detail = False, detail
        if is_news and not self._stopping:
            logger.warning("The meter counter is not connected to %s: %s", self._peer, detail)

    def distance_m(self) -> float | None:
        """Return the corrected distance of the running live inspection, to the centimetre, or
        None.
        """
        newest = self._newest()
        if newest is None:
            return None
        try:
            estimate = self._corrections.estimate(*newest)
        except InspectionNotFound:  # deleted at this moment
            return None
        return rounded(metres(estimate.distance_mm), 2)

    def set_distance(self, value_m: float | None) -> str | None:
        """Set the distance of the current camera position; return a sentence if that is refused."""
        if value_m is None or abs(value_m) > _FARTHEST_M:
            return "The value is not a length in m or ft within 10 km."
        newest = self._newest()
        if newest is None:
            return "No live inspection runs."
        inspection_id, estimate = newest
        try:
            with about(inspection_id):
                zero = Zero(frame=estimate.frame, offset_m=rounded(value_m, 3))
                self._corrections.change(
                    inspection_id,
                    lambda stated: stated.model_copy(update={"zero": zero}),
                    None,
                    NAME,
                )
        except (AppError, ChainageError) as refusal:
            return str(refusal)
        return None


class _Conversation:
    """One connection, from its first message."""

    def __init__(self, counter: MeterCounter, connected: socket.socket) -> None:
        self._counter = counter
        self._socket = connected
        self._ids = count(1)
        self._listener = Listener()
        self._sent_m: float | None = None
        self._send_from_s = 0.0
        self._change_from_s = 0.0
        self._noted: set[str] = set()

    def hold(self) -> None:
        """Exchange messages until the other side ends the connection.

        Raises:
            OSError: The connection ended, or the other side stopped reading.
        """
        self._socket.sendall(choose_version(next(self._ids)))
        self._counter.found()
        while True:
            self._send_distance()
            readable, _, _ = select.select([self._socket], [], [], _SEND_EVERY_S)
            if not readable:
                continue
            received = self._socket.recv(_READ_BYTES)
            if not received:
                raise ConnectionResetError
            for message in self._listener.hear(received):
                if isinstance(message, ChangeRequest):
                    self._answer(message.message_id, self._change(message.value_m))
                else:
                    self._note(message.name)

    def _send_distance(self) -> None:
        """Send the distance if it changed, at most as often as the protocol asks."""
        now = time.monotonic()
        if now < self._send_from_s:
            return
        distance_m = self._counter.distance_m()
        if distance_m is not None and distance_m != self._sent_m:
            self._socket.sendall(status(next(self._ids), distance_m))
            self._sent_m, self._send_from_s = distance_m, now + _SEND_EVERY_S

    def _change(self, value_m: float | None) -> str | None:
        """Set the distance; endless requests of a peer do not fill the history."""
        now = time.monotonic()
        if now < self._change_from_s:
            return "Too many changes at once; try again in a moment."
        self._change_from_s = now + _SEND_EVERY_S
        return self._counter.set_distance(value_m)

    def _note(self, name: str) -> None:
        """Log an unknown message once for each name, and for a limited number of names."""
        if name not in self._noted and len(self._noted) < _NOTED_AT_MOST:
            self._noted.add(name)
            logger.info("The meter counter does not answer %r.", name)

    def _answer(self, message_id: MessageId, reason: str | None) -> None:
        answer = changed(message_id) if reason is None else refused(message_id, reason)
        self._socket.sendall(answer)


def _hang_up(connected: socket.socket) -> None:
    try:
        connected.shutdown(socket.SHUT_RDWR)
    except OSError:
        logger.debug("The connection was closed already.")


def _reason(error: OSError) -> str:
    if isinstance(error, TimeoutError):
        return "It does not answer."
    if isinstance(error, socket.gaierror):
        return "Its name is not known."
    if isinstance(error, ConnectionRefusedError):
        return "No program listens there."
    if isinstance(error, ConnectionError):
        return "It has ended the connection."
    return f"It cannot be reached: {error.strerror or 'the network has failed'}."
