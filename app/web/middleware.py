"""Wraps all routes: one error body, security headers, and a guard against unauthorised access."""

from __future__ import annotations

import asyncio
import base64
import ipaddress
import logging
import re
import time
from collections.abc import Collection
from contextlib import AbstractContextManager, AsyncExitStack, ExitStack
from urllib.parse import quote, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, HTTPConnection
from starlette.responses import RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.access.access import Access, Principal, network_of
from app.errors import AppError, CrossOrigin, InspectionNotFound, Unauthenticated, UnknownHost
from app.inspections.inspections import Inspections
from app.storage.database import limits
from app.web.answers import answer, body_of
from app.web.languages import WORDS
from app.web.turns import Shares, Turns

logger = logging.getLogger(__name__)

SECURITY_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(self), payment=(), usb=()",
    "Cache-Control": "no-store",
}
"""Set where the answer does not set them; the 3D page has its own policy."""

MAX_BODY_BYTES = 2**20
"""Limit of other bodies than those below and pieces of uploads, which are streamed to the disk."""
_MIB = 2**20
LARGER_BODIES = {
    "/api/imports": 64 * _MIB,
    "/api/archive/films": 64 * _MIB,
    "/api/archive/films/preview": 64 * _MIB,
    "/api/register/import": 16 * _MIB,
    "/api/work-orders/import": 16 * _MIB,
}
"""Limits of files with old surveys, and of tables of films, assets and work orders."""
_LARGE = Turns("large bodies", most=3, each=1)
"""Each is held in memory, twice for a moment; who waits has not sent it yet."""
BODY_PART_S = 60.0
"""Longest silence of a client within an announced body; slow is not silent."""
BODY_BYTES_PER_S = 1000
"""Least rate of a body after its first minute: a thirtieth of a poor mobile line."""

_COOKIE = "chainage_session"
_SECURE_COOKIE = "__Host-chainage_session"
_HSTS = "max-age=15552000"
"""A browser that was here over TLS does not come without it for half a year."""

_PUBLIC = frozenset(
    {
        "/healthz", "/readyz", "/login", "/api/login", "/favicon.ico",
        # parts of the log-in page
        "/static/icon.svg", "/static/login.css", "/static/login.js", "/static/css/tokens.css",
        "/static/css/base.css", "/static/core/server/api.js", "/static/core/page/store.js",
        "/static/core/page/html.js", "/static/core/page/preferences.js",
        "/static/core/page/remembered.js", "/static/core/page/words.js",
        "/static/core/page/rights.js",
        "/static/components/shared/insecure-banner/insecure-banner.js",
    }
)  # fmt: skip
_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
_TICKETED = re.compile(r"/viewer/([0-9a-f]{32})/([^/]+)(?:/[0-9a-f]{32})?/?")
"""The client of a 3D view: its ticket is in the address, and its cookies are ignored."""

_BY_LINK = "/accept/"
"""Beginning of the pages that a secret in their address opens."""

CLOSE_SIGNED_OUT = 4401
MOST_SOCKETS = 128
"""Of one token or address; a page has one or two, and a server some 500 connections."""
MOST_VIEWS = 32
"""3D views of one token or address, of the 48 of a server."""
_LOOK_EVERY_S = 2.0
"""How often a web socket checks whether its session or token has ended."""


