"""Defects, assets and films of the whole archive: found, compared over the years, and opened."""

from __future__ import annotations

import json
import uuid
from collections.abc import Iterator

import pytest
from clip_surveys import ids_of
from desks import expect_frame
from looks import expect_no_fault
from playwright.sync_api import Page, expect
from steps import Server, log_in
from surveys import Survey

FRAME = 13
THUMBNAILS_SHOWN = """(n) => [...document.querySelectorAll('.thumbnail img')]
  .filter(({ naturalWidth }) => naturalWidth === 240).length === n"""
YEARS = {"2019-05-02": 2, "2024-05-02": 4}
"""Day of each survey, and the severity of the crack then."""


@pytest.fixture(scope="module")
def server(several: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(several.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def surveys(server: Server) -> list[str]:
    """Two surveys of one culvert, whose crack has grown."""
    ids = ids_of(server)
    for left in ids[len(YEARS) :]:
        server.ask("DELETE", f"/api/inspections/{left}")
    for inspection, (day, severity) in zip(ids, YEARS.items(), strict=False):
        tag(server, inspection, day, severity)
    return ids[: len(YEARS)]


def tag(server: Server, inspection: str, day: str, severity: int) -> None:
    header = {"asset_id": "CUL-0041", "project": "North", "date": day, "direction": "with_flow"}
    server.ask("PATCH", f"/api/inspections/{inspection}", {"name": day, "header": header})
    crack = {"frame": FRAME, "pixel": [160, 150], "code": "BAB", "char1": "B", "char2": "A"}
    remark = f"longitudinal, seen in {day[:4]}"
    path = f"/api/inspections/{inspection}/observations/{uuid.uuid4()}"
    server.ask("PUT", path, crack | {"severity": severity, "remark": remark})


def test_a_defect_is_found_by_its_words_and_opened_at_its_frame(
    page: Page, server: Server, surveys: list[str]
) -> None:
    log_in(page, server, "/find")
    rows = page.locator("tbody tr")
    expect(rows).to_have_count(2)
    page.get_by_label("Severity from").select_option("3")
    expect(rows).to_have_count(1)
    page.get_by_text("Place and date").click()
    page.get_by_label("Distance from").fill("far")
    expect(page.get_by_text("A distance is needed, such as 12.5 m.")).to_be_visible()
    page.get_by_label("Distance from").fill("500 m")
    expect(page.get_by_text("No defect fits.")).to_be_visible()
    page.get_by_role("button", name="Show all").click()
    page.get_by_label("Words").fill("LONGITUDINAL 2019")
    expect(rows).to_have_count(1)
    expect_no_fault(page, ("dark",))
    page.reload()
    expect(rows).to_have_count(1)
    rows.get_by_role("link", name="BAB B A").click()
    expect_frame(page, FRAME)
    assert surveys[0] in page.url


def test_a_project_leads_to_its_asset_whose_history_shows_what_has_grown(
    page: Page, server: Server, surveys: list[str]
) -> None:
    log_in(page, server, "/assets/projects")
    page.get_by_role("link", name="North").click()
    expect(page.locator(".project-facts")).to_contain_text("Assets1Inspections2Done2")
    expect(page.locator("tbody tr")).to_contain_text("4 plan repair")
    expect_no_fault(page, ("dark",))
    expect(page.get_by_role("button", name="Export…")).to_be_enabled()
    page.get_by_label("Search the assets").fill("0041")
    page.route("**/api/archive/assets/**", lambda route: route.abort(), times=1)
    page.get_by_role("link", name="CUL-0041").click()
    expect(page.get_by_text("Trying again")).to_be_visible()
    heads = page.get_by_role("columnheader").filter(has_text="Done")
    expect(heads.locator("a[href^='/inspections/']")).to_have_text(list(YEARS))
    expect(heads.nth(1)).to_contain_text("1 grown")
    expect(page.get_by_text("Trying again")).to_have_count(0)
    page.wait_for_function(THUMBNAILS_SHOWN, arg=len(surveys))
    page.get_by_role("button", name="Grown 1").click()
    row = page.get_by_role("row").filter(has_text="BAB")
    expect(row.get_by_role("cell")).to_have_text([str(severity) for severity in YEARS.values()])
    expect(row).to_contain_text("grown: 2 to 4")
    expect_no_fault(page, ("light",))
    row.get_by_role("link").last.click()
    expect_frame(page, FRAME)
    assert surveys[1] in page.url


def test_films_are_listed_by_what_was_wrong_with_them(
    page: Page, server: Server, surveys: list[str]
) -> None:
    log_in(page, server, "/films/quality")
    rows = page.locator("tbody tr")
    expect(rows).to_have_count(2)
    expect_no_fault(page, ("dark",))
    found = json.load(server.ask("GET", "/api/archive/quality?problem=too_dark"))["total"]
    page.get_by_role("button", name="Too dark").first.click()
    expect(rows).to_have_count(found)
    expect(page.get_by_role("button", name="Too dark").first).to_have_attribute(
        "aria-pressed", "true"
    )
