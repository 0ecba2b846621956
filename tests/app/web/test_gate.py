"""The way in at its edges: requests that never end, proxies, links that log in, a full disk."""

from __future__ import annotations

import asyncio
import socket
from pathlib import Path
from types import SimpleNamespace

import httpx
import loops
import pytest
from builders import PATIENCE_S, TOKEN, Client, LiveServer, assert_error, serving
from processes import process
from small_disk import small_disk
from starlette.exceptions import HTTPException
from starlette.responses import StreamingResponse
from starlette.types import Message, Receive, Scope, Send
from websockets.exceptions import ConnectionClosedError, InvalidStatus
from websockets.sync.client import connect

from app.web import middleware
from app.web.http_protocol import PromptProtocol

PROMPT_S = 0.3
PATIENT_S = 600.0
HEAD = b"POST /api/login HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"


class _Prompt(PromptProtocol):
    head_s = PROMPT_S


class _Few(PromptProtocol):
    head_s = PATIENT_S
    most = 8
    most_of_address = 4


def opened(server: LiveServer, source: str = "127.0.0.1") -> socket.socket:
    host, port = server.url.removeprefix("http://").split(":")
    return socket.create_connection((host, int(port)), PATIENCE_S, (source, 0))


def rest_of(connection: socket.socket) -> bytes:
    """All that comes until the server ends it; a reset is an end."""
    read = b""
    try:
        while piece := connection.recv(4096):
            read += piece
    except ConnectionResetError:
        pass
    return read


