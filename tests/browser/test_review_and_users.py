"""A reviewer approves in the page, which is then locked; earlier versions; the users' tokens."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from desks import WITHOUT_WEBGL, ask, expect_read, expect_saved, observations, show_more
from looks import expect_no_fault
from playwright.sync_api import Browser, Page, expect
from steps import Server, log_in
from surveys import Survey

TAGS = [f"0123abcd-0000-4000-8000-00000000000{n}" for n in range(2)]


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with with_two_defects(narrow, tmp_path_factory.mktemp("data")) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(narrow: Survey) -> str:
    return narrow.id


@pytest.fixture
def own_server(narrow: Survey, tmp_path: Path) -> Iterator[Server]:
    """For a test whose reviews and changes no other one may meet."""
    with with_two_defects(narrow, tmp_path / "data") as running:
        yield running


@contextmanager
def with_two_defects(survey: Survey, data: Path) -> Iterator[Server]:
    """A server whose only inspection has two defects."""
    with Server(survey.copied_to(data)) as server:
        for n, tag in enumerate(TAGS):
            path = f"/api/inspections/{survey.id}/observations/{tag}"
            server.ask("PUT", path, {"frame": 2 + 5 * n, "code": "BAB", "severity": 2})
        yield server


def press(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def take_step(page: Page, name: str, reason: str | None = None) -> None:
    press(page, name)
    dialog = page.get_by_role("dialog", name=name)
    if reason is not None:
        dialog.get_by_label("Reason").fill(reason)
    dialog.get_by_role("button", name=name, exact=True).click()
    expect(dialog).to_have_count(0)


def test_a_reviewer_asks_and_approves_and_the_page_is_locked_until_it_is_reopened(
    page: Page, server: Server, inspection: str
) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    expect_read(page)
    page.locator(".defect__main").nth(1).click()
    page.keyboard.press("e")
    show_more(page)
    press(page, "Ask")
    expect(page.locator("defect-review")).to_contain_text("Write the question or comment first.")
    page.get_by_label("Question or comment").fill("Crack or root?")
    press(page, "Ask")
    press(page, "Accept")
    expect(page.locator(".remark")).to_have_text(
        [re.compile("Question.*Crack or root?", re.DOTALL), re.compile("Accepted")]
    )
    expect_no_fault(page, ("dark",), within="defect-form")
    page.keyboard.press("Escape")
    expect(page.locator(".defect").nth(1)).to_contain_text("1 open question")
    page.keyboard.press("u")  # the acceptance
    page.keyboard.press("p")
    page.keyboard.press("q")
    expect(page.locator("defect-form .remark")).to_have_count(1)
    page.keyboard.press("Escape")

    page.get_by_role("tab", name="Review").click()
    take_step(page, "Submit for review")
    take_step(page, "Start review")
    take_step(page, "Approve")
    expect(page.locator("toast-stack")).to_contain_text("Questions about defects are not settled")
    press(page, "Settled")
    expect(page.locator(".review")).to_contain_text("No open questions")
    take_step(page, "Approve")
    expect(page.locator("[data-locked] .desk-bar__lock")).to_contain_text("Approved by server")
    expect_read(page)
    before = observations(server, inspection)
    for key in ("t", "1", "n", "m", "Delete", "e"):
        page.keyboard.press(key)
    expect(page.locator(".question[data-key=remark]")).to_be_disabled()
    expect(page.get_by_role("button", name="Accept")).to_have_count(0)
    assert observations(server, inspection) == before

    page.get_by_role("tab", name="Review").click()
    expect_no_fault(page, ("dark",))
    press(page, "Reopen")
    press(page.get_by_role("dialog"), "Reopen")  # type: ignore[arg-type]
    expect(page.get_by_role("dialog")).to_contain_text("State why")
    page.keyboard.press("Escape")
    take_step(page, "Reopen", "The wrong pipe")
    expect(page.locator("[data-locked]")).to_have_count(0)
    page.get_by_role("tab", name="Review").click()
    expect(page.locator(".review")).to_contain_text("The wrong pipe")
    page.goto(f"{server.url}/inspections?review=approved")
    expect(page.locator("[data-part=nothing]")).to_be_visible()
    page.get_by_label("Review", exact=True).select_option("reopened")
    expect(page.locator(f".inspection[data-key='{inspection}']")).to_contain_text("Reopened")


def test_two_people_see_each_other_and_nothing_that_is_typed_or_accepted_is_lost(
    page: Page, own_server: Server, inspection: str, browser: Browser
) -> None:
    server = own_server
    path = f"/api/inspections/{inspection}"
    there = browser.new_context()
    there.add_init_script(WITHOUT_WEBGL)
    ben = there.new_page()
    log_in(ben, server, f"/inspections/{inspection}", server.make_token("Ben", "operator"))
    log_in(page, server, f"/inspections/{inspection}")
    expect(page.locator(".desk-bar__people")).to_have_text("Ben is here too")
    expect(ben.locator(".desk-bar__people")).to_have_text("server is here too")
    expect_read(page)
    page.locator(".defect__main").first.click()
    page.keyboard.press("e")
    ben.locator(".defect__main").first.click()
    ben.keyboard.press("e")
    expect(page.locator("defect-form")).to_contain_text("Ben is editing this defect too")

    # What one of them changes is shown to the other without a reload.
    ask(ben, "remark")
    ben.get_by_label("Remark").fill("roots at the crown")
    expect(page.locator(".question[data-key=remark]")).to_contain_text("roots at the crown")
    show_more(page)
    page.get_by_label("Question or comment").fill("Is it wet?")
    ben.get_by_role("tab", name="Header").click()
    ben.get_by_role("textbox", name="Client", exact=True).fill("JKR")
    ben.keyboard.press("Tab")
    page.wait_for_function(
        "() => document.querySelector('inspection-page').desk.inspection.value.header.client"
    )
    expect_no_fault(page, ("dark",), within="desk-bar")

    # An acceptance of what is no longer stored is refused, and asked for again.
    page.evaluate(
        """() => {
          const { desk } = document.querySelector('inspection-page');
          desk.live.dispatchEvent = () => true;  // the line is silent
        }"""
    )
    server.ask("PUT", f"{path}/observations/{TAGS[0]}", {"frame": 2, "code": "BAC", "severity": 4})
    press(page, "Comment")
    review = page.locator("defect-review")
    expect(review).to_contain_text("Somebody changed this defect meanwhile")
    expect(page.locator("#defect-code")).to_have_value("BAC")
    expect(review.locator(".remark")).to_have_count(0)
    press(page, "Comment")
    expect(review.locator(".remark")).to_have_text(re.compile("Is it wet?"))
    page.reload()
    expect_read(page)

    # An approval waits for the remark that is being typed.
    page.locator(".defect__main").first.click()
    page.keyboard.press("e")
    page.get_by_label("Question or comment").fill("Half a sent")
    ben.get_by_role("button", name="Keys").click()
    for state in ("submitted", "in_review", "approved"):
        server.ask("POST", f"{path}/review", {"state": state})
    expect(page.locator("lock-notice")).to_contain_text("server has approved this inspection")
    expect(page.get_by_label("Question or comment")).to_have_value("Half a sent")
    # It waits for the end of a dialog too.
    ben.wait_for_function(
        "() => document.querySelector('inspection-page').desk.inspection.value.review.state"
        " === 'approved'"
    )
    expect(ben.get_by_role("dialog")).to_be_visible()
    ben.keyboard.press("Escape")
    expect(ben.locator("[data-locked] .desk-bar__lock")).to_contain_text("Approved by server")
    press(page, "Show it as approved")
    expect(page.locator("defect-form")).to_have_count(0)
    expect_read(page)
    page.keyboard.press("e")
    expect(page.get_by_label("Typed before it was approved")).to_have_value("Half a sent")
    server.ask("POST", f"{path}/review", {"state": "reopened", "reason": "More to say"})
    expect(page.locator("[data-locked]")).to_have_count(0)
    expect_read(page)
    page.keyboard.press("e")
    expect(page.get_by_label("Question or comment")).to_have_value("Half a sent")
    there.close()
    expect(page.locator(".desk-bar__people")).to_have_text("")


def test_an_earlier_version_comes_back_from_the_history_and_can_be_undone(
    page: Page, server: Server, inspection: str
) -> None:
    def severities() -> list[int]:
        return sorted(item["severity"] for item in observations(server, inspection))

    server.ask("PATCH", f"/api/inspections/{inspection}", {"header": {"asset_id": "A 1"}})
    server.ask("PATCH", f"/api/inspections/{inspection}", {"header": {"asset_id": "B 2"}})
    path = f"/api/inspections/{inspection}/observations"
    server.ask("PUT", f"{path}/{TAGS[0]}", {"frame": 2, "code": "BAB", "severity": 4})
    server.ask("DELETE", f"{path}/{TAGS[1]}")
    log_in(page, server, f"/inspections/{inspection}")
    expect_read(page)
    page.get_by_role("tab", name="History").click()
    press(page, "Restore this version: Deleted defect BAB deleted")
    expect(page.locator(".defect")).to_have_count(2)
    press(page, "Restore this version: BAB at 0.00 m edited")
    expect_saved(page)
    assert severities() == [2, 2]
    page.keyboard.press("u")
    expect(page.locator("toast-stack")).to_contain_text("earlier version of BAB")
    expect_saved(page)
    assert severities() == [2, 4]
    page.locator(".event", has_text="A 1").get_by_role("button").first.click()
    expect(page.locator(".event").first).to_have_text(re.compile("B 2.*A 1", re.DOTALL))
    shown = json.load(server.ask("GET", f"/api/inspections/{inspection}"))
    assert shown["header"] == {"asset_id": "A 1"}


def test_an_admin_makes_a_token_changes_its_role_and_revokes_it(page: Page, server: Server) -> None:
    log_in(page, server, "/settings")
    page.get_by_role("link", name="Access").click()
    press(page, "Access for a colleague")
    page.get_by_label("Name").fill("server")
    press(page, "Make access")
    expect(page.get_by_role("dialog").get_by_role("alert")).not_to_be_empty()
    page.get_by_label("Name").fill("Ana")
    press(page, "Make access")
    link = page.get_by_label("Link to hand over").input_value()
    ana = {"Authorization": f"Bearer {link.split('token=')[1]}"}
    expect_no_fault(page, ("dark",), within="dialog[open]")
    page.keyboard.press("Escape")
    page.get_by_label("Role of Ana").select_option("viewer")
    expect(page.locator("toast-stack")).to_contain_text("Ana has the role viewer now.")
    assert json.load(server.ask("GET", "/api/me", headers=ana))["role"] == "viewer"
    press(page, "End the access of Ana")
    press(page, "End access")
    expect(page.get_by_text("1 ended access")).to_be_visible()
    expect(page.get_by_label("Role of Ana")).to_have_count(0)
    expect_no_fault(page, ("dark",))
