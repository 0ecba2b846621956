"""Every door of the server: what is shut, for whom it opens, and from where nobody may knock."""

from __future__ import annotations

import contextlib
import os
import re
import ssl
from itertools import product
from pathlib import Path
from typing import NamedTuple

import httpx
import pytest
from builders import PATIENCE_S, TOKEN, Client, LiveServer, assert_error
from doors import ask as asked
from doors import bearer, example, log_in, refusal, routes_of
from fastapi import FastAPI, WebSocket
from forks import Fork
from receivers import certificate
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from app.access.access import create_token
from app.main import create_app
from app.settings import Settings
from app.storage.folder.tokens import Role, TokenFile
from app.web.routers.server.pages import static_folder

PUBLIC = {
    ("GET", "/healthz"),
    ("GET", "/readyz"),
    ("GET", "/login"),
    ("POST", "/api/login"),
    ("GET", "/favicon.ico"),
    # the secret in the address admits
    ("GET", "/accept/{secret}/"),
    ("GET", "/accept/{secret}/{place}"),
    ("POST", "/accept/{secret}/{place}"),
    ("GET", "/accept/{secret}/{place}/report.pdf"),
}
PUBLIC_FILES = {
    "icon.svg",
    "login.css",
    "login.js",
    "css/tokens.css",
    "css/base.css",
    "core/server/api.js",
    "core/page/store.js",
    "core/page/html.js",
    "core/page/preferences.js",
    "core/page/remembered.js",
    "core/page/rights.js",
    "core/page/words.js",
    "components/shared/insecure-banner/insecure-banner.js",
    *(f"words/{path.name}" for path in (static_folder() / "words").iterdir()),
}
"""What the log-in page is made of."""

INSPECTION = "/api/inspections/{inspection_id}"
FOR_VIEWERS = {
    ("POST", "/api/logout"),
    ("PUT", "/api/me/preferences"),
    ("POST", f"{INSPECTION}/corrections/preview"),
    ("POST", f"{INSPECTION}/measure"),
    ("POST", "/api/bulk-exports"),
    ("DELETE", "/api/bulk-exports/{order_id}"),
}
"""They change nothing of an inspection."""
FOR_ADMINS = {
    ("DELETE", INSPECTION),
    ("POST", "/api/packs"),
    ("POST", "/api/packs/preview"),
    ("DELETE", "/api/packs/{pack_id}"),
    ("POST", "/api/detectors"),
    ("DELETE", "/api/detectors/{detector_id}"),
    ("POST", "/api/archive/films"),
    ("POST", "/api/archive/films/preview"),
    ("GET", "/api/archive/folders"),
    ("PUT", "/api/intended-use"),
    ("GET", "/api/tokens"),
    ("POST", "/api/tokens"),
    ("PUT", "/api/tokens/{name}/role"),
    ("DELETE", "/api/tokens/{name}"),
}
ROLES = ("viewer", "operator", "admin")
STARTS_WORK = ("POST", "/api/samples")


class Door(NamedTuple):
    method: str
    """WS for a web socket."""
    path: str

    @property
    def url(self) -> str:
        return re.sub(r"{(\w+)(:\w+)?}", lambda m: example(m[1]), self.path)

    @property
    def role(self) -> str:
        """The least that opens it."""
        if self in FOR_ADMINS:
            return "admin"
        reads = self.method in ("GET", "HEAD", "WS") and not self.path.startswith("/api/uploads")
        return "viewer" if reads or self in FOR_VIEWERS else "operator"


def doors_of(app: FastAPI) -> list[Door]:
    """All that the server answers to, in the schema or not; files apart."""
    return [Door(method, path) for method, path, _ in routes_of(app.routes)]


def make_token(data: Path, name: str, role: str) -> str:
    """As the command does, while the server runs."""
    return create_token(TokenFile(data), name, Role(role))