class Envelope:
    """Outermost layer: security headers on every answer, a 500 with our body, a limit on bodies."""

    def __init__(self, app: ASGIApp, pictures_from: str | None) -> None:
        """Allow the page pictures of one other origin, if it is set."""
        self._app = app
        self._headers = {"Content-Security-Policy": _policy(pictures_from), **SECURITY_HEADERS}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle an ASGI connection."""
        if scope["type"] == "websocket":
            await self._app(scope, receive, self._with_headers(scope, send))
            return
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        started = replaced = False
        is_upload = scope["path"].startswith("/api/uploads")

        async def send_with_headers(message: Message) -> None:
            nonlocal started, replaced
            if message["type"] == "http.response.start":
                started = True
                headers = MutableHeaders(scope=message)
                is_page = scope["path"].startswith(_BY_LINK)  # people read its failures
                replaced = not is_page and _is_foreign_failure(message["status"], headers)
                if replaced:  # such as Starlette's own answer to a range that does not exist
                    body = answer(HTTPException(message["status"])).body
                    headers["Content-Type"] = "application/json"
                    headers["Content-Length"] = str(len(body))
                self._secure(scope, headers)
                if is_upload:
                    headers.setdefault("Tus-Resumable", "1.0.0")
                await send(message)
                if replaced:
                    await send({"type": "http.response.body", "body": body})
            elif not replaced:
                await send(message)

        is_streamed = is_upload and scope["method"] == "PATCH"
        try:
            async with AsyncExitStack() as stack:
                most = LARGER_BODIES.get(scope["path"], MAX_BODY_BYTES)
                limited = _limited(receive, None if is_streamed else most)
                if scope["path"] in LARGER_BODIES:
                    limited = _in_turn(limited, HTTPConnection(scope), stack)
                await self._app(scope, limited, send_with_headers)
        except (ClientDisconnect, ConnectionError):
            logger.debug("A client went away during %s %s.", scope["method"], _logged(scope))
        except Exception as error:
            status, body = body_of(error)
            if status == 507:
                logger.warning("%s %s: %s", scope["method"], _logged(scope), body["detail"])
            else:
                logger.exception("%s %s failed.", scope["method"], _logged(scope))
            if started:
                raise
            await answer(error)(scope, receive, send_with_headers)

    def _with_headers(self, scope: Scope, send: Send) -> Send:
        """Add the headers also to an answer that replaces the opening of a web socket."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "websocket.http.response.start":
                self._secure(scope, MutableHeaders(scope=message))
            await send(message)

        return send_with_headers

    def _secure(self, scope: Scope, headers: MutableHeaders) -> None:
        for name, value in self._headers.items():
            headers.setdefault(name, value)
        if is_encrypted(HTTPConnection(scope)):
            headers["Strict-Transport-Security"] = _HSTS


class Guard:
    """Checks host, Origin, session or token; sets `state.principal` except for public paths."""

    def __init__(self, app: ASGIApp, allowed_hosts: Collection[str]) -> None:
        self._app = app
        self._hosts = {"localhost", *(host.lower() for host in allowed_hosts)}
        self._sockets = Shares("live connections")
        self._views = Shares("3D views")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle an ASGI connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        with ExitStack() as stack:
            try:
                await self._check(connection)
                if scope["type"] == "websocket":
                    stack.enter_context(self._share(connection))
            except Unauthenticated as error:
                await _refusal(scope, error)(scope, receive, send)
            except AppError as error:
                await answer(error)(scope, receive, send)
            else:
                principal: Principal | None = scope.get("state", {}).get("principal")
                stack.enter_context(limits.limited(principal.limit if principal else None))
                if scope["type"] == "websocket":
                    await self._serve_while_logged_in(connection, receive, send)
                else:
                    await self._app(scope, receive, send)

    def _share(self, connection: HTTPConnection) -> AbstractContextManager[None]:
        """Count a web socket until it ends.

        Raises:
            Busy: The token or the address has as many as it may have.
        """
        is_view = connection.scope["path"].startswith("/viewer/")
        shares, most = (self._views, MOST_VIEWS) if is_view else (self._sockets, MOST_SOCKETS)
        principal: Principal = connection.state.principal
        network = network_of(address_of(connection))
        return shares.share(most, f"token {principal.name}", f"address {network}")

    async def _serve_while_logged_in(
        self, connection: HTTPConnection, receive: Receive, send: Send
    ) -> None:
        """Close a web socket when its session or token ends, or its inspection leaves the projects
        of the token; requests are checked one by one.
        """
        has_ended = False

        async def send_until_ended(message: Message) -> None:
            nonlocal has_ended
            if has_ended:  # nothing may be sent after it; the next `receive` reports the end
                return
            try:
                await send(message)
            except RuntimeError:
                # uvicorn itself closes a connection with a message that is too long, or without
                # pongs, and then refuses what the route was about to send.
                if message["type"] != "websocket.send":
                    raise
                has_ended = True

        serving = asyncio.ensure_future(self._app(connection.scope, receive, send_until_ended))
        try:
            while not (await asyncio.wait({serving}, timeout=_LOOK_EVERY_S))[0]:
                if not has_ended and not await self._may_stay(connection):
                    has_ended = True
                    await send({"type": "websocket.close", "code": CLOSE_SIGNED_OUT})
            await serving
        finally:
            serving.cancel()
            await asyncio.wait({serving})

    async def _may_stay(self, connection: HTTPConnection) -> bool:
        principal = await self._principal(connection)
        if principal is None or principal.limit != limits.current():
            return False
        try:
            if principal.projects is not None and "inspection_id" in connection.path_params:
                await require_seen(connection)
        except InspectionNotFound:
            return False
        return True

    async def _check(self, connection: HTTPConnection) -> None:
        scope = connection.scope
        self._check_host(connection.headers)
        if not is_public(scope["path"]):
            principal = await self._principal(connection)
            if principal is None:
                raise Unauthenticated(
                    "Log in, or send a valid token as `Authorization: Bearer ...`."
                )
            connection.state.principal = principal
        if scope["path"].startswith(_BY_LINK):
            return  # cookies do not count there, and no other page knows the address
        if _TICKETED.fullmatch(scope["path"]):
            return  # cookies do not count there, and the origin of the page is opaque
        if scope["type"] == "websocket":
            _check_origin(connection, is_required=True)
        elif scope["method"] not in _SAFE_METHODS:
            has_cookie = cookie_of(connection) is not None
            _check_origin(connection, is_required=has_cookie)

    def _check_host(self, headers: Headers) -> None:
        """Prevent DNS rebinding: another site's page may reach us only under its own name.

        An IP address as host cannot be rebound, so every address is accepted.
        """
        host = _host_name(headers.get("host", ""))
        if host not in self._hosts and not _is_address(host):
            raise UnknownHost(
                f"The server does not accept the host name {host!r}; its operator can add it to "
                "CHAINAGE_ALLOWED_HOSTS."
            )

    async def _principal(self, connection: HTTPConnection) -> Principal | None:
        access: Access = connection.app.state.services[Access]
        if ticketed := _TICKETED.fullmatch(connection.scope["path"]):
            inspection_id, ticket = ticketed.groups()
            return await asyncio.to_thread(access.by_ticket, ticket, inspection_id)
        scheme, _, token = connection.headers.get("authorization", "").partition(" ")
        if scheme.lower() == "basic" and _is_for_gis(connection.scope["path"]):
            scheme, token = "bearer", _password_of(token)
        if scheme.lower() == "bearer":
            address = address_of(connection)
            return await asyncio.to_thread(access.by_token, token.strip(), address)
        cookie = cookie_of(connection)
        if cookie is None:
            return None
        return await asyncio.to_thread(access.by_cookie, cookie)


