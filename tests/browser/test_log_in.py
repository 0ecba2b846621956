"""Nothing is shown before the log-in, and afterwards the page that was asked for."""

from __future__ import annotations

from playwright.sync_api import Page, expect
from steps import TOKEN, Server, log_in

FOREIGN = ["/\\example.org/", f"/viewer/{'0' * 32}/?playbackPath=data:,x", "//example.org/"]
"""Addresses to which a log-in must not lead."""


def enter(page: Page, token: str) -> None:
    page.get_by_label("Access code").fill(token)
    page.get_by_role("button", name="Log in").click()


def test_a_log_in_leads_to_the_page_that_was_asked_for_and_a_log_out_ends_it(
    page: Page, server: Server
) -> None:
    page.goto(f"{server.url}/new")
    enter(page, "wrong")
    expect(page.get_by_role("alert")).to_contain_text("This access code is not known here")
    expect(page.get_by_label("Access code")).to_be_focused()
    enter(page, TOKEN)
    page.wait_for_url(f"{server.url}/new")
    expect(page.get_by_role("heading", level=1)).to_be_visible()
    page.get_by_label("Menu").click()
    page.get_by_role("button", name="Log out").click()
    expect(page.get_by_label("Access code")).to_be_visible()
    for foreign in FOREIGN:
        page.context.clear_cookies()
        page.goto(server.url)
        page.evaluate(
            "next => history.replaceState(null, '', `/login?next=${encodeURIComponent(next)}`)",
            foreign,
        )
        enter(page, TOKEN)
        page.wait_for_url(lambda url: "/login" not in url)
        assert page.url == server.url + "/", foreign


def test_a_link_asks_before_it_replaces_a_session(page: Page, server: Server) -> None:
    log_in(page, server)
    other = server.make_token("guest", "viewer")
    page.goto(f"{server.url}/login?token={other}&next=/new")
    expect(page.get_by_text("You are logged in as “server”")).to_be_visible()
    assert other not in page.url
    page.get_by_role("link", name="Stay logged in as “server”").click()
    page.wait_for_url(server.url + "/new")
    assert page.request.get(server.url + "/api/session").json()["name"] == "server"
    page.goto(f"{server.url}/login?token={other}&next=/find")
    page.get_by_role("button", name="Log in").click()
    page.wait_for_url(server.url + "/find")
    assert page.request.get(server.url + "/api/session").json()["name"] == "guest"
