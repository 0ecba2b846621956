"""The list of inspections: find one, rename it, delete it, or begin with a sample."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Iterator
from contextlib import closing

import pytest
from clip_surveys import ids_of
from looks import expect_no_fault
from playwright.sync_api import Page, Route, expect
from steps import Server, log_in
from surveys import Survey

NAMES = ("Jalan Ampang", "Sungai Besi", "Bukit Jalil")


@pytest.fixture(scope="module")
def server(several: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    data = several.copied_to(tmp_path_factory.mktemp("data"))
    with closing(sqlite3.connect(data / "chainage.db")) as database, database:
        database.execute(
            "UPDATE inspections SET tracked_with = '0.0.9+0'"
            " WHERE id = (SELECT min(id) FROM inspections)"
        )
    with Server(data) as running:
        yield running


@pytest.fixture
def inspections(server: Server) -> dict[str, str]:
    made = dict(zip(NAMES, ids_of(server), strict=True))
    for name, inspection in made.items():
        change = {"name": name, "header": {"client": f"Client of {name}"}}
        server.ask("PATCH", f"/api/inspections/{inspection}", change)
    return made


def test_an_inspection_is_found_labelled_selected_renamed_and_deleted(
    page: Page, server: Server, inspections: dict[str, str]
) -> None:
    log_in(page, server, "/inspections")
    rows = page.locator(".inspection")
    expect(rows).to_have_count(3)
    ways = [way.bounding_box() for way in page.locator(".content__ways .button").all()]
    assert len({way["y"] for way in ways if way}) == 1, ways
    search = page.get_by_role("searchbox")
    search.fill("jalan")
    expect(rows).to_have_count(1)
    expect(page.get_by_text("1 of 3")).to_be_visible()
    search.fill("client besi")
    expect(rows.get_by_role("link")).to_have_text(["Sungai Besi"])
    search.fill("nowhere")
    page.get_by_role("button", name="Show all").click()
    expect(rows).to_have_count(3)
    page.get_by_label("State").select_option("failed")
    expect(rows).to_have_count(0)
    page.get_by_label("State").select_option("")
    expect(rows).to_have_count(3)

    # What an older program tracked is tracked again together.
    page.get_by_role("button", name="Older version").click()
    expect(rows).to_have_count(1)
    page.get_by_label("Select this page").check()
    page.get_by_role("button", name="Track again").click()
    expect(page.get_by_text("1 inspection is tracked again.")).to_be_visible()
    expect(rows).to_have_count(0)
    page.get_by_role("button", name="Show all").click()
    expect(rows).to_have_count(3)

    # Labels, filters and a selection say which inspections are meant.
    page.get_by_role("button", name="Labels of Sungai Besi").click()
    for label in ("urgent", "invoiced"):
        page.keyboard.type(label)
        page.keyboard.press("Enter")
    page.keyboard.press("Backspace")
    expect_no_fault(page, ("dark",))
    page.keyboard.press("Enter")
    expect(rows.nth(1).get_by_role("button", name="urgent")).to_be_visible()
    expect(rows.get_by_text("invoiced")).to_have_count(0)
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_role("button", name="urgent")).to_have_count(0)

    page.get_by_role("button", name="Name", exact=True).click()
    expect(rows.get_by_role("link")).to_have_text(sorted(NAMES))
    page.get_by_label("Select Bukit Jalil").check()
    page.get_by_label("Select Jalan Ampang").click(modifiers=["Shift"])
    page.get_by_role("button", name="Export…").click()
    expect_one_archive_whatever_the_line_does(page)

    # a label that is new since the page was read
    labelled = f"/api/inspections/{inspections['Bukit Jalil']}/labels"
    server.ask("PUT", labelled, {"labels": ["late"]})
    page.get_by_role("button", name="late").click()
    expect(page.get_by_label("Label", exact=True)).to_have_value("late")
    expect(rows.get_by_role("link")).to_have_text(["Bukit Jalil"])
    page.get_by_role("searchbox").fill("Bukit")
    expect(page).to_have_url(re.compile("search=Bukit.*label=late"))
    expect(rows.get_by_role("link")).to_have_text(["Bukit Jalil"])
    page.get_by_role("searchbox").fill("")
    page.get_by_label("Label", exact=True).select_option("")
    expect(rows).to_have_count(3)
    page.get_by_label("Select this page").check()
    expect(page.get_by_text("3 inspections selected")).to_be_visible()
    expect_no_fault(page, ("light",))
    page.get_by_role("button", name="Select none").click()
    expect(page.get_by_role("button", name="Export…")).to_be_hidden()

    # A severity 5 is shown plainly.
    path = f"/api/inspections/{inspections['Jalan Ampang']}/observations"
    tag = f"{path}/7d444840-9dc0-4d2a-8a6a-000000000001"
    server.ask("PUT", tag, {"frame": 0, "code": "BAC", "severity": 5})
    row = page.locator(".inspection", has_text="Jalan Ampang")
    expect(row).to_contain_text("act now")

    # One is renamed.
    page.get_by_role("button", name="Rename Bukit Jalil").click()
    name = page.get_by_role("dialog").get_by_label("Name")
    name.fill("")
    name.press("Enter")
    expect(page.get_by_text("Needed: it is what the list shows.")).to_be_visible()
    name.fill("Bukit Bintang")
    name.press("Enter")
    expect(page.get_by_role("link", name="Bukit Bintang")).to_be_visible()

    # One is deleted only after a question that names it.
    delete = page.get_by_role("button", name="Delete Sungai Besi")
    delete.click()
    question = page.get_by_role("dialog", name="Delete “Sungai Besi”?")
    expect(question.get_by_role("button", name="Cancel")).to_be_focused()
    expect_no_fault(page, within="dialog[open]")
    page.keyboard.press("Escape")
    expect(page.get_by_role("link", name="Sungai Besi")).to_be_visible()
    delete.click()
    question.get_by_role("button", name="Delete for good").click()
    expect(page.get_by_role("link", name="Sungai Besi")).to_have_count(0)


def expect_one_archive_whatever_the_line_does(page: Page) -> None:
    """Makes an archive of two inspections over a broken line, and leaves it after a question."""
    requests: list[str] = []
    is_broken = True

    def answer(route: Route) -> None:
        requests.append(route.request.method)
        if route.request.method == "GET" and is_broken:
            route.abort()
            return
        present = {"present": None, "not_made": [], "not_made_total": 0, "detail": None}
        route.fulfill(
            json={"id": "1", "state": "running", "done": 1, "total": 2, "size": 0, **present}
        )

    page.route("**/api/bulk-exports**", answer)
    dialog = page.get_by_role("dialog", name="Export 2 inspections")
    dialog.get_by_role("button", name="Make the archive").click()
    expect(dialog.get_by_role("alert")).to_contain_text("Trying again")
    expect(dialog.get_by_role("button", name="Make the archive")).to_be_disabled()
    is_broken = False
    expect(dialog.get_by_role("status")).to_have_text("1 of 2: ")
    expect(dialog.get_by_role("alert")).to_be_empty()
    page.mouse.click(5, 5)
    page.keyboard.press("Escape")
    with page.expect_request(lambda request: request.method == "DELETE"):
        page.get_by_role("button", name="Close without it").click()
    expect(dialog).to_have_count(0)
    assert requests.count("POST") == 1
