"""Builds the server: `create_app(settings)`; `serve` runs it."""

from __future__ import annotations

import asyncio
import gc
import logging
import queue
import socket
import ssl
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from errno import EADDRINUSE
from functools import cache
from importlib.metadata import version
from ipaddress import ip_address
from types import FrameType

import uvicorn
from fastapi import APIRouter, Depends, FastAPI
from starlette.routing import BaseRoute

from app import logs
from app.access.access import Access
from app.container import running
from app.errors import (
    AddressNotAvailable,
    AppError,
    DiskFull,
    InvalidSettings,
    NotReady,
    OpenToTheNetwork,
)
from app.ops.health import Health
from app.ops.memory import keep_little
from app.services import Services
from app.settings import Settings
from app.storage.blobs.stores import blobs_at
from app.storage.database.database import migrate, require_its_database, stored_at
from app.storage.database.dialect import Dialect
from app.storage.folder.address import Address, AddressFile
from app.storage.folder.files import DataFolder, Places
from app.web import answers
from app.web.deps import enforce_role
from app.web.http_protocol import PromptProtocol
from app.web.middleware import Envelope, Guard
from app.web.request_log import RequestLog
from app.web.routers.inspection import (
    attachments,
    changes,
    corrections,
    counter,
    findings,
    inspections,
    live,
    media,
    observations,
    picking,
    reviews,
    unrolled,
    viewer,
)
from app.web.routers.library import (
    acceptance,
    archive,
    asset_map,
    bulk,
    catalogue,
    detectors,
    imports,
    packs,
    register,
    report_templates,
    rigs,
    search,
    work,
    work_orders,
)
from app.web.routers.ogc import routes as ogc
from app.web.routers.server import accept, access, aiming, pages, server, tokens, uploads
from app.web.schemas.failures import describe, failures

logger = logging.getLogger(__name__)

_WEBSOCKET_MESSAGE_BYTES = 64 * 2**10
"""Limit of a message from a browser, which sends clicks, camera poses and acknowledgements."""
_SHUTDOWN_S = 3
"""Time that open sockets get to close."""

_KEEP_AGAIN_S = 5.0

_GUARDS = [Depends(enforce_role)]
"""Of every route, one that is added later included."""

OnReady = Callable[[str, Services], None]


def create_app(settings: Settings, stored: Dialect | None = None) -> FastAPI:
    """Create the application on one data folder; nothing is opened before it starts.

    Args:
        settings: Of the server.
        stored: Its database, if this server is the active one of it already.
    """

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with running(settings, stored) as services:
            app.state.services = services
            yield

    app = FastAPI(
        title="Chainage",
        description="Distance along a culvert for every frame and every defect.",
        version=version("chainage"),
        lifespan=lifespan,
        dependencies=_GUARDS,
        openapi_url="/api/openapi.json",
        docs_url=None,  # they load scripts from elsewhere
        redoc_url=None,
    )
    app.state.is_open_to_lan = settings.insecure_lan
    describe(app)
    answers.install(app)
    # Mounted before the routes, because the first match answers.
    app.mount("/static", pages.Assets(directory=pages.static_folder()))
    app.router.routes += _routes()
    app.add_middleware(Guard, allowed_hosts=(socket.gethostname(), *settings.allowed_hosts))
    app.add_middleware(Envelope, pictures_from=settings.map_tiles_origin)
    app.add_middleware(RequestLog)  # the last one added is the outermost
    return app


@cache
def _routes() -> list[BaseRoute]:
    """Return the routes, which all applications of a process share: what FastAPI makes of them
    takes a tenth of a second.
    """
    every = APIRouter(responses=failures(), dependencies=_GUARDS)
    for part in (
        access.router, access.person, uploads.router, aiming.router, imports.router,
        inspections.router, observations.router, attachments.router, picking.router,
        corrections.router, counter.router, media.router, bulk.router, report_templates.router,
        catalogue.router, packs.router, rigs.router, register.router, reviews.router,
        findings.router, detectors.router, changes.router,
        imports.samples, archive.router, search.router, asset_map.router, work.router,
        tokens.router, ogc.router, unrolled.router, server.router, live.router, viewer.router,
        pages.router, acceptance.router, accept.router, work_orders.router,
    ):  # fmt: skip
        every.include_router(part)
    return every.routes


