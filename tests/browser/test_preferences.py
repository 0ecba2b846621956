"""Language, units and quick codes: chosen once, the same on every device."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import pytest
from desks import WITHOUT_WEBGL, expect_frame, expect_read
from looks import expect_no_fault
from playwright.sync_api import Browser, Page, Route, expect
from steps import TOKEN, Server, log_in
from surveys import Survey


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(narrow: Survey) -> str:
    return narrow.id


@pytest.fixture(autouse=True)
def _nothing_chosen(server: Server) -> Iterator[None]:
    """Give back what the server has at first: with anything else a new visitor's page reloads."""
    at_first = json.load(server.ask("GET", "/api/me"))["preferences"]
    yield
    server.ask("PUT", "/api/me/preferences", at_first)


def open_settings(page: Page) -> None:
    """From the desk, whose menu leads to the sections."""
    page.get_by_label("Menu").click()
    page.get_by_role("link", name="Settings").click()
    expect(page.get_by_role("heading", name="Settings", level=1)).to_be_visible()


TOO_WIDE = """() => {
  const inside = ({ clientWidth, scrollWidth }) => scrollWidth <= clientWidth + 1;
  const holders = document.querySelectorAll('.button, .chip, .save, .quick__code, label, .panel');
  const shown = [...holders].filter((one) => one.checkVisibility() && one.clientWidth > 1);
  const wide = shown.filter((one) => !inside(one));
  const page = inside(document.documentElement) ? [] : ['the page'];
  return [...page, ...wide.map((one) => one.textContent.trim())];
}"""
"""What does not hold its words."""


def test_the_language_is_that_of_the_browser_and_german_fits(
    browser: Browser, server: Server, inspection: str
) -> None:
    tag = f"/api/inspections/{inspection}/observations/7d444840-9dc0-4d2a-8a6a-00000000000d"
    server.ask("PUT", tag, {"frame": 0, "code": "BAB", "char1": "C", "char2": "A"})
    page = browser.new_context(locale="de-AT", viewport={"width": 1366, "height": 768}).new_page()
    page.add_init_script(WITHOUT_WEBGL)
    page.goto(server.url)
    expect(page.get_by_label("Zugangscode")).to_be_visible()
    log_in(page, server, f"/inspections/{inspection}")
    expect(page.locator("html")).to_have_attribute("lang", "de")
    expect(page.locator(".defect", has_text="Riss: klaffend, längs")).to_be_visible()
    tabs = page.get_by_role("tablist")
    assert tabs.evaluate("(list) => list.scrollWidth <= list.clientWidth")
    assert page.evaluate(TOO_WIDE) == []
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate(TOO_WIDE) == []
    for path, name in (
        ("/", "Arbeit"),
        ("/new", "Neue Inspektion"),
        ("/settings", "Einstellungen"),
        ("/find", "Schäden"),
    ):
        page.goto(server.url + path)
        expect(page.get_by_role("heading", name=name, level=1)).to_be_visible()
        for width in (1366, 390):
            page.set_viewport_size({"width": width, "height": 768})
            assert page.evaluate(TOO_WIDE) == [], (path, width)
    expect(page.get_by_role("table")).to_contain_text("Riss: klaffend, längs")
    page.context.close()


REMARKS = (
    ({"action": "created", "remark": "Imported from a.txt."}, "Diimport daripada a.txt."),
    (
        {
            "action": "not_told",
            "remark": "It answered 500.",
            "reason": {"code": "answered", "values": {"status": "500"}},
        },
        "Ia menjawab 500.",
    ),
    (
        {
            "action": "not_told",
            "remark": "It cannot be reached: refused.",
            "reason": {"code": "of_a_newer_server", "values": {}},
        },
        "It cannot be reached: refused.",
    ),
    (
        {
            "action": "rescaled",
            "remark": "3 joints: scale 0.9910",
            "after": {
                "scale": 0.991,
                "scale_sigma": 0.0005,
                "joints_counted": 3,
                "camera_lower_mm": None,
            },
        },
        "3 sambungan: skala 0.9910 ± 0.0005.",
    ),
    (
        {
            "action": "rescaled",
            "remark": "No joints were seen.",
            "after": {"refusal": {"code": "no_joints", "params": {}}},
        },
        "Tiada sambungan dilihat; ukur satu panjang dengan pita.",
    ),
    ({"action": "changed", "remark": "Imported from a.txt."}, "Imported from a.txt."),
)


