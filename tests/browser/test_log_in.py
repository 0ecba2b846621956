"""Nothing is shown before the log-in, and afterwards the page that was asked for."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page, expect
from shares import first_of
from steps import TOKEN, Server, log_in


@pytest.mark.parametrize("path", ["/", "/new"])
def test_log_in_leads_to_the_page_that_was_asked_for(page: Page, server: Server, path: str) -> None:
    page.goto(server.url + path)
    page.get_by_label("Access token").fill(TOKEN)
    page.get_by_role("button", name="Log in").click()
    page.wait_for_url(server.url + path)
    expect(page.get_by_role("heading", level=1)).to_be_visible()


def test_a_wrong_token_is_refused_in_plain_words(page: Page, server: Server) -> None:
    page.goto(server.url)
    page.get_by_label("Access token").fill("wrong")
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("alert")).to_contain_text("This token is not known here")
    expect(page.get_by_label("Access token")).to_be_focused()


def test_a_log_out_ends_the_session(page: Page, server: Server) -> None:
    log_in(page, server)
    page.get_by_label("Menu").click()
    page.get_by_role("button", name="Log out").click()
    expect(page.get_by_label("Access token")).to_be_visible()
    page.goto(server.url)
    expect(page.get_by_label("Access token")).to_be_visible()


@pytest.mark.parametrize(
    "foreign",
    first_of(
        2,
        [
            "/\\example.org/",
            f"/viewer/{'0' * 32}/?playbackPath=data:,x",
            "https://example.org/",
            "//example.org/",
            "/api/session",
        ],
    ),
)
def test_log_in_leads_to_our_pages_only(page: Page, server: Server, foreign: str) -> None:
    page.goto(server.url)
    page.evaluate(
        "next => history.replaceState(null, '', `/login?next=${encodeURIComponent(next)}`)", foreign
    )
    page.get_by_label("Access token").fill(TOKEN)
    page.get_by_role("button", name="Log in").click()
    page.wait_for_url(lambda url: "/login" not in url)
    assert page.url == server.url + "/"


def test_a_link_asks_before_it_replaces_a_session(page: Page, server: Server) -> None:
    log_in(page, server)
    other = server.make_token("guest", "viewer")
    page.goto(f"{server.url}/login?token={other}&next=/new")
    expect(page.get_by_text("You are logged in as “server”")).to_be_visible()
    assert other not in page.url
    page.get_by_role("link", name="Stay logged in as “server”").click()
    page.wait_for_url(server.url + "/new")
    assert page.request.get(server.url + "/api/session").json()["name"] == "server"
    page.goto(f"{server.url}/login?token={other}&next=/archive/defects")
    page.get_by_role("button", name="Log in").click()
    page.wait_for_url(server.url + "/archive/defects")
    assert page.request.get(server.url + "/api/session").json()["name"] == "guest"
