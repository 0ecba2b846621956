"""The start page: what there is to do, and the way from a section to its film."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from looks import expect_no_fault
from mapped_assets import Inspected, Registered, fill
from playwright.sync_api import Page, expect
from steps import Server, log_in

from app.storage.database.database import FILE, Database

SECTIONS = [Registered(f"CV-{number}", project="Round 2026") for number in range(1, 4)]
INSPECTIONS = [
    Inspected("CV-2", "2019-05-02", (4,), "Round 2019"),
    Inspected("CV-3", "2026-05-02", (2,), "Round 2026"),
]


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    data = tmp_path_factory.mktemp("data")
    database = Database(data / FILE)
    fill(database, SECTIONS, INSPECTIONS)
    database.close()
    with Server(data) as running:
        running.ask(
            "PUT",
            "/api/register/assets/CV-1",
            {"project": "Round 2026", "header": {"material": "Concrete", "start_node": "MH1"}},
        )
        yield running


def test_an_inspection_of_a_section_begins_with_its_header_two_clicks_before_the_film(
    page: Page, server: Server
) -> None:
    log_in(page, server)
    rows = page.locator("tbody tr")
    expect(rows.locator(".chip")).to_have_text(["To do", "To do", "Recorded"])
    expect(rows.nth(1)).to_contain_text("May 2, 2019")
    expect(rows.nth(1)).to_contain_text("4 plan repair")
    expect_no_fault(page)

    page.get_by_role("button", name="Recorded 1").click()
    expect(rows).to_have_count(1)
    page.get_by_role("button", name="All 3").click()
    page.get_by_role("link", name="Start inspection of CV-1").click()
    with page.expect_file_chooser():
        page.get_by_role("button", name="Choose films").click()
    expect(page.get_by_role("textbox", name="Asset", exact=True)).to_have_value("CV-1")
    expect(page.get_by_role("textbox", name="Start node")).to_have_value("MH1")
    expect(page.get_by_label("Name", exact=True)).to_have_value("CV-1")


def test_the_sections_are_a_key_away_and_the_desk_has_them_in_its_menu(
    page: Page, server: Server
) -> None:
    log_in(page, server)
    for name, title in (("Assets", "Assets"), ("Find", "Defects"), ("Films", "Films")):
        page.get_by_role("navigation", name="Sections").get_by_role("link", name=name).press(
            "Enter"
        )
        expect(page.get_by_role("heading", name=title, level=1)).to_be_visible()
    page.goto(f"{server.url}/inspections/{1:032x}")
    page.get_by_label("Menu").click()
    page.get_by_role("link", name="Work").last.click()
    expect(page.get_by_role("heading", name="Work", level=1)).to_be_visible()


def test_a_project_is_made_on_the_page_and_deleted_while_it_is_empty(
    page: Page, server: Server
) -> None:
    log_in(page, server, "/assets/projects")
    page.get_by_role("button", name="New project").click()
    page.get_by_label("Name").fill("Round 2027")
    page.get_by_role("button", name="Make it").click()
    expect(page.get_by_role("heading", name="Round 2027", level=1)).to_be_visible()
    expect_no_fault(page, ("dark",))
    page.get_by_role("button", name="Delete").click()
    expect(page.get_by_role("link", name="Round 2026")).to_be_visible()
    expect(page.get_by_role("link", name="Round 2027")).to_have_count(0)


def test_orders_of_a_table_are_shown_with_their_day_and_end(page: Page, server: Server) -> None:
    table = "Order;Asset;Reason;Due\nWO-7;CV-3;=Flood;01.02.2020\nWO-8;CV-1;;2099-12-31\nX;CV-9;;\n"
    log_in(page, server)
    rows = page.locator("tbody tr")
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import work orders").click()
    chooser.value.set_files(
        {"name": "orders.csv", "mimeType": "text/csv", "buffer": table.encode()}
    )
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("Not in the register")
    expect_no_fault(page, within="dialog[open]")
    dialog.get_by_role("button", name="Import 2 orders").click()
    page.get_by_role("button", name="Overdue", exact=True).click()
    expect(rows).to_have_count(1)
    expect(rows.first).to_contain_text("overdue since")
    expect(rows.first).to_contain_text("=Flood")
    expect(rows.first.locator(".chip").first).to_have_text("To do")  # inspected before the order
    expect_no_fault(page)
    start = page.get_by_role("link", name="Start inspection of CV-3")
    assert "order=WO-7" in (start.get_attribute("href") or "")
    page.get_by_role("button", name="End order WO-7").click()
    page.get_by_role("button", name="Cancel order").click()
    expect(page.get_by_text("No section fits.")).to_be_visible()