def test_remarks_of_the_server_are_in_the_language_of_the_page(
    browser: Browser, server: Server
) -> None:
    page = browser.new_context(locale="ms-MY").new_page()
    # The log-in: another page that finds other preferences on the server is drawn anew meanwhile.
    log_in(page, server, "/login?token=another")
    seen = page.evaluate(
        """async (events) => {
          const { remarkText } = await import('/static/components/desk/panels/history-remarks.js');
          return events.map(remarkText);
        }""",
        [{"after": None, "reason": None} | event for event, _ in REMARKS],
    )
    assert seen == [text for _, text in REMARKS]
    page.context.close()


def test_a_language_that_is_chosen_at_the_log_in_stays_and_is_there_on_another_device(
    page: Page, browser: Browser, server: Server
) -> None:
    page.goto(server.url)
    page.get_by_role("button", name="Bahasa Malaysia").click()
    page.get_by_label("Kod akses").fill("salah")
    page.get_by_role("button", name="Log masuk").click()
    expect(page.get_by_role("alert")).to_contain_text("Kod akses ini tidak dikenali")
    page.get_by_label("Kod akses").fill(TOKEN)
    page.get_by_role("button", name="Log masuk").click()
    expect(page.get_by_role("heading", name="Kerja", level=1)).to_be_visible()
    chosen = json.load(server.ask("GET", "/api/me"))["preferences"]
    assert chosen["language"] == "ms"
    other = browser.new_context(locale="en-US").new_page()
    log_in(other, server)
    expect(other.get_by_role("heading", name="Kerja", level=1)).to_be_visible()
    expect(other.locator("html")).to_have_attribute("lang", "ms")
    other.context.close()


def test_distances_are_in_feet_everywhere(page: Page, server: Server, inspection: str) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    expect(page.locator(".readout__unit")).to_have_text("m")
    open_settings(page)
    with page.expect_navigation():
        page.get_by_label("Distances in").select_option("ft")
    # The choice has the focus again: another one may follow.
    expect(page.get_by_label("Distances in")).to_be_focused()
    with page.expect_navigation():
        page.get_by_role("combobox", name="Language").select_option("ms")
    expect(page.get_by_role("heading", name="Tetapan", level=1)).to_be_visible()
    with page.expect_navigation():
        page.get_by_role("combobox", name="Bahasa").select_option("en")
    page.goto(f"{server.url}/inspections/{inspection}")
    expect(page.locator(".readout__unit")).to_have_text("ft")
    expect(page.locator(".readout__interval")).to_have_text(re.compile(r"± \d+\.\d ft"))
    page.keyboard.press("t")
    expect(page.locator(".defect__where").first).to_have_text(re.compile(r"\d+\.\d ft"))
    page.goto(f"{server.url}/inspections")
    expect(page.locator("[data-part=length]")).to_have_text(re.compile(r"\d+\.\d ft"))


def test_a_digit_tags_the_code_that_was_put_on_it(
    page: Page, server: Server, inspection: str
) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    open_settings(page)
    key = page.get_by_role("combobox", name="Key 3")
    key.fill("crack spiral")
    with page.expect_response("**/api/me/preferences"):
        page.locator(".code-search__list [role=option]").first.click()
    expect(key).to_have_value("BAB A D")
    page.goto(f"{server.url}/inspections/{inspection}")
    expect(page.locator("[data-quick='2']")).to_contain_text("A D")
    expect_frame(page, 0)
    page.keyboard.press("3")
    expect(page.locator(".defect__what b").last).to_have_text("BAB A D")

    # A code that is typed out counts when the field is left; what is no code is said.
    open_settings(page)
    key.fill("bcc a")
    key.press("Tab")
    expect(key).to_have_value("BCC A")
    key.fill("crakc")
    key.press("Tab")
    expect(page.locator(".settings__message")).to_contain_text("“crakc” is no code")
    expect(key).to_have_value("BCC A")
    with page.expect_response("**/api/me/preferences"):
        page.get_by_role("button", name="Usual codes").click()
    expect(key).to_have_value("BAF")

    # A late answer does not overwrite the next code that is typed.
    held: list[Route] = []
    page.route("**/api/me/preferences", lambda route: held.append(route))
    key.fill("bcc a")
    with page.expect_request("**/api/me/preferences"):
        key.press("Tab")
    expect(key).to_have_value("BCC A")
    key.fill("crac")
    with page.expect_response("**/api/me/preferences") as answer:
        held[0].continue_()
    answer.value.finished()
    key.press("k")
    page.evaluate("() => new Promise((next) => requestAnimationFrame(() => setTimeout(next)))")
    expect(key).to_have_value("crack")
    page.unroute("**/api/me/preferences")