def serve(settings: Settings, host: str, port: int, on_ready: OnReady) -> None:
    """Run the server, as `run` does; as a standby first if another one is active.

    Raises:
        OpenToTheNetwork: Other machines could reach it, without encryption.
        AddressNotAvailable: Another program listens there, or there is no such address.
        InvalidSettings: The certificate or its key cannot be used.
        DataFolderInUse: Another server uses the data folder.
        UnusableDatabase: The database is lost, damaged, or of a newer version.
        StoreUnavailable: The object store does not answer, or refuses.
        DiskFull: There is no room for a new database, or the tables of this version.
        OSError: The data folder cannot be made or written.
    """
    with listening(settings, host, port) as listener:
        run(settings, host, listener, on_ready)


def listening(settings: Settings, host: str, port: int) -> socket.socket:
    """Return a bound socket, which refuses connections until the server listens on it.

    Raises:
        OpenToTheNetwork: Other machines could reach it, without encryption.
        AddressNotAvailable: Another program listens there, or there is no such address.
        InvalidSettings: The certificate or its key cannot be used.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listener = socket.socket(family)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        # Connections inherit it. An answer is sent as head and body; without it the body waits for
        # the acknowledgement of the head, up to 40 ms. asyncio sets it on its own sockets only.
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except OSError as error:
        is_used = error.errno == EADDRINUSE
        reason = f"port {port} of {host} is in use" if is_used else f"{host}: {error.strerror}"
        raise AddressNotAvailable(
            f"The server cannot listen: {reason}; choose another with --host or --port."
        ) from error
    try:
        _require_protection(settings, listener.getsockname()[0])
    except AppError:
        listener.close()
        raise
    return listener


def _require_protection(settings: Settings, address: str) -> None:
    if settings.tls_cert is not None and settings.tls_key is not None:
        try:
            # With an empty password: an encrypted key would prompt on the terminal.
            ssl.create_default_context().load_cert_chain(
                settings.tls_cert, settings.tls_key, password=""
            )
        except (OSError, ValueError) as error:  # that of a wrong or encrypted key is an OSError too
            raise InvalidSettings(
                f"CHAINAGE_TLS_CERT and CHAINAGE_TLS_KEY cannot be used: {error}. They name a "
                "certificate and its key, without a password, in PEM files."
            ) from error
    elif not settings.insecure_lan and not ip_address(address).is_loopback:
        raise OpenToTheNetwork(
            f"Other machines could reach the server on {address}, and read its traffic. Give it a "
            "certificate (--tls-cert and --tls-key, or CHAINAGE_TLS_CERT and CHAINAGE_TLS_KEY), or "
            "allow it (--insecure-lan, or CHAINAGE_INSECURE_LAN=1)."
        )


def run(settings: Settings, host: str, listener: socket.socket, on_ready: OnReady) -> None:
    """Run the server on `listener` until a signal stops it.

    `on_ready(url, services)` is called in a separate thread once the server accepts requests, with
    the log-in address, which contains the token unless the operator has set one. `host` is a name
    by which the server may be reached besides those of the settings.

    Raises:
        DataFolderInUse: Another server uses the data folder.
        UnusableDatabase: The database is lost, damaged, or of a newer version.
        StoreUnavailable: The object store does not answer, or refuses.
        DiskFull: There is no room for a new database, or the tables of this version.
        OSError: The data folder cannot be made or written.
    """
    logs.configure(settings.log_format)
    keep_little()
    # A signal stops a standby that waits; uvicorn raises it again after a graceful stop.
    with suppress(KeyboardInterrupt):
        server = _prepared(settings, host, on_ready)
        # What is loaded by now stays.  To search it for garbage, as a 3D view that closes does,
        # would hold up all requests for 140 ms.
        gc.freeze()
        gc.enable()
        server.run([listener])


@contextmanager
def in_background(settings: Settings) -> Iterator[str]:
    """Run the server in a thread, on a free port that only this machine reaches, until the block
    ends; yield its log-in address.

    Raises:
        DataFolderInUse: Another server uses the data folder.
        UnusableDatabase: The database is lost, damaged, or of a newer version.
        NotReady: The server does not start.
        DiskFull, OSError: As for `run`.
    """
    host = "127.0.0.1"
    settings = settings.model_copy(update={"tls_cert": None, "tls_key": None})
    urls: queue.SimpleQueue[str | None] = queue.SimpleQueue()
    with listening(settings, host, 0) as listener:
        server = _prepared(settings, host, lambda url, _: urls.put(url), may_wait=False)

        def work() -> None:
            try:
                server.run([listener])
            finally:
                urls.put(None)  # also if it has never been ready

        thread = threading.Thread(target=work, name="server")
        thread.start()
        try:
            url = urls.get()
            if url is None:
                raise NotReady("The server could not start.")
            yield url
        finally:
            server.stop()
            thread.join()


def _prepared(
    settings: Settings, host: str, on_ready: OnReady, *, may_wait: bool = True
) -> _Server:
    """Return a server that can be run, once it is the active one of its database.

    Raises:
        OtherServerActive: Another one is, and this one may not wait.
        DataFolderInUse, UnusableDatabase, DiskFull, OSError: As for `run`.
    """
    stored = stored_at(settings.database_url, settings.data)
    stored.lead(_say_that_it_waits if may_wait else None, ends_process=True)
    # Reported here in one sentence; at the start of the application the log would get a traceback.
    folder = DataFolder(settings.data, reserve_bytes=0, is_shared=settings.database is not None)
    try:
        AddressFile(folder).clear()
        require_its_database(stored, folder)
        migrate(stored)
        with suppress(DiskFull):  # what is stored can be read
            blobs_at(settings.store, folder.root).check()
    finally:
        folder.close()
    reached_as = {"allowed_hosts": (*settings.allowed_hosts, host)}
    app = create_app(settings.model_copy(update=reached_as), stored)
    config = uvicorn.Config(
        app,
        host=host,
        log_config=None,
        access_log=False,  # the log-in address contains the token
        server_header=False,
        http=PromptProtocol,
        # Anybody can send these headers, and guesses are counted by address.
        proxy_headers=bool(settings.trusted_proxies),
        forwarded_allow_ips=[str(network) for network in settings.trusted_proxies],
        ssl_certfile=settings.tls_cert,
        ssl_keyfile=settings.tls_key,
        ws_per_message_deflate=False,
        ws_max_size=_WEBSOCKET_MESSAGE_BYTES,
        timeout_graceful_shutdown=_SHUTDOWN_S,
    )
    return _Server(config, settings, on_ready)


def _say_that_it_waits() -> None:
    logger.warning(
        "Another server is the active one of this database. This one is a standby: it does not "
        "listen, and takes over as soon as the other one ends or is silent for 15 s."
    )


class _Server(uvicorn.Server):
    """Reports when the server is ready, and at which address."""

    def __init__(self, config: uvicorn.Config, settings: Settings, on_ready: OnReady) -> None:
        super().__init__(config)
        self._settings = settings
        self._on_ready = on_ready
        self._address = AddressFile(Places(settings.data))
        self._keeping: asyncio.Task[None] | None = None
        self._announcing: asyncio.Task[None] | None = None

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Handle a signal: open requests are answered before the sockets are closed."""
        self._announce_stop()
        super().handle_exit(sig, frame)

    def stop(self) -> None:
        """Stop from another thread, as a signal does."""
        self._announce_stop()
        self.should_exit = True

    def _announce_stop(self) -> None:
        app = self.config.app
        if self.started and isinstance(app, FastAPI):
            app.state.services[Health].stop()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, then call on_ready."""
        await super().startup(sockets)
        if self.started:
            app = self.config.app
            assert isinstance(app, FastAPI)  # noqa: S101  (we made the config)
            port = self.servers[0].sockets[0].getsockname()[1]
            base = _base_url(self.config.host, port, self._settings)
            certificate = self._settings.tls_cert
            address = Address(base, str(certificate.resolve()) if certificate else None)
            url = _login_url(base, self._settings, app.state.services)
            self._keeping = asyncio.create_task(self._keep(address))
            self._announcing = asyncio.create_task(
                asyncio.to_thread(_announce, self._on_ready, url, app.state.services)
            )

    async def _keep(self, address: Address) -> None:
        """Let programs of this machine find the server, once there is room for its address."""
        while True:
            try:
                self._address.keep(address)
            except OSError as error:
                logger.warning("Other commands do not find the server yet: %s", error)
                await asyncio.sleep(_KEEP_AGAIN_S)
            else:
                return

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop; programs of this machine no longer find the server."""
        if self._keeping is not None:
            self._keeping.cancel()
        self._address.forget()
        await super().shutdown(sockets)


def _announce(on_ready: OnReady, url: str, services: Services) -> None:
    try:
        on_ready(url, services)
    except Exception:  # the caller's fault must not go unnoticed in a task that nobody awaits
        logger.exception("The server runs, but the action after its start has failed.")


def _base_url(host: str, port: int, settings: Settings) -> str:
    shown = "127.0.0.1" if host in ("0.0.0.0", "::") else host  # noqa: S104  (compared, not bound)
    if ":" in shown and ip_address(shown):
        shown = f"[{shown}]"
    return f"{'https' if settings.has_tls else 'http'}://{shown}:{port}"


def _login_url(base: str, settings: Settings, services: Services) -> str:
    if settings.token is not None:
        return f"{base}/login"  # the operator who set the token knows it
    return f"{base}/login?token={services[Access].server_token}"
