"""Who may look only sees no more than that; a server without encryption says so on every page."""

from __future__ import annotations

import re
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest
from builders import TOKEN, serving
from desks import expect_frame, expect_saved, observations
from playwright.sync_api import Page, expect
from steps import Server, log_in
from surveys import Survey


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(server: Server, narrow: Survey) -> str:
    path = f"/api/inspections/{narrow.id}/observations/{uuid.uuid4()}"
    server.ask("PUT", path, {"frame": 5, "code": "BAB", "remark": "crack", "severity": 2})
    return narrow.id


@pytest.fixture(scope="module")
def viewer(server: Server) -> str:
    return server.make_token("visitor", "viewer")


@pytest.fixture(scope="module")
def operator(server: Server) -> str:
    return server.make_token("crew", "operator")


def test_a_viewer_looks_and_changes_nothing(
    page: Page, server: Server, inspection: str, viewer: str
) -> None:
    refused: list[str] = []
    page.on("response", lambda answer: answer.status == 403 and refused.append(answer.url))
    log_in(page, server, "/inspections", viewer)
    expect(page.get_by_text("You can look and export")).to_be_visible()
    expect(page.locator(".inspection").first).to_be_visible()
    expect(page.get_by_role("link", name="New inspection")).to_have_count(0)
    expect(page.locator(".inspection__actions button:visible")).to_have_count(0)
    page.locator(".inspection a").first.click()
    expect(page.locator(".transport__frame")).to_contain_text("0")
    for name in (re.compile("^T ?Tag"), "Undo", "Finish"):
        expect(page.get_by_role("button", name=name)).to_have_count(0)
    before = observations(server, inspection)
    for key in ("ArrowRight", "t", "1", "z", "n", "m", "Delete", "s"):
        page.keyboard.press(key)
    overlay = page.locator(".stage__overlay")
    box = overlay.bounding_box()
    assert box is not None
    overlay.click(position={"x": box["width"] / 2, "y": box["height"] / 4})
    expect(page.locator("toast-stack")).to_contain_text("You can look and export")
    page.keyboard.press("e")
    expect(page.locator("#defect-code")).to_be_disabled()
    for tab, field in (("Header", "header-form input"), ("Corrections", "zero-section button")):
        page.get_by_role("tab", name=tab).click()
        expect(page.locator(field).first).to_be_disabled()
    assert observations(server, inspection) == before
    assert refused == []


def test_an_operator_tags_and_what_waits_in_the_browser_outlives_the_visit_of_a_viewer(
    page: Page, server: Server, inspection: str, operator: str, viewer: str
) -> None:
    before = len(observations(server, inspection))
    desk = f"/inspections/{inspection}"
    log_in(page, server, desk, operator)
    expect(page.locator(".banner")).to_have_count(0)
    expect_frame(page, 0)
    # A block in the browser (a route, or being offline) ends while the page is being left, so that
    # the page could still send the tag in the operator's name.
    server.kill()
    page.keyboard.press("t")
    expect(page.locator(".save")).to_have_text("Waiting (1)")
    leave(page)
    server.start()
    with page.expect_response(lambda answer: answer.status == 403):
        log_in(page, server, desk, viewer)
    leave(page)
    log_in(page, server, desk, operator)
    expect_saved(page)
    assert [tag["created_by"] for tag in observations(server, inspection)[before:]] == ["crew"]
    page.goto(f"{server.url}/inspections")
    delete = page.get_by_role("button", name="Delete").first
    expect(delete).to_be_disabled()
    expect(delete).to_have_attribute("title", "Only an administrator may do that.")


def leave(page: Page) -> None:
    page.goto("about:blank")
    page.context.clear_cookies()


def test_a_server_without_encryption_says_so_in_red(page: Page, tmp_path: Path) -> None:
    with serving(tmp_path, insecure_lan=True) as client:
        page.goto(client.server.url)
        banner = page.get_by_role("alert").filter(has_text="Unencrypted")
        expect(banner).to_have_css("background-color", "rgb(179, 38, 30)")
        page.goto(f"{client.server.url}/login?token={TOKEN}")
        expect(page.get_by_role("heading", level=1)).to_be_visible()
        expect(banner).to_be_visible()
