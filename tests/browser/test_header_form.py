"""The header: what is missing is named and stops nothing, and each field is saved as it is left."""

from __future__ import annotations

import json
import re

import pytest
from playwright.sync_api import Page, expect
from steps import Server, log_in


@pytest.fixture(scope="module")
def server(narrow_server: Server) -> Server:
    return narrow_server


@pytest.fixture
def panel(page: Page, server: Server, inspection: str) -> Page:
    log_in(page, server, f"/inspections/{inspection}")
    page.get_by_role("tab", name="Header").click()
    return page


def header_of(server: Server, inspection: str) -> dict:
    return json.load(server.ask("GET", f"/api/inspections/{inspection}"))["header"]


FULL = """() => {
  const fill = (size) => localStorage.setItem(`full ${size}`, 'x'.repeat(size));
  for (let size = 2 ** 23; size >= 1; size /= 2) try { fill(size); } catch {}
}"""


def test_what_is_missing_is_named_and_what_is_typed_is_kept_and_saved(
    panel: Page, server: Server, inspection: str
) -> None:
    state = panel.locator(".header-panel__state")
    client = panel.get_by_role("textbox", name="Client", exact=True)
    missing = panel.locator(".header-form__missing")
    expect(missing).to_contain_text("Asset")
    count = int(missing.inner_text().split()[0])
    panel.get_by_role("textbox", name="Asset", exact=True).fill("KL-204")
    panel.get_by_role("textbox", name="Client", exact=True).focus()
    expect(missing).to_contain_text(f"{count - 1} required fields are empty")
    expect(missing).not_to_contain_text("Asset")
    # The width is needed unless the pipe is circular.
    panel.get_by_role("combobox", name="Cross-section").select_option("circular")
    expect(missing).not_to_contain_text("Width")
    panel.get_by_role("combobox", name="Cross-section").select_option("egg")
    expect(missing).to_contain_text("Width")

    # A fault stands beside its field.
    height = panel.get_by_role("textbox", name="Height", exact=True)
    fault = panel.locator("#header-height_mm-fault")
    height.fill("wide")
    height.blur()
    expect(fault).to_have_text("A number is needed, such as 12.5.")
    height.fill("-4")
    height.blur()
    expect(fault).to_have_text(re.compile("height_mm must be a number"))
    expect(height).to_have_value("-4")
    height.fill("600")
    height.blur()
    expect(fault).to_be_empty()
    expect(panel.locator(".header-panel__state")).to_have_text("Saved")
    assert header_of(server, inspection)["height_mm"] == 600

    # What is typed survives a reload.
    asset = panel.get_by_role("textbox", name="Asset", exact=True)
    asset.press("End")
    asset.press_sequentially("5")
    expect(state).not_to_have_text("Saved")
    panel.reload()
    panel.get_by_role("tab", name="Header").click()
    expect(asset).to_have_value("KL-2045")
    expect(panel.locator(".header-panel__state")).to_have_text("Saved")
    assert header_of(server, inspection)["asset_id"] == "KL-2045"

    # A field is saved when the server is back.
    expect(client).to_be_visible()
    panel.context.set_offline(True)
    client.fill("JKR")
    client.blur()
    expect(state).to_contain_text("cannot be reached")
    panel.context.set_offline(False)
    expect(state).to_have_text("Saved")
    assert header_of(server, inspection)["client"] == "JKR"

    # A field is saved as it is left, even where the browser can keep nothing.
    panel.evaluate(FULL)
    asset.fill("KL-204")
    panel.get_by_role("textbox", name="Start node").fill("HW1")
    panel.keyboard.press("Tab")
    panel.get_by_role("combobox", name="Direction").select_option("with_flow")
    expect(state).to_have_text("Saved")
    header = header_of(server, inspection)
    assert [header[name] for name in ("asset_id", "start_node", "direction")] == [
        "KL-204", "HW1", "with_flow",
    ]  # fmt: skip

    # Tabs are moved by arrows.
    defects = panel.get_by_role("tab", name="Defects")
    proposals = panel.get_by_role("tab", name="Look here")
    panel.get_by_role("tab", name="Header").focus()
    panel.keyboard.press("Home")
    expect(defects).to_be_focused()
    expect(defects).to_have_attribute("aria-selected", "true")
    expect(panel.get_by_role("tabpanel", name="Defects")).to_be_visible()
    panel.keyboard.press("ArrowRight")
    expect(proposals).to_be_focused()
    expect(panel.get_by_role("tabpanel", name="Look here")).to_be_visible()


def test_the_rig_and_the_clock_fill_a_new_header(page: Page, server: Server) -> None:
    log_in(page, server, "/new")
    page.get_by_label("Camera and mount").select_option("preset 1")
    expect(page.get_by_role("textbox", name="Height", exact=True)).to_have_value("600")
    expect(page.get_by_role("combobox", name="Cross-section")).to_have_value("circular")
    expect(page.get_by_label("Date")).not_to_have_value("")
    # What a person wrote is not replaced by the next rig.
    page.get_by_role("textbox", name="Height", exact=True).fill("610")
    page.get_by_label("Camera and mount").select_option("preset 0")
    expect(page.get_by_role("textbox", name="Height", exact=True)).to_have_value("610")