@pytest.fixture(scope="module")
def tokens(shared: Client) -> dict[str, str]:
    """One of each role, and a revoked one."""
    made = {role: make_token(shared.data, f"a {role}", role) for role in ROLES}
    made["revoked"] = make_token(shared.data, "gone", "admin")
    TokenFile(shared.data).revoke("gone")
    return made


def session(client: Client, cookie: str) -> dict[str, str]:
    return {"Cookie": f"{client.cookie_name}={cookie}"}


def ask(client: Client, door: Door, headers: dict[str, str], query: str = "") -> httpx.Response:
    """As a program does; a web socket by the HTTP request that would open it."""
    return asked(client, door.method, door.url + query, headers)


def assert_shut(answer: httpx.Response, door: Door) -> None:
    if door.method == "HEAD":  # it has no body
        assert answer.status_code == 401, door
    else:
        assert_error(answer, 401, "unauthenticated")
    assert "frame-ancestors 'none'" in answer.headers["Content-Security-Policy"], door
    assert answer.headers["X-Content-Type-Options"] == "nosniff"


def test_every_door_is_shut_without_a_valid_token_or_session(
    shared: Client, tokens: dict[str, str], is_long: bool
) -> None:
    doors = doors_of(shared.server.app)
    schema = shared.get("/api/openapi.json").json()["paths"]
    in_schema = {(method.upper(), path) for path, methods in schema.items() for method in methods}
    assert in_schema <= set(doors)
    assert set(doors) >= PUBLIC
    assert {"WS", "OPTIONS", "DELETE"} <= {door.method for door in doors}
    browser = log_in(shared, tokens["viewer"])
    ended = browser.cookies[browser.cookie_name]
    browser.post("/api/logout")
    stranger = shared.anonymous()
    wrong: list[tuple[dict[str, str], str]] = [
        ({}, ""),
        ({}, f"?token={TOKEN}&access_token={TOKEN}"),
        ({}, "?websocket=ws://evil.example/"),
        (bearer("wrong"), ""),
        (bearer(tokens["revoked"]), ""),
        ({"Authorization": f"Basic {TOKEN}"}, ""),
        (session(shared, ended), ""),
        (session(shared, TOKEN), ""),
        (session(shared, "%00"), f"?session={TOKEN}"),
    ]
    for number, door in enumerate(sorted(set(doors) - PUBLIC)):
        tried = wrong if is_long else (wrong[0], wrong[1 + number % (len(wrong) - 1)])
        for headers, query in tried:
            assert_shut(ask(stranger, door, dict(headers), query), door)


def test_of_the_files_only_those_of_the_log_in_page_are_public(shared: Client) -> None:
    folder = static_folder()
    files = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    stranger = shared.anonymous()
    public = {name for name in files if stranger.head(f"/static/{name}").status_code != 401}
    assert public == PUBLIC_FILES
    for path in ("/static/css/../main.js", "/static//main.js", "//healthz/../api/me", "/docs"):
        assert stranger.get(path).status_code == 401, path


def test_every_door_opens_from_its_role_on(
    shared: Client, tokens: dict[str, str], is_long: bool
) -> None:
    for door in set(doors_of(shared.server.app)) - PUBLIC:
        if "{ticket}" in door.path:
            continue  # no token opens it
        least = ROLES.index(door.role)
        for role in ROLES if is_long else ROLES[max(0, least - 1) : least + 1]:
            is_enough = ROLES.index(role) >= least
            if is_enough and door == STARTS_WORK:
                continue
            answer = ask(shared, door, bearer(tokens[role]))
            assert answer.status_code not in (401, 500), (door, role)
            assert (answer.status_code != 403) is is_enough, (door, role)
            if not is_enough and door.method != "HEAD":
                assert door.role in assert_error(answer, 403, "forbidden")