NEVER_WHOLE = (
    (b"", b""),
    (b"GET / HTTP/1.1\r\nHost: loc", b""),
    # The next one on the same connection.
    (b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\nGET", b"HTTP/1.1 200"),
    # Its body is refused unread, and its end never comes.
    (
        b"POST /api/inspections HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99\r\n\r\n{",
        b"HTTP/1.1 401",
    ),
)
"""What is sent, and how the answer to it begins."""


def test_a_request_that_never_gets_whole_is_not_waited_for(tmp_path: Path) -> None:
    with serving(tmp_path, http=_Prompt) as client:
        for sent, answered in NEVER_WHOLE:
            with opened(client.server) as connection:
                connection.sendall(sent)
                if answered.endswith(b"401"):
                    assert connection.recv(4096).startswith(answered)
                    connection.sendall(b" ")
                    rest_of(connection)  # the body of the answer, and then it ends
                else:
                    assert rest_of(connection).startswith(answered)


def test_who_sends_nothing_makes_room_for_who_does(tmp_path: Path) -> None:
    with serving(tmp_path, http=_Few) as client:
        client.headers["Connection"] = "close"
        sources = [f"127.0.0.{2 + n}" for n in range(3 * _Few.most)]
        silent = [opened(client.server, source) for source in sources]
        assert client.get("/healthz").status_code == 200
        for connection in silent[: 2 * _Few.most]:
            assert rest_of(connection) == b""
        for connection in silent:
            connection.close()


def test_one_address_does_not_take_all_connections(tmp_path: Path) -> None:
    begun = HEAD + b"Content-Length: 99\r\nExpect: 100-continue\r\n\r\n"
    with serving(tmp_path, http=_Few) as client:
        held = [opened(client.server, "127.0.0.9") for _ in range(_Few.most_of_address)]
        for connection in held:
            connection.sendall(begun)
            assert connection.recv(4096).startswith(b"HTTP/1.1 100")  # its body is waited for
        assert rest_of(opened(client.server, "127.0.0.9")) == b""
        assert client.get("/healthz").status_code == 200
        for connection in held:
            connection.close()


@pytest.mark.parametrize("path", ["/api/login", "/api/imports"])
def test_a_body_that_stops_or_trickles_is_refused(
    shared: Client, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    monkeypatch.setattr(middleware, "BODY_PART_S", PROMPT_S)
    head = HEAD.replace(b"/api/login", path.encode())
    head += f"Authorization: Bearer {TOKEN}\r\nContent-Length: 99\r\n\r\n".encode()
    with opened(shared.server) as connection:
        connection.sendall(head + b"{")
        connection.settimeout(PROMPT_S / 10)
        answer = b""
        for _ in range(200):  # a byte now and then: never silent for long
            try:
                answer = connection.recv(4096)
                break
            except TimeoutError:
                connection.sendall(b" ")
    assert answer.startswith(b"HTTP/1.1 408")


@pytest.mark.parametrize(("piece_bytes", "arrives"), [(60_000, True), (600, False)])
def test_a_body_may_be_slow_but_not_for_ever(
    monkeypatch: pytest.MonkeyPatch, piece_bytes: int, arrives: bool
) -> None:
    """A piece every 50 s, by a clock of our own."""
    now_s = 0.0
    monkeypatch.setattr(middleware, "time", SimpleNamespace(monotonic=lambda: now_s))

    async def receive() -> Message:
        nonlocal now_s
        now_s += 50.0
        return {"type": "http.request", "body": bytes(piece_bytes), "more_body": now_s < 5000}

    async def read() -> int:
        taken, limited = 0, middleware._limited(receive, None)
        while (message := await limited())["more_body"]:
            taken += len(message["body"])
        return taken

    if arrives:
        assert loops.run(read) == 99 * piece_bytes
    else:
        with pytest.raises(HTTPException):
            loops.run(read)


def test_an_answer_may_take_longer_to_make_than_a_body_may_be_silent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Bytes of a bundle that begins after ten minutes, while somebody looks for a disconnection."""
    now_s, sent, asked = 0.0, bytearray(), 0
    monkeypatch.setattr(middleware, "time", SimpleNamespace(monotonic=lambda: now_s))
    pieces = 50 * [bytes(2**16)]

    async def made(_: Scope, receive: Receive, send: Send) -> None:
        nonlocal now_s
        now_s += 600.0
        scope = {"type": "http", "asgi": {"spec_version": "2.3"}}
        await StreamingResponse(iter(pieces))(scope, receive, send)

    async def receive() -> Message:
        nonlocal asked
        asked += 1
        if asked > 1:  # nobody goes away
            await asyncio.Event().wait()
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message: Message) -> None:
        sent.extend(message.get("body", b""))

    guarded = middleware.Envelope(made, None)
    scope = {"type": "http", "method": "GET", "path": "/api/bundle", "headers": []}
    loops.run(lambda: guarded(scope, receive, send))
    assert len(sent) == sum(map(len, pieces))


def test_a_proxy_is_believed_only_where_it_is_named(tmp_path: Path, clip: Path) -> None:
    def guess(client: httpx.Client, address: str) -> int:
        forwarded = {"X-Forwarded-For": f"203.0.113.9, {address}", "X-Forwarded-Proto": "https"}
        return client.post("/api/login", json={"token": "wrong"}, headers=forwarded).status_code

    with process(tmp_path / "named", TRUSTED_PROXIES="10.0.0.0/8, 127.0.0.1") as client:
        stranger = httpx.Client(
            base_url=client.server.url, headers={"Host": "localhost"}, timeout=PATIENCE_S
        )
        assert [guess(stranger, "192.0.2.1") for _ in range(11)] == [401] * 10 + [429]
        assert guess(stranger, "192.0.2.2") == 401
        forwarded = {"X-Forwarded-For": "192.0.2.3", "X-Forwarded-Proto": "https"}
        body = {"token": TOKEN}
        secure = forwarded | {"Origin": "https://localhost"}
        answer = stranger.post("/api/login", json=body, headers=secure)
        assert answer.status_code == 204
        assert answer.headers["Set-Cookie"].startswith("__Host-")
        plain = forwarded | {"Origin": "http://localhost"}
        refused = stranger.post("/api/login", json=body, headers=plain)
        assert_error(refused, 403, "cross_origin")
        _message_and_refusal(client, clip)
        stranger.close()
    log = (tmp_path / "named.log").read_text()
    assert "ERROR" not in log
    assert "Traceback" not in log
    with serving(tmp_path / "unnamed") as client:
        addresses = [f"192.0.2.{n}" for n in range(11)]
        with client.anonymous() as stranger:
            assert [guess(stranger, address) for address in addresses] == [401] * 10 + [429]
            origin = {"Origin": client.server.url.replace("http", "https")}
            refused = stranger.post("/api/login", json={"token": TOKEN}, headers=origin)
            assert "CHAINAGE_TRUSTED_PROXIES" in assert_error(refused, 403, "cross_origin")


def _message_and_refusal(client: Client, clip: Path) -> None:
    """A message of more than 64 kB ends its connection; one without a session is refused."""
    url = f"{client.server.websocket_url}/api/inspections/{client.inspect(clip)}/live"
    with pytest.raises(InvalidStatus), connect(url, origin=client.server.url, close_timeout=1):
        pass
    bearer = {"Authorization": f"Bearer {TOKEN}"}
    for _ in range(30):  # some of them while the server is about to send the first picture
        with connect(
            url, origin=client.server.url, additional_headers=bearer, close_timeout=1
        ) as live:
            live.send(b" " * (64 * 1024 + 1))
            with pytest.raises(ConnectionClosedError) as ended:
                list(live)
        assert ended.value.rcvd is not None
        assert ended.value.rcvd.code == 1009


def test_a_link_logs_a_browser_in_only_at_its_own_wish(shared: Client) -> None:
    page = {"Accept": "text/html,*/*"}
    for headers, is_asked in (
        ({}, False),
        (page | {"Sec-Fetch-Site": "none"}, False),
        (page | {"Sec-Fetch-Site": "cross-site"}, True),
        (page | {"Sec-Fetch-Site": "same-site"}, True),
        (page, True),  # over plain HTTP
    ):
        with shared.anonymous() as browser:
            answer = browser.get("/login", params={"token": TOKEN}, headers=headers)
        assert ("Set-Cookie" in answer.headers) is not is_asked, headers
        assert answer.status_code == (200 if is_asked else 303)


def test_a_log_in_on_a_full_disk_says_so(tmp_path: Path) -> None:
    with (
        small_disk(tmp_path / "disk") as disk,
        serving(disk.place / "data") as client,
        client.anonymous() as browser,
    ):
        disk.fill()
        for answer in (
            browser.get("/login", params={"token": TOKEN}),
            browser.post("/api/login", json={"token": TOKEN}),
        ):
            assert "disk" in assert_error(answer, 507, "disk_full")
        disk.make_room()
        assert browser.post("/api/login", json={"token": TOKEN}).status_code == 204