def is_public(path: str) -> bool:
    """Return whether an address is open to anybody: the log-in page, with its words, and what a
    secret in the address opens.
    """
    is_named = path in _PUBLIC or path.startswith(_BY_LINK)
    return is_named or WORDS.fullmatch(path.removeprefix("/static/")) is not None


def _logged(scope: Scope) -> str:
    """Return the path of a request as the log may show it: without the secret of a link."""
    path: str = scope["path"]
    return f"{_BY_LINK}..." if path.startswith(_BY_LINK) else path


def _is_for_gis(path: str) -> bool:
    """Return whether a token may come as the password of a user: only where nothing can be changed,
    because a browser may send a password by itself.
    """
    return path == "/ogc" or path.startswith("/ogc/")


def _password_of(credentials: str) -> str:
    """Return the password of Basic credentials (RFC 7617), whatever the user is called."""
    try:
        return base64.b64decode(credentials, validate=True).decode("utf-8").partition(":")[2]
    except ValueError:
        return ""


async def require_seen(connection: HTTPConnection) -> None:
    """Raise InspectionNotFound unless the running request sees the inspections in its address."""
    inspections: Inspections = connection.app.state.services[Inspections]
    for name in ("inspection_id", "earlier_id"):
        if name in connection.path_params:
            await asyncio.to_thread(inspections.row, connection.path_params[name])


def _is_foreign_failure(status: int, headers: MutableHeaders) -> bool:
    return status >= 400 and not headers.get("content-type", "").startswith("application/json")


def _policy(pictures_from: str | None) -> str:
    pictures = "'self' blob: data:" + (f" {pictures_from}" if pictures_from else "")
    return (
        f"default-src 'none'; script-src 'self'; style-src 'self'; img-src {pictures}; "
        "media-src 'self' blob:; connect-src 'self'; frame-src 'self'; font-src 'self'; "
        "base-uri 'none'; form-action 'self'; frame-ancestors 'none'; worker-src 'self'; "
        "manifest-src 'self'"
    )