def test_a_door_that_declares_no_role_is_for_an_admin(tmp_path: Path) -> None:
    app = create_app(Settings(data=tmp_path, token=TOKEN))

    @app.get("/api/new")
    def new() -> str:
        return "opened"

    @app.websocket("/api/new")
    async def new_socket(socket: WebSocket) -> None:
        await socket.accept()

    operator = make_token(tmp_path, "crew", "operator")
    server = LiveServer(app)
    try:
        with Client(server, operator) as client:
            assert_error(client.get("/api/new"), 403, "forbidden")
            url = f"{server.websocket_url}/api/new"
            assert refusal(url, server.url, bearer(operator)) == 403
            assert client.get("/api/new", headers=bearer(TOKEN)).json() == "opened"
    finally:
        server.stop()


def test_a_host_that_makes_no_sense_is_refused(shared: Client) -> None:
    for host in ("[", "[::1", "a b"):
        assert_error(shared.get("/healthz", headers={"Host": host}), 400, "unknown_host")


def test_the_3d_page_connects_to_this_server_only_and_is_framed_by_it_only(
    shared: Client, done: str
) -> None:
    answer = shared.get(shared.view_path(done))
    policy = dict(
        part.split(" ", 1) for part in answer.headers["Content-Security-Policy"].split("; ")
    )
    assert policy["sandbox"] == "allow-scripts"
    assert policy["connect-src"] == "'self' blob:"
    assert policy["frame-ancestors"] == "'self'"
    assert "'unsafe-eval'" not in policy["script-src"]
    assert "'unsafe-inline'" not in policy["script-src"]


def test_the_3d_page_takes_no_orders_from_its_address(shared: Client, done: str) -> None:
    orders = (
        "websocket=wss://evil.example/", "playbackPath=data:,x", "playbackPath", "fixedDpr=-1",
        "fixedDpr=0.5&initialCameraPosition=1,1,1",
    )  # fmt: skip
    for path, order in product((f"/viewer/{done}/", shared.view_path(done)), orders):
        assert_error(shared.get(f"{path}?{order}"), 422, "invalid_request")
    door = shared.get(f"/viewer/{done}/?fixedDpr=0.5")
    assert door.headers["Location"].endswith("/?fixedDpr=0.5")
    assert shared.get(door.headers["Location"]).status_code == 200


def test_a_token_in_the_wrong_address_or_too_long_is_not_repeated(shared: Client) -> None:
    stranger = shared.anonymous()
    answer = stranger.get("/", params={"token": TOKEN}, headers={"Accept": "text/html"})
    assert answer.headers["Location"] == "/login?next=/"
    long = 20 * TOKEN
    for answer in (
        stranger.get("/login", params={"token": long}),
        stranger.post("/api/login", json={"token": long}),
        stranger.post("/api/login", json={"token": [TOKEN]}),
    ):
        assert TOKEN not in assert_error(answer, 422, "invalid_request")


def end_of(socket: ClientConnection) -> int:
    """The code with which the server closes it, within seconds."""
    try:
        while True:
            socket.recv(PATIENCE_S)
    except ConnectionClosed as closed:
        return closed.rcvd.code if closed.rcvd else 0


def open_socket(client: Client, path: str) -> ClientConnection:
    return connect(
        client.server.websocket_url + path,
        origin=client.server.url,
        additional_headers=session(client, client.cookies[client.cookie_name]),
        max_size=None,
        open_timeout=PATIENCE_S,
    )


def test_a_revoked_token_and_an_ended_session_end_their_sockets(shared: Client, done: str) -> None:
    token = make_token(shared.data, "guest", "viewer")
    browsers = [log_in(shared, token) for _ in range(2)]
    live = f"/api/inspections/{done}/live"
    with contextlib.ExitStack() as stack:
        ours, others = (
            [
                stack.enter_context(open_socket(browser, live)),
                stack.enter_context(browser.view(done)),
            ]
            for browser in browsers
        )
        assert browsers[0].post("/api/logout").status_code == 204
        assert [end_of(socket) for socket in ours] == [4401, 4401]
        assert browsers[1].get("/api/me").json()["name"] == "guest"
        TokenFile(shared.data).revoke("guest")
        assert_error(browsers[1].get("/api/me"), 401, "unauthenticated")
        assert_error(shared.get("/api/me", headers=bearer(token)), 401, "unauthenticated")
        assert [end_of(socket) for socket in others] == [4401, 4401]