def test_letters_can_be_switched_off_as_keys(page: Page, server: Server, inspection: str) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    page.get_by_role("button", name="Keys").click()
    keys = page.get_by_role("dialog", name="Keys")
    expect(keys.get_by_text("Shift + click tags a place")).to_be_visible()
    expect(keys.locator("kbd", has_text=re.compile("^T$"))).to_be_visible()
    page.keyboard.press("Escape")
    open_settings(page)
    with page.expect_response("**/api/me/preferences"):
        page.get_by_label("Letters, digits and signs are keys").uncheck()
    page.goto(f"{server.url}/inspections/{inspection}")
    expect(page.locator("html.without-single-keys")).to_be_attached()
    expect_frame(page, 0)
    expect_read(page)
    before = page.locator(".defect").count()
    for key in ("t", "1", "s", "Shift+T", "?", "Shift+Digit3"):
        page.keyboard.press(key)
    page.locator(".quick__code", has_text="Crack").click()
    page.keyboard.press("a")
    expect(page.locator("#question-asked")).to_have_text("Kind")
    page.locator(".questions__one").focus()  # there the letters are its own
    page.keyboard.press("a")
    expect(page.locator("#question-asked")).to_have_text("Detail")
    page.keyboard.press("Escape")
    before += 1
    page.keyboard.press("ArrowRight")  # no letter
    expect_frame(page, 1)
    expect(page.locator(".defect")).to_have_count(before)
    expect(page.locator(".quick kbd").first).to_be_hidden()
    page.get_by_role("button", name="Keys").click()
    expect(keys.locator("kbd", has_text=re.compile("^(T|1|S|[?])$"))).to_have_count(0)
    expect(keys.locator("kbd", has_text="F13")).to_be_visible()
    page.keyboard.press("Escape")
    page.get_by_role("tab", name="History").click()
    expect(page.locator("history-panel kbd")).to_have_text("Ctrl + Z")


def test_a_key_is_changed_beside_its_action_unless_another_one_has_it(
    page: Page, server: Server, inspection: str
) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    expect_frame(page, 0)
    page.keyboard.press("?")
    sheet = page.get_by_role("dialog", name="Keys")
    tag = sheet.get_by_role("button", name=re.compile("^T: change the key of “Tag"))
    tag.click()
    page.keyboard.press("n")
    expect(sheet.get_by_role("alert")).to_contain_text("N does something already: Next defect")
    tag.click()
    page.keyboard.press("5")
    expect(sheet.get_by_role("alert")).to_contain_text("5 is needed by codes")
    expect_no_fault(page, within="dialog[open]")
    tag.click()
    with page.expect_response("**/api/me/preferences"):
        page.keyboard.press("x")
    expect(
        sheet.get_by_role("button", name=re.compile("^X: change the key of “Tag"))
    ).to_be_focused()
    with page.expect_navigation():  # every button names its key
        page.keyboard.press("Escape")

    expect(page.locator(".quick kbd").first).to_have_text("X")
    expect_frame(page, 0)
    expect_read(page)
    before = page.locator(".defect").count()
    page.keyboard.press("t")
    page.keyboard.press("x")
    expect(page.locator(".defect")).to_have_count(before + 1)

    page.keyboard.press("Escape")
    page.keyboard.press("?")
    with page.expect_response("**/api/me/preferences"):
        sheet.get_by_role("button", name="Usual keys").click()
    expect(tag).to_be_visible()
    chosen = json.load(server.ask("GET", "/api/me"))["preferences"]
    assert chosen["keys"] == {}