def _scheme_of(connection: HTTPConnection) -> str:
    return "https" if connection.url.scheme in ("https", "wss") else "http"


def is_encrypted(connection: HTTPConnection) -> bool:
    """Return whether the browser speaks TLS, with the server or with a trusted proxy before it."""
    return _scheme_of(connection) == "https"


def cookie_name(connection: HTTPConnection) -> str:
    """Return the name of the session cookie; under TLS only this very host can set it.

    Cookies are of a host: the port in the name keeps its servers apart.
    """
    name = _SECURE_COOKIE if is_encrypted(connection) else _COOKIE
    port = connection.url.port
    return name if port is None else f"{name}_{port}"


def cookie_of(connection: HTTPConnection) -> str | None:
    """Return the session cookie."""
    return connection.cookies.get(cookie_name(connection))


def address_of(connection: HTTPConnection) -> str:
    """Return the address of the connection; headers of a proxy are not trusted."""
    return connection.client.host if connection.client else "unknown"


def person_of(connection: HTTPConnection) -> str:
    """Return whose share of the server a request takes: several people may have one token, and
    clients that come by a link have none.
    """
    principal: Principal | None = getattr(connection.state, "principal", None)
    return f"{principal.name if principal else ''} {network_of(address_of(connection))}"


def _host_name(host: str) -> str:
    """Return the host of a Host header without its port; empty if it is invalid."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _check_origin(connection: HTTPConnection, *, is_required: bool) -> None:
    """Check that the request comes from our page: CORS does not prevent others from sending it."""
    headers = connection.headers
    origin = headers.get("origin")
    site = headers.get("sec-fetch-site")
    if origin is not None:
        is_ours = origin.lower() == f"{_scheme_of(connection)}://{headers.get('host', '')}".lower()
    elif site is not None:
        is_ours = site in ("same-origin", "none")
    else:
        is_ours = not is_required
    if not is_ours:
        raise CrossOrigin(
            "The request comes from a page of another site, or does not state its origin. Where a "
            "reverse proxy speaks TLS for the server, CHAINAGE_TRUSTED_PROXIES must name it."
        )


def _refusal(scope: Scope, error: Unauthenticated) -> Response:
    """Return a redirection to the log-in for pages, and the error for everything else."""
    accepts = Headers(scope=scope).get("accept", "")
    path = scope["path"]
    is_page = scope["type"] == "http" and scope["method"] == "GET" and "text/html" in accepts
    if is_page and not path.startswith(("/api/", "/static/", "/viewer/")):
        query = scope["query_string"].decode("latin-1")
        # A token in a wrong address is not passed on.
        wanted = f"{path}?{query}" if query and "token=" not in query else path
        return RedirectResponse(f"/login?next={quote(wanted)}", 303)
    response = answer(error)
    if _is_for_gis(path):
        response.headers["WWW-Authenticate"] = 'Basic realm="Chainage", charset="UTF-8"'
    return response


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def _limited(receive: Receive, most: int | None) -> Receive:
    """Limit `receive` to `most` bytes, if set, and refuse bodies that stop or trickle.

    Only the time counts in which the server waits for the body. The empty one of a GET is read when
    its answer begins, which may take minutes to make: who reads it then looks for a disconnection.
    """
    taken, is_whole, waited_s = 0, False, 0.0

    async def receive_limited() -> Message:
        nonlocal taken, is_whole, waited_s
        if is_whole:  # the next message is the client's disconnection
            return await receive()
        began_s, spent_s = time.monotonic(), waited_s - taken / BODY_BYTES_PER_S
        try:
            message = await asyncio.wait_for(receive(), BODY_PART_S - max(spent_s, 0.0))
        except TimeoutError as error:
            raise HTTPException(408) from error
        waited_s += time.monotonic() - began_s
        taken += len(message.get("body", b""))
        is_whole = not message.get("more_body", False)
        if most is not None and taken > most:
            raise HTTPException(413)
        return message

    return receive_limited


def _in_turn(receive: Receive, connection: HTTPConnection, stack: AsyncExitStack) -> Receive:
    """Read a large body only after its turn has come, which ends with the request."""
    has_turn = False

    async def receive_in_turn() -> Message:
        nonlocal has_turn
        if not has_turn:
            has_turn = True
            await stack.enter_async_context(_LARGE.turn(person_of(connection)))
        return await receive()

    return receive_in_turn
