"""A client without an account asks on a phone, gets a reply, and accepts."""

from __future__ import annotations

from looks import expect_no_fault
from playwright.sync_api import Browser, Page, expect
from steps import Server, log_in


def test_a_client_asks_on_a_phone_gets_a_reply_and_accepts(
    page: Page, browser: Browser, narrow_server: Server, inspection: str
) -> None:
    log_in(page, narrow_server, f"/inspections/{inspection}")
    page.get_by_role("tab", name="Review").click()
    page.get_by_role("button", name="Acceptance by link").click()
    page.get_by_label("For whom").fill("Lot 3 <b>")
    page.get_by_role("button", name="Make a link").click()
    address = page.get_by_label("Address").input_value()
    page.get_by_role("dialog", name="Link for acceptance").get_by_text("Close").click()
    dialog = page.get_by_role("dialog", name="Acceptance by link")
    expect(dialog).to_contain_text("Lot 3 <b>")
    expect_no_fault(page, within="dialog[open]")
    dialog.locator("[data-part=cancel]").click()

    phone = browser.new_context(viewport={"width": 390, "height": 844}, locale="en-GB")
    client = phone.new_page()
    client.goto(address)
    expect(client.get_by_text("Lot 3 <b>")).to_be_visible()
    expect_no_fault(client, ("light",))
    client.locator("ol a").click()
    client.get_by_label("Your name").fill("Ada")
    client.get_by_role("button", name="Ask a question").click()
    expect(client.get_by_role("alert")).to_have_text("Write your question first.")
    expect_no_fault(client, ("light",))
    assert client.evaluate("document.documentElement.scrollWidth") == 390
    client.get_by_label("Question").fill("Why here?")
    client.get_by_role("button", name="Ask a question").click()
    expect(client.get_by_text("Your question waits for a reply")).to_be_visible()

    page.get_by_role("button", name="Reply").click()  # it is here without a reload
    page.get_by_role("textbox", name="Reply").fill("Because of <that>.")
    page.get_by_role("dialog").get_by_role("button", name="Reply").click()
    expect(page.get_by_role("dialog")).to_have_count(0)

    client.reload()
    expect(client.get_by_text("Because of <that>.")).to_be_visible()
    client.get_by_label("Your name").fill("Ada")
    client.get_by_role("button", name="Accept this section").click()
    client.get_by_role("link", name="All sections").click()
    expect(client.locator(".standing")).to_have_text("Accepted")
    phone.close()
    expect(page.get_by_text("Accepted by the client")).to_be_visible()
