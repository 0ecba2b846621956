"""Start and end of a survey: proposed where they belong, stored only when somebody confirms."""

from __future__ import annotations

import json

import pytest
from desks import expect_read, expect_saved, observations
from looks import expect_no_fault
from playwright.sync_api import Page, expect
from steps import Server, log_in
from surveys import Survey, another


@pytest.fixture
def survey(narrow: Survey, narrow_server: Server) -> str:
    return another(narrow, narrow_server)


def coded(server: Server, inspection: str) -> list[tuple[str, str | None, str | None]]:
    return [
        (item["code"], item["char1"], item["remark"])
        for item in sorted(observations(server, inspection), key=lambda item: item["distance_m"])
    ]


def exported(server: Server, inspection: str) -> str:
    return server.ask("GET", f"/api/inspections/{inspection}/exports/json").read().decode()


def test_finish_confirms_the_start_and_the_end(
    page: Page, narrow_server: Server, survey: str
) -> None:
    log_in(page, narrow_server, f"/inspections/{survey}")
    expect_read(page)
    proposed = page.get_by_role("list", name="Proposed start and end").get_by_role("listitem")
    expect(proposed).to_contain_text(["Proposed BCD A", "Proposed BCE A"], use_inner_text=True)
    expect_no_fault(page, within="proposed-ends")
    assert '"BCD"' not in exported(narrow_server, survey)
    page.get_by_role("button", name="Finish", exact=True).click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("The end was reached").check()
    dialog.get_by_label("Kind of BCD").select_option("E")
    expect_no_fault(page, within="dialog[open]")
    dialog.get_by_role("button", name="Finish").click()
    expect(page.locator(".defect")).to_have_count(2)
    expect(proposed).to_have_count(0)
    expect_saved(page)
    assert coded(narrow_server, survey) == [("BCD", "E", None), ("BCE", "A", None)]
    first, last = sorted(item["frame"] for item in observations(narrow_server, survey))
    total = json.load(narrow_server.ask("GET", f"/api/inspections/{survey}"))["progress"]
    assert (first, last) == (0, total["frames_done"] - 1)
    assert '"BCD"' in exported(narrow_server, survey)


def test_an_abandoned_survey_ends_with_its_reason(
    page: Page, narrow_server: Server, survey: str
) -> None:
    header = {"header": {"asset_type": "culvert"}}
    narrow_server.ask("PATCH", f"/api/inspections/{survey}", header)
    log_in(page, narrow_server, f"/inspections/{survey}")
    expect_read(page)
    page.get_by_role("button", name="Confirm BCD Z").click()
    expect(page.locator(".defect")).to_have_count(1)
    expect_saved(page)
    page.get_by_role("button", name="Finish", exact=True).click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_role("radio", name="Abandoned").check()
    dialog.get_by_role("button", name="Water level").click()
    expect(dialog.get_by_label("Kind of BDC")).to_have_value("B")
    expect(dialog.get_by_label("Kind of BCD")).to_have_count(0)
    dialog.get_by_role("button", name="Finish").click()
    expect(page.locator(".defect")).to_have_count(2)
    expect_saved(page)
    assert coded(narrow_server, survey) == [
        ("BCD", "Z", "headwall"), ("BDC", "B", "Water level"),
    ]  # fmt: skip
