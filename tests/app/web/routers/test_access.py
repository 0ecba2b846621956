import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import httpx
import loops
import pytest
from builders import PATIENCE_S, TOKEN, Client, assert_error, serving
from doors import log_in, refusal

from app.reports.content.words import LANGUAGES
from app.web.routers.server.pages import version_of


def test_a_wrong_token_is_as_good_as_none(shared: Client) -> None:
    for header in ("Bearer wrong", "Basic abc", "Bearer"):
        answer = shared.anonymous().get("/api/session", headers={"Authorization": header})
        assert_error(answer, 401, "unauthenticated")
        assert answer.headers["WWW-Authenticate"] == "Bearer"


def test_pages_lead_a_stranger_to_the_log_in_and_back(shared: Client) -> None:
    answer = shared.anonymous().get("/inspections/12", headers={"Accept": "text/html"})
    assert answer.status_code == 303
    assert answer.headers["Location"] == "/login?next=/inspections/12"
    assert shared.anonymous().get(answer.headers["Location"]).status_code == 200


def test_the_log_in_page_and_all_that_it_loads_are_public(shared: Client) -> None:
    stranger = shared.anonymous()
    page = stranger.get("/login").text
    scripts = stranger.get("/static/login.js").text
    paths = re.findall(r'(?:href|src)="(/static/[^"]+)"', page)
    paths += [f"/static/{name}" for name in re.findall(r"from '\./([^']+)'", scripts)]
    assert len(paths) >= 4
    for path in paths:
        assert stranger.get(path).status_code == 200, path


def test_the_files_of_a_page_are_kept_until_one_of_them_changes(
    shared: Client, tmp_path: Path
) -> None:
    (named,) = re.findall(r'src="(/static/[^"]+/page.js)"', shared.get("/").text)
    kept, asked = shared.get(named), shared.get("/static/page.js")
    assert kept.text == asked.text
    assert "immutable" in kept.headers["Cache-Control"]
    assert asked.headers["Cache-Control"] == "no-cache"
    of_another_version = shared.get(f"/static/v{'0' * 16}/page.js")  # its shell is older
    assert of_another_version.headers["Cache-Control"] == "no-cache"
    tag = asked.headers["ETag"]
    assert tag.startswith('"')  # a strong one: the very bytes
    assert shared.get("/static/page.js", headers={"If-None-Match": tag}).status_code == 304
    (tmp_path / "a.js").write_text("1")
    before = version_of(tmp_path)
    (tmp_path / "a.js").write_text("12")
    assert version_of(tmp_path) != before


def test_a_page_names_two_files_that_hold_all_its_modules_and_style_sheets(shared: Client) -> None:
    named = re.findall(r'(?:href|src)="(/static/[^"]+)"', shared.get("/").text)
    kinds = {path: shared.get(path).headers["Content-Type"] for path in named}
    assert [kind.partition(";")[0] for kind in kinds.values()] == [
        "image/svg+xml",
        "application/manifest+json",
        "text/javascript",
        "text/css",
        *["application/json"] * len(LANGUAGES),
    ]
    script = shared.get(named[2]).text
    assert len(set(re.findall(r"^// ([\w./-]+\.js)$", script, re.MULTILINE))) > 100


def test_a_token_is_exchanged_for_a_session_that_log_out_ends(shared: Client) -> None:
    browser = log_in(shared)
    assert browser.get("/api/session").json() == {"name": "server", "role": "admin"}
    assert '<html data-role="admin" data-person="server"' in browser.get("/").text
    cookie = browser.cookies[browser.cookie_name]
    ended = browser.post("/api/logout")
    assert (ended.status_code, ended.headers["Clear-Site-Data"]) == (204, '"cache"')
    stolen = {"Cookie": f"{shared.cookie_name}={cookie}"}
    assert shared.anonymous().get("/api/session", headers=stolen).status_code == 401


def test_the_cookie_is_out_of_reach_for_scripts_and_other_sites(shared: Client) -> None:
    answer = shared.anonymous().post("/api/login", json={"token": TOKEN})
    flags = answer.headers["Set-Cookie"].lower()
    assert "httponly" in flags
    assert "samesite=strict" in flags
    assert TOKEN not in flags


def test_the_printed_address_logs_in_and_leaves_no_token_behind(shared: Client) -> None:
    browser = shared.anonymous()
    answer = browser.get("/login", params={"token": TOKEN})
    assert answer.status_code == 303
    assert answer.headers["Location"] == "/"
    assert browser.get("/api/session").status_code == 200
    assert_error(shared.anonymous().get("/login?token=wrong"), 401, "unauthenticated")


@pytest.mark.parametrize(
    ("wanted", "reached"),
    [
        ("/new", "/new"),
        (f"/inspections/{'a' * 32}", f"/inspections/{'a' * 32}"),
        ("//evil.example", "/"),
        ("https://evil.example/new", "/"),
        ("/\\evil.example", "/"),
    ],
)
def test_a_log_in_leads_to_our_pages_only(shared: Client, wanted: str, reached: str) -> None:
    answer = shared.anonymous().get("/login", params={"token": TOKEN, "next": wanted})
    assert answer.headers["Location"] == reached


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {},
    ],
)
def test_a_page_of_another_site_cannot_use_the_session(
    shared: Client, headers: dict[str, str]
) -> None:
    browser = log_in(shared)
    del browser.headers["Origin"]
    answer = browser.post("/api/logout", headers=headers)
    assert_error(answer, 403, "cross_origin")
    assert browser.get("/api/session").status_code == 200


