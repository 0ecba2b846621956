"""Ten thousand films: paged, searched, selected over all pages; a viewer only looks."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
from looks import expect_no_fault
from many_films import FILMS, LONG_NAME, TRACKED, fill, name_of
from playwright.sync_api import Page, expect
from steps import Server, log_in

PAGE = 50
MOST_ELEMENTS = 3000


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    data = tmp_path_factory.mktemp("data")
    fill(data)
    with Server(data) as running:
        yield running


def test_ten_thousand_films_are_paged_searched_and_selected_as_a_whole(
    page: Page, server: Server
) -> None:
    log_in(page, server, "/films?sort=name")
    rows = page.locator("tbody tr")
    expect(rows).to_have_count(PAGE)
    expect(page.get_by_text(f"1–50 of {FILMS:,}")).to_be_visible()
    for last in (100, 150):
        page.keyboard.press("n")
        expect(page.get_by_text(f"{last - 49}–{last} of {FILMS:,}")).to_be_visible()
        expect(rows).to_have_count(PAGE)
    assert page.evaluate("document.querySelectorAll('*').length") < MOST_ELEMENTS
    page.reload()  # the address has the page
    expect(rows.first).to_contain_text(name_of(100))
    page.get_by_role("button", name="Last page").click()
    expect(rows.last).to_contain_text(name_of(FILMS - 1))

    page.keyboard.press("/")
    page.keyboard.type("Contract")
    expect(page.get_by_text(f"1–50 of {FILMS // 100}")).to_be_visible()
    expect(rows.first).to_contain_text(LONG_NAME)
    page.get_by_role("button", name=f"Select all {FILMS // 100} that fit").click()
    page.get_by_role("button", name="Change…").click()
    page.get_by_role("dialog").get_by_label("Priority").fill("3")
    page.get_by_role("dialog").get_by_role("button", name="Change").click()
    expect(rows.first.locator(".table__priority")).to_have_text("3")
    films = json.load(server.ask("GET", "/api/archive/films?sort=priority&descending=true"))
    assert [film["priority"] for film in films["films"]] == [3] * 100


def test_the_list_of_inspections_has_pages_that_the_address_keeps(
    page: Page, server: Server
) -> None:
    log_in(page, server, "/inspections")
    rows = page.locator(".inspection")
    expect(rows).to_have_count(PAGE)
    page.get_by_role("button", name="Last page").click()
    expect(page.get_by_text(f"101–{TRACKED} of {TRACKED}")).to_be_visible()
    rows.last.get_by_role("link").click()
    page.wait_for_url("**/inspections/*")
    page.go_back()
    expect(page.get_by_text(f"101–{TRACKED} of {TRACKED}")).to_be_visible()
    page.get_by_role("searchbox").fill("contract")
    expect(rows).to_have_count(2)


def test_a_viewer_sees_the_archive_and_changes_nothing(page: Page, server: Server) -> None:
    refused: list[str] = []
    page.on("response", lambda answer: answer.status == 403 and refused.append(answer.url))
    log_in(page, server, "/films?search=CUL-0010", server.make_token("visitor", "viewer"))
    expect(page.locator("tbody tr")).to_have_count(10)
    for name in ("Start", "Change…", "Take off the list", "Add films"):
        expect(page.get_by_role("button", name=name)).to_have_count(0)
    expect(page.get_by_role("checkbox")).to_have_count(0)
    expect_no_fault(page, ("dark",))
    for path in ("/films/rules", "/films/failures", "/films/add"):
        page.goto(server.url + path)
        expect(page.locator("main")).to_be_visible()
        expect(page.locator("main button:visible")).to_have_count(0)
    assert refused == []
