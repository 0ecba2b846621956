"""A full code by letters, the last code again, digit keys that give all details, and repairs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from desks import (
    delete_observations,
    expect_frame,
    expect_read,
    expect_saved,
    observations,
    show_more,
)
from playwright.sync_api import Page, ViewportSize, expect
from steps import Server, log_in
from surveys import Survey

SIZES: tuple[ViewportSize, ...] = ({"width": 1366, "height": 768}, {"width": 1280, "height": 720})
CUT = """() => [...document.querySelectorAll('code-chain, .chain__keys *')]
  .filter((one) => one.scrollWidth > one.clientWidth + 1 && one.clientWidth)
  .map((one) => one.textContent)"""
TYPED_INTO_A_HIDDEN_FIELD = """(key) => {
  const field = document.body.appendChild(document.createElement('input'));
  field.hidden = true; // as that of a dialog that has just closed
  field.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
  field.remove();
}"""


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(narrow: Survey) -> str:
    return narrow.id


@pytest.fixture
def desk(page: Page, server: Server, inspection: str) -> Page:
    delete_observations(server, inspection)
    log_in(page, server, f"/inspections/{inspection}")
    expect_read(page)
    expect_frame(page, 0)
    return page


def press(page: Page, keys: str) -> int:
    """Press each of the keys; return how many that was."""
    for key in keys:
        page.keyboard.press(key)
    return len(keys)


def newest(page: Page, server: Server, inspection: str, count: int) -> dict[str, Any]:
    """The last of as many observations as there should be."""
    expect(page.locator(".defect")).to_have_count(count)
    expect_saved(page)
    return max(observations(server, inspection), key=lambda item: int(item["seq"]))


def stated(item: dict[str, Any]) -> list[Any]:
    return [item[name] for name in ("code", "char1", "char2", "severity")]


def emptied(page: Page, server: Server, inspection: str) -> None:
    """Nothing is tagged any more, and the film is at its begin."""
    delete_observations(server, inspection)
    expect(page.locator(".defect")).to_have_count(0)
    page.keyboard.press("Home")
    expect_frame(page, 0)


def test_codes_are_typed_repeated_kept_for_keys_and_offered_by_checks(
    desk: Page, server: Server, inspection: str
) -> None:
    # All of the list can be read, and its way out seen, on a small screen too.
    chain = desk.get_by_role("group", name="Code by letters")
    for size in SIZES:
        desk.set_viewport_size(size)
        press(desk, "b")
        expect(chain.get_by_role("button", name="Cancel")).to_be_in_viewport(ratio=1)
        assert desk.evaluate(CUT) == [], size
        desk.evaluate(TYPED_INTO_A_HIDDEN_FIELD, "a")
        expect(chain.get_by_role("status")).to_contain_text("BA")
        desk.keyboard.press("Escape")

    # The main code makes the tag; what it needs is asked beside the film, which goes on.
    asked = desk.locator("#question-asked")
    assert press(desk, "bab") == 3
    expect(chain).to_be_hidden()
    expect(asked).to_have_text("Kind")
    desk.keyboard.press("ArrowRight")
    expect_frame(desk, 1)
    assert press(desk, "ba3") == 3
    expect(asked).to_have_text("Quantity")
    desk.keyboard.press("Shift+Digit4")
    expect(desk.locator("defect-form")).to_have_count(0)
    tag = newest(desk, server, inspection, 1)
    assert stated(tag) == ["BAB", "B", "A", 4]
    assert (tag["frame"], tag["quant1"], tag["clock"]) == (0, 3, 6)

    press(desk, "r")
    again = newest(desk, server, inspection, 2)
    assert stated(again) == ["BAB", "B", "A", 4]
    assert again["frame"] == 1

    press(desk, "bb")
    desk.keyboard.press("Backspace")
    press(desk, "bab")
    expect(asked).to_have_text("Quantity")
    desk.keyboard.press("Backspace")
    expect(asked).to_have_text("Clock position")
    desk.keyboard.press("Backspace")
    expect(asked).to_have_text("Kind")
    press(desk, "a12")
    desk.keyboard.press("Backspace")
    desk.keyboard.press("Enter")
    press(desk, "3")
    tag = newest(desk, server, inspection, 3)
    assert (stated(tag), tag["quant1"]) == (["BBA", "A", None, 3], 1)
    press(desk, "b2")  # the second of the last codes
    assert stated(newest(desk, server, inspection, 4)) == ["BAB", "B", "A", 4]

    press(desk, "bb")
    desk.keyboard.press("Escape")
    expect(chain).to_be_hidden()
    desk.keyboard.press("u")
    newest(desk, server, inspection, 3)

    # What changes along the pipe begins with A, and its character may have three letters.
    press(desk, "adst")
    expect(desk.locator(".question__choice kbd")).to_have_text(["STZ", "ST"])
    press(desk, "z")
    assert stated(newest(desk, server, inspection, 4)) == ["AED", "STZ", None, None]
    for _ in range(2):  # the material, the tag
        desk.keyboard.press("u")
    newest(desk, server, inspection, 3)

    # The clock is stated by its own key, and templates keep all of it.
    emptied(desk, server, inspection)

    def hours(item: dict[str, Any]) -> tuple[Any, Any, Any]:
        return item["clock_from"], item["clock_to"], item["severity"]

    press(desk, "babba@10@")
    expect(asked).to_have_text("Clock position: from 10 to …")
    press(desk, "23")
    desk.keyboard.press("Shift+Digit3")
    assert hours(newest(desk, server, inspection, 1)) == (10, 2, 3)
    press(desk, "babba@1")  # a lone one is one o'clock
    desk.keyboard.press("Enter")
    press(desk, "2")
    desk.keyboard.press("Shift+Digit4")
    tag = newest(desk, server, inspection, 2)
    assert hours(tag) == (1, None, 4)

    press(desk, "b0")
    expect(chain).to_contain_text("No templates yet")
    desk.keyboard.press("Escape")
    rated = desk.locator(".defect", has=desk.get_by_role("img", name="severity 4"))
    rated.get_by_role("button", name="Edit").click()
    show_more(desk)
    desk.get_by_label("Keep for a digit key").select_option(label="Keep as a template")
    expect(desk.get_by_text("Kept as template A")).to_be_visible()
    desk.get_by_role("button", name="Done").click()
    press(desk, "b0a")
    again = newest(desk, server, inspection, 3)
    assert (stated(again), hours(again)) == (stated(tag), hours(tag))
    press(desk, "b0")
    chain.get_by_role("button", name="Delete this template").click()
    expect(chain).to_contain_text("No templates yet")
    expect(chain.get_by_role("button", name="Back")).to_be_focused()
    desk.keyboard.press("Escape")

    desk.get_by_role("button", name="Undo").last.click()
    press(desk, "b0")
    expect(chain.locator("[data-forget]")).to_have_count(1)
    desk.keyboard.press("Escape")

    # A digit key gives all that was kept for it.
    emptied(desk, server, inspection)
    press(desk, "babca2")
    desk.keyboard.press("Shift+Digit2")
    press(desk, "e")
    busy = {"code": "busy", "detail": "Too much to do."}
    desk.route("**/api/me/preferences", lambda route: route.fulfill(status=503, json=busy))
    desk.get_by_label("Keep for a digit key").select_option("7")
    expect(desk.locator(".toast--error")).to_be_visible()
    expect(desk.get_by_text("Key 8 now tags this.")).to_have_count(0)
    desk.unroute("**/api/me/preferences")
    desk.get_by_label("Keep for a digit key").select_option(label="9 – Water")
    expect(desk.get_by_text("Key 9 now tags this.")).to_be_visible()
    desk.get_by_role("button", name="Done").click()
    expect(desk.locator(".quick__code").last).to_have_text("9Crack C A 2")
    desk.keyboard.press("ArrowRight")
    expect_frame(desk, 1)
    press(desk, "9")
    tag = newest(desk, server, inspection, 2)
    assert stated(tag) == ["BAB", "C", "A", 2]
    assert (tag["frame"], tag["quant1"]) == (1, 2)
    desk.reload()
    expect(desk.locator(".quick__code").last).to_have_text("9Crack C A 2")

    # Checks offer the repair, and lead to where the wall was lost.
    expect_read(desk)
    emptied(desk, server, inspection)
    desk.evaluate(
        """() => {
          const { track, checks } = document.querySelector('inspection-page').desk;
          track.column('status').fill(2, 7, 11);
          checks.dispatchEvent(new Event('change'));
        }"""
    )
    desk.get_by_role("tab", name="Checks").click()
    desk.get_by_role("button", name="Add BCD at 0.00 m").click()
    expect(desk.locator(".defect")).to_have_count(1)
    expect(desk.get_by_label("Code", exact=True)).to_have_value("BCD")
    expect_saved(desk)
    desk.get_by_role("tab", name="Checks").click()
    expect(desk.get_by_role("button", name=re.compile("^Add BCE at "))).to_be_visible()
    expect(desk.get_by_role("button", name="Add BCD at 0.00 m")).to_have_count(0)
    expect(desk.get_by_text("(4 frames)")).to_be_visible()
    desk.get_by_role("button", name="Look at it").click()
    expect_frame(desk, 7)

    ends = ("0123abcd-0000-4000-8000-0000000000a1", "0123abcd-0000-4000-8000-0000000000b1")
    for end, (frame, role) in zip(ends, ((15, "A1"), (3, "B1")), strict=True):
        tag = {"frame": frame, "code": "BBC", "char1": "C", "severity": 1, "continuous": role}
        server.ask("PUT", f"/api/inspections/{inspection}/observations/{end}", tag)
    desk.get_by_role("button", name="Swap start and finish").click()
    expect_saved(desk)
    found = {item["id"]: item["continuous"] for item in observations(server, inspection)}
    assert [found[end] for end in ends] == ["B1", "A1"]
    expect(desk.get_by_role("button", name="Swap start and finish")).to_have_count(0)