def test_guessed_bearer_tokens_are_slowed_down_and_shut_nobody_out(server: Client) -> None:
    stranger = server.anonymous()
    assert server.get("/api/me").status_code == 200
    for _ in range(30):  # a program whose token was revoked guesses nothing
        assert stranger.get("/api/me", headers=bearer("revoked")).status_code == 401
    for n in range(9):
        assert stranger.get("/api/me", headers=bearer(f"guess {n}")).status_code == 401
    answer = stranger.get("/api/me", headers=bearer("one more"))
    assert_error(answer, 429, "too_many_attempts")
    assert server.get("/api/me").status_code == 200
    late = make_token(server.data, "late", "viewer")
    assert stranger.get("/api/me", headers=bearer(late)).status_code == 200
    log_in(server)


def test_over_https_the_printed_address_logs_in_and_no_secret_is_shown(tmp_path: Path) -> None:
    cert, key = certificate(tmp_path)
    log = tmp_path / "log"
    process = Fork(
        ["serve", "--port", "0", "--data", str(tmp_path / "data"),
         "--tls-cert", str(cert), "--tls-key", str(key)],
        os.environ, log,
    )  # fmt: skip
    try:
        printed = process.stdout.readline()
        origin = printed.removeprefix("Open ").partition("/login ")[0]
        token = (tmp_path / "data" / "token").read_text()
        assert printed.endswith(f"{tmp_path / 'data' / 'token'}\n")
        assert token not in printed
        assert origin.startswith("https://127.0.0.1:")
        trusted = ssl.create_default_context(cafile=str(cert))
        with httpx.Client(base_url=origin, verify=trusted, timeout=PATIENCE_S) as browser:
            answers = [browser.get(f"{origin}/login?token={token}")]
            flags = answers[0].headers["Set-Cookie"]
            assert re.search("^__Host-.*HttpOnly.*Path=/;.*SameSite=strict; Secure$", flags)
            assert browser.get("/api/me").json()["role"] == "admin"
            name = f"chainage_session_{browser.base_url.port}"
            cookie = browser.cookies[f"__Host-{name}"]
            headers = {"Cookie": f"{name}={cookie}"}  # without its prefix it is not ours
            answers += [
                httpx.get(f"{origin}/api/me", headers=headers, verify=trusted, timeout=PATIENCE_S),
                browser.get("/"),
                browser.get("/api/inspections/x"),
                browser.put("/api/me/preferences", content=b"{", headers={"Origin": origin}),
                browser.post(
                    "/api/login", json={"token": token, "x": 1}, headers={"Origin": origin}
                ),
            ]
            assert [answer.status_code for answer in answers] == [303, 401, 200, 422, 422, 422]
            assert all("Strict-Transport-Security" in answer.headers for answer in answers)
            url = f"{origin.replace('https', 'wss')}/api/inspections/{'0' * 32}/live"
            cookies = {"Cookie": f"__Host-{name}={cookie}"}
            with connect(
                url, origin=origin, additional_headers=cookies, ssl=trusted, open_timeout=PATIENCE_S
            ) as socket:
                assert "inspection_not_found" in str(socket.recv(PATIENCE_S))
            for n in range(11):  # what a proxy says of the address is not believed
                forwarded = {"X-Forwarded-For": f"10.0.0.{n}", "Origin": origin}
                last = browser.post("/api/login", json={"token": f"{n}"}, headers=forwarded)
            assert_error(last, 429, "too_many_attempts")
    finally:
        process.terminate(PATIENCE_S)
        process.end()
    written = log.read_text() + "".join(
        f"{answer.headers.get('Location')} {answer.text}" for answer in answers
    )
    assert "POST" in log.read_text()
    assert token not in written
    assert cookie not in written
