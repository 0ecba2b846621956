"""Builds the server: `create_app(settings)`; `serve` runs it."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from errno import EADDRINUSE
from importlib.metadata import version
from ipaddress import ip_address

import uvicorn
from fastapi import FastAPI

from app import errors
from app.errors import AddressNotAvailable
from app.middleware import Envelope, Guard
from app.routers import (
    access,
    catalogue,
    health,
    inspections,
    live,
    media,
    observations,
    pages,
    uploads,
    viewer,
)
from app.services.container import Services, running
from app.settings import Settings
from app.storage.files import DataFolder

logger = logging.getLogger(__name__)

_WEBSOCKET_MESSAGE_BYTES = 64 * 2**20
"""viser's clients answer a request for a picture in one message."""
_SHUTDOWN_S = 3
"""Open sockets get so long to close; every wait ends."""

OnReady = Callable[[str, Services], None]


def create_app(settings: Settings) -> FastAPI:
    """The application on one data folder; nothing is opened before it starts."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with running(settings) as services:
            app.state.services = services
            yield

    app = FastAPI(
        title="Chainage",
        description="Distance along a culvert for every frame and every defect.",
        version=version("chainage"),
        lifespan=lifespan,
        openapi_url="/api/openapi.json",
        docs_url=None,  # they load scripts from elsewhere
        redoc_url=None,
    )
    errors.install(app)
    for part in (
        access, uploads, inspections, observations, media, catalogue, health, live, viewer, pages,
    ):  # fmt: skip
        app.include_router(part.router)
    app.mount("/static", pages.Assets(directory=pages.static_folder()))
    app.add_middleware(Guard, allowed_hosts=(socket.gethostname(), *settings.allowed_hosts))
    app.add_middleware(Envelope)  # the last one added is the outermost
    return app


def app_from_environment() -> FastAPI:
    """For `uvicorn --factory app.main:app_from_environment`."""
    return create_app(Settings.load())


def serve(settings: Settings, host: str, port: int, on_ready: OnReady) -> None:
    """Listen and run the server, as `run` does.

    Raises:
        AddressNotAvailable: Another program listens there, or there is no such address.
        DataFolderInUse: Another server uses the data folder.
        OSError: The data folder cannot be made or written.
    """
    with listening(host, port) as listener:
        run(settings, host, listener, on_ready)


def listening(host: str, port: int) -> socket.socket:
    """A socket that is bound and holds early connections back until the server takes them.

    Raises:
        AddressNotAvailable: Another program listens there, or there is no such address.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        is_used = error.errno == EADDRINUSE
        reason = f"port {port} of {host} is in use" if is_used else error.strerror
        raise AddressNotAvailable(
            f"The server cannot listen: {reason}; choose another with --host or --port."
        ) from error


def run(settings: Settings, host: str, listener: socket.socket, on_ready: OnReady) -> None:
    """Run the server on `listener` until it is told to stop by a signal.

    `on_ready(url, services)` is called in a thread of its own once it takes requests, with the
    address to log in at; the token stands in it unless the operator has set one.  `host` is the
    name by which it may be reached besides those of the settings.

    Raises:
        DataFolderInUse: Another server uses the data folder.
        OSError: The data folder cannot be made or written.
    """
    logging.basicConfig(
        level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s"
    )
    for chatty in ("alembic", "uvicorn", "websockets"):
        logging.getLogger(chatty).setLevel(logging.WARNING)
    # Told here in one sentence; at the start of the application it would be a traceback in the log.
    DataFolder(settings.data, reserve_bytes=0).close()
    app = create_app(settings.model_copy(update={"allowed_hosts": (*settings.allowed_hosts, host)}))
    config = uvicorn.Config(
        app,
        host=host,
        log_config=None,
        access_log=False,  # the log-in address holds the token
        server_header=False,
        ws_per_message_deflate=False,
        ws_max_size=_WEBSOCKET_MESSAGE_BYTES,
        timeout_graceful_shutdown=_SHUTDOWN_S,
    )
    with suppress(KeyboardInterrupt):  # uvicorn raises it again after a graceful stop
        _Server(config, settings, on_ready).run([listener])


class _Server(uvicorn.Server):
    """Says when it is ready, and where."""

    def __init__(self, config: uvicorn.Config, settings: Settings, on_ready: OnReady) -> None:
        super().__init__(config)
        self._settings = settings
        self._on_ready = on_ready
        self._announcing: asyncio.Task[None] | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, then announce."""
        await super().startup(sockets)
        if self.started:
            app = self.config.app
            assert isinstance(app, FastAPI)  # noqa: S101  (we made the config)
            port = self.servers[0].sockets[0].getsockname()[1]
            url = _login_url(self.config.host, port, self._settings, app.state.services)
            self._announcing = asyncio.create_task(
                asyncio.to_thread(_announce, self._on_ready, url, app.state.services)
            )


def _announce(on_ready: OnReady, url: str, services: Services) -> None:
    try:
        on_ready(url, services)
    except Exception:  # the caller's fault must not go unseen in a task that nobody awaits
        logger.exception("The server runs, but what was to be done at its start has failed.")


def _login_url(host: str, port: int, settings: Settings, services: Services) -> str:
    shown = "127.0.0.1" if host in ("0.0.0.0", "::") else host  # noqa: S104  (compared, not bound)
    if ":" in shown and ip_address(shown):
        shown = f"[{shown}]"
    base = f"http://{shown}:{port}/login"
    if settings.token is not None:
        return base  # who set it knows it; it need not stand on the screen
    return f"{base}?token={services.access.server_token}"
