"""A viser server that listens on a unix socket only and starts within a time limit.

viser 1.1.1 supports TCP only, listens on all interfaces by default, opens a public tunnel for any
client that asks, never returns when it cannot bind, prints a banner with addresses that do not
exist here, and sets asyncio's events from foreign threads. Each is fixed below. This relies on
internals, so the version is pinned exactly.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import warnings
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rich
import viser
import websockets.asyncio.server as websockets_server
from viser.infra._async_message_buffer import AsyncMessageBuffer

logger = logging.getLogger(__name__)

START_LIMIT_S = 10.0
"""A start takes 2 to 40 ms; viser waits forever when it cannot bind."""

_SOCKET_PATH_LIMIT = 107
"""Bytes of a unix socket's path on Linux, without the closing zero."""

_UNIX = "unix:"


class ViewerUnavailable(Exception):
    """The 3D view cannot be started; the text is a sentence for people."""


def start_private_server(socket_path: Path) -> viser.ViserServer:
    """Start viser on `socket_path`, in a directory that only this user can enter.

    Blocks for 2 to 40 ms; call in a worker thread.

    Raises:
        ViewerUnavailable: The socket cannot be made, or viser did not start in time.
    """
    _prepare(socket_path)
    started: Future[viser.ViserServer] = Future()
    threading.Thread(
        target=_start, args=(socket_path, started), name="viser-start", daemon=True
    ).start()
    try:
        server = started.result(START_LIMIT_S)
    except TimeoutError as error:
        started.cancel()
        raise ViewerUnavailable(f"The 3D view did not start within {START_LIMIT_S:g} s.") from error
    server.request_share_url = _refuse_share_url  # type: ignore[method-assign]
    server.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
    return server


def _start(socket_path: Path, started: Future[viser.ViserServer]) -> None:
    with _silent_console(), _unix_sockets():
        server = viser.ViserServer(host=f"{_UNIX}{socket_path}", port=0, verbose=False)
    if started.set_running_or_notify_cancel():
        started.set_result(server)
    else:  # nobody is waiting any more
        stop_private_server(server, socket_path)


def stop_private_server(server: viser.ViserServer, socket_path: Path) -> None:
    """Stop the server and remove its socket.  Blocks for some ms; call in a worker thread."""
    with _silent_console():
        server.stop()
    socket_path.unlink(missing_ok=True)


def _prepare(socket_path: Path) -> None:
    if len(str(socket_path).encode()) > _SOCKET_PATH_LIMIT:
        raise ViewerUnavailable(
            f"The 3D view cannot start: the path of its socket is longer than "
            f"{_SOCKET_PATH_LIMIT} bytes ({socket_path})."
        )
    try:
        socket_path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        socket_path.parent.chmod(0o700)  # viser's socket itself is accessible to everyone (0755)
        socket_path.unlink(missing_ok=True)  # left behind by a crash
    except OSError as error:
        raise ViewerUnavailable(f"The 3D view cannot make its socket: {error}.") from error


def _refuse_share_url(*_: object, **__: object) -> None:
    """Replace viser's public tunnel, which any client may request."""
    logger.warning("A client asked for a public share address of the 3D view; refused.")


_serve = websockets_server.serve


def _serve_on_socket(handler: Any, host: Any = None, port: Any = None, **options: Any) -> Any:
    """Wrap `websockets.serve` to accept a host of the form `unix:PATH`."""
    if isinstance(host, str) and host.startswith(_UNIX):
        return _serve(handler, unix=True, path=host.removeprefix(_UNIX), **options)
    return _serve(handler, host, port, **options)


_sockets_lock = threading.Lock()
_sockets_users = 0


@contextmanager
def _unix_sockets() -> Iterator[None]:
    """Let viser serve on a unix socket, for which it has no option.

    viser looks up `websockets.serve` at every start; nobody else uses a host of this form
    meanwhile.
    """
    global _sockets_users
    with _sockets_lock:
        _sockets_users += 1
        websockets_server.serve = _serve_on_socket  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        with _sockets_lock:
            _sockets_users -= 1
            if not _sockets_users:
                websockets_server.serve = _serve  # type: ignore[misc]


# A browser may leave between the check of its presence and the message to it.
warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")


class LoopEvent(asyncio.Event):
    """An event whose `set` may be called from any thread, while only its loop wakes waiters.

    viser's buffers call `set` where a message is written, and again in the loop. With asyncio's own
    event, the first call iterates over the waiters while the loop changes them: once in some
    100,000 updates the writer fails with "deque mutated during iteration".
    """

    def set(self) -> None:
        """Set the event; in a foreign thread only `is_set` changes."""
        self._value = True
        if asyncio._get_running_loop() is not None:
            waiters: list[asyncio.Future[bool]] = list(self._waiters)
            for waiter in waiters:
                if not waiter.done():
                    waiter.set_result(True)


_init_buffer = AsyncMessageBuffer.__init__


def _init_buffer_with_loop_event(self: AsyncMessageBuffer, *parts: Any, **named: Any) -> None:
    _init_buffer(self, *parts, **named)
    self.message_event = LoopEvent()


AsyncMessageBuffer.__init__ = _init_buffer_with_loop_event  # type: ignore[method-assign]


_console_lock = threading.Lock()
_console_users = 0


@contextmanager
def _silent_console() -> Iterator[None]:
    """Keep viser's banner (`rich.print`, verbose or not) off the terminal."""
    global _console_users
    with _console_lock:
        _console_users += 1
        rich.get_console().quiet = True
    try:
        yield
    finally:
        with _console_lock:
            _console_users -= 1
            rich.get_console().quiet = _console_users > 0