def test_a_page_of_another_site_cannot_log_a_browser_in(shared: Client) -> None:
    answer = shared.anonymous().post(
        "/api/login", json={"token": TOKEN}, headers={"Origin": "http://evil.example"}
    )
    assert_error(answer, 403, "cross_origin")


def test_a_rebound_name_is_refused_and_an_address_is_not(shared: Client) -> None:
    for host in ("evil.example", "evil.example:8000", "", "localhost.evil.example"):
        assert_error(shared.get("/healthz", headers={"Host": host}), 400, "unknown_host")
    for host in ("localhost:1", "192.168.1.4", "[::1]:8000", "127.0.0.1"):
        assert shared.get("/healthz", headers={"Host": host}).status_code == 200


def test_an_operator_may_add_a_name(tmp_path: Path) -> None:
    with serving(tmp_path, allowed_hosts="crew.example, other.example") as client:
        assert client.get("/healthz", headers={"Host": "crew.example"}).status_code == 200


def test_guessing_tokens_is_slowed_down_and_shuts_nobody_out(server: Client) -> None:
    stranger = server.anonymous()
    for _ in range(10):
        assert_error(stranger.post("/api/login", json={"token": "x"}), 401, "unauthenticated")
    for guess in ("x", "y" * 43):
        answer = stranger.post("/api/login", json={"token": guess})
        assert_error(answer, 429, "too_many_attempts")
        assert answer.headers["Retry-After"]
    log_in(server)  # from the same address
    assert server.get("/api/session").status_code == 200, "who is in stays in"


@pytest.mark.parametrize("path", ["/", "/nowhere", "/api/session", "/static/main.js", "/login"])
def test_every_answer_carries_the_security_headers(shared: Client, path: str) -> None:
    headers = shared.get(path).headers
    assert "script-src 'self';" in headers["Content-Security-Policy"]
    assert "unsafe" not in headers["Content-Security-Policy"]
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Referrer-Policy"] == "no-referrer"


@pytest.fixture(scope="module")
def lan(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A server that other machines reach without TLS."""
    with serving(tmp_path_factory.mktemp("lan"), insecure_lan=True) as client:
        yield client


def test_behind_a_proxy_that_speaks_tls_no_page_warns_and_browsers_stay_with_tls(
    lan: Client,
) -> None:

    async def through_tls(path: str) -> httpx.Response:
        """With the scheme that uvicorn takes from a trusted proxy."""
        transport = httpx.ASGITransport(lan.server.app)
        async with httpx.AsyncClient(transport=transport, base_url="https://localhost") as browser:
            return await browser.get(path, headers={"Authorization": f"Bearer {TOKEN}"})

    for path in ("/", "/login"):
        plain, encrypted = lan.get(path), loops.run(partial(through_tls, path))
        assert [answer.status_code for answer in (plain, encrypted)] == [200, 200]
        assert 'data-insecure="yes"' in plain.text
        assert "data-insecure" not in encrypted.text
        assert "Strict-Transport-Security" not in plain.headers
        assert "max-age=" in encrypted.headers["Strict-Transport-Security"]


def test_two_servers_on_one_host_do_not_log_each_other_out(shared: Client, lan: Client) -> None:
    """A browser sends the cookies of a host to all its ports."""
    cookies: dict[str, str] = {}
    for server in (shared, lan):
        cookies |= log_in(server).cookies
    both = {"Cookie": "; ".join(f"{name}={value}" for name, value in cookies.items())}
    for server in (shared, lan):
        assert server.anonymous().get("/api/me", headers=both).status_code == 200


def test_sockets_are_refused_before_they_open(shared: Client, done: str) -> None:
    url = f"{shared.server.websocket_url}/api/inspections/{done}/live"
    cookie = log_in(shared).cookies[shared.cookie_name]
    origin = shared.server.url
    assert refusal(url, origin, {}) == 401
    assert refusal(url, origin, {"Cookie": f"{shared.cookie_name}=wrong"}) == 401
    assert refusal(url, "http://evil.example", {"Cookie": f"{shared.cookie_name}={cookie}"}) == 403
    assert refusal(url, None, {"Cookie": f"{shared.cookie_name}={cookie}"}) == 403
    secure = origin.replace("http:", "https:")
    assert refusal(url, secure, {"Cookie": f"{shared.cookie_name}={cookie}"}) == 403


def test_a_ticket_opens_one_3d_view_and_nothing_else(shared: Client, done: str) -> None:
    browser = log_in(shared)
    cookie = {"Cookie": f"{shared.cookie_name}={browser.cookies[browser.cookie_name]}"}
    path = browser.view_path(done)
    ticket = path.split("/")[3]
    stranger = shared.anonymous()
    assert stranger.get(path).status_code == 200
    with browser.view(done) as view:
        assert len(view.recv(PATIENCE_S)) > 100
    credential, _, signature = ticket.partition(".")
    for wrong in (
        f"/viewer/{'0' * 32}/{ticket}",
        f"/viewer/{done}/{credential}.{'0' * 64}",
        f"/viewer/{done}/{'0' * 64}.{signature}",
    ):
        assert_error(stranger.get(f"{wrong}/", headers=cookie), 401, "unauthenticated")
        assert refusal(shared.server.websocket_url + wrong, shared.server.url, cookie) == 401
    for headers in (
        {"Authorization": f"Bearer {ticket}"},
        {"Authorization": f"Bearer {credential}"},
        {"Cookie": f"{shared.cookie_name}={credential}"},
    ):
        assert_error(stranger.get("/api/session", headers=headers), 401, "unauthenticated")
