"""No page has a fault that axe-core finds; each fits every screen and a glove."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from desks import WITHOUT_WEBGL, show_more
from looks import COLOUR_RULES, expect_no_fault, faults
from playwright.sync_api import Browser, Page, expect
from steps import TOKEN, Server, log_in
from surveys import Survey

PAGES = (
    "/", "/inspections", "/new", "/assets", "/assets/register", "/assets/projects", "/find",
    "/films", "/films/add", "/films/rules", "/films/quality", "/settings", "/settings/access",
)  # fmt: skip
GLOVE_PX = 43.9
"""44, less what layout rounds away."""


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(narrow: Survey) -> str:
    return narrow.id


@pytest.fixture
def touched(browser: Browser) -> Iterator[Page]:
    """A tablet: its pointer is a finger, perhaps in a glove."""
    context = browser.new_context(has_touch=True)
    context.add_init_script(WITHOUT_WEBGL)
    yield context.new_page()
    context.close()


def test_log_in_menu_help_and_settings(page: Page, server: Server) -> None:
    page.goto(server.url)
    expect_no_fault(page)
    token = page.get_by_label("Access code")
    token.fill("not the token")
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("alert")).to_contain_text("not known here")
    expect_no_fault(page, within="form")
    token.fill(TOKEN)
    page.get_by_role("button", name="Log in").click()
    page.get_by_label("Menu").click()
    expect_no_fault(page, within="person-menu")
    page.get_by_role("button", name="Help").click()
    expect(page.get_by_role("dialog")).to_be_visible()
    expect_no_fault(page, within="dialog[open]")
    page.keyboard.press("Escape")
    expect_no_fault(page)
    page.get_by_role("link", name="Settings").click()
    page.get_by_role("combobox", name="Key 9").fill("crack")
    expect(page.get_by_role("listbox")).to_be_visible()
    expect_no_fault(page)


def test_new_inspection(page: Page, server: Server) -> None:
    log_in(page, server, "/new")
    page.get_by_role("button", name="Start tracking").click()
    expect(page.get_by_text("Choose the video first.")).to_be_visible()
    for folded in page.locator(".rig__expert summary").all():
        folded.click()
    expect_no_fault(page)
    page.get_by_label("Live camera").check()
    page.get_by_role("button", name="Start recording").click()
    expect(page.get_by_text("Type the address of the camera")).to_be_visible()
    expect_no_fault(page, ("light",), within="source-picker")


def test_inspection(page: Page, server: Server, inspection: str) -> None:
    """Other panels and dialogs are looked at where they are used."""
    log_in(page, server, f"/inspections/{inspection}")
    expect(page.locator(".chip")).to_contain_text("Done")
    expect(page.locator(".readout__distance")).to_contain_text("0.00")
    expect_no_fault(page)
    page.emulate_media(contrast="more")
    for scheme in ("dark", "light"):
        page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
        assert faults(page, COLOUR_RULES) == [], scheme
    page.emulate_media(contrast="no-preference")
    page.keyboard.press("g")
    page.get_by_role("textbox", name="Distance, time, frame or joint").fill("far away")
    page.keyboard.press("Enter")
    expect(page.get_by_role("dialog").get_by_role("alert")).not_to_be_empty()
    expect_no_fault(page, within="dialog[open]")
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_have_count(0)  # it would take the key
    page.keyboard.press("1")
    expect(page.locator(".questions__one")).to_be_visible()
    expect_no_fault(page, within="defect-form")
    page.keyboard.press("@")
    expect(page.locator("clock-dial")).to_be_visible()
    show_more(page)
    expect_no_fault(page, within="defect-form")
    page.keyboard.press("Escape")
    page.keyboard.press("t")
    expect(page.locator(".defect").nth(1)).to_be_visible()
    page.keyboard.press("e")
    page.get_by_label("Code", exact=True).fill("crack")
    expect(page.get_by_role("listbox")).to_be_visible()
    expect_no_fault(page, within="defect-form")
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    page.get_by_role("tab", name="Header").click()
    page.get_by_text("More fields").click()
    expect_no_fault(page, within="header-panel")
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_be_visible()
    expect_no_fault(page, within="dialog[open]")


TOO_SMALL = """least => [...document.querySelectorAll(
  'button, summary, input, select, textarea, [role=slider], [role=option], [role=tab], nav a')]
  .filter(element => element.checkVisibility({ visibilityProperty: true, opacityProperty: true }))
  .map(element => [element, (element.closest('label') ?? element).getBoundingClientRect()])
  .filter(([, { width, height }]) => width > 0 && (height < least || width < least))
  .map(([element, { width, height }]) => `${element.outerHTML.slice(0, 90)} ${width} x ${height}`)
"""


WIDTHS = (360, 3840, 1440, 820)
"""Of the window as it is opened, and then."""
FITS = "width => document.documentElement.scrollWidth <= width"


def test_every_page_fits_its_window_and_every_target_a_glove(
    touched: Page, server: Server, inspection: str
) -> None:
    """As it is opened in a narrow window, and in a wide one that is made narrower step by step."""
    log_in(touched, server, "/healthz")
    assert touched.evaluate("matchMedia('(pointer: coarse)').matches")
    for path in (*PAGES, f"/inspections/{inspection}"):
        touched.set_viewport_size({"width": WIDTHS[0], "height": 1180})
        touched.goto(server.url + path)
        expect(touched.locator("main")).to_be_visible()
        for width in WIDTHS:
            touched.set_viewport_size({"width": width, "height": 1180})
            touched.wait_for_function(FITS, arg=width)
        touched.locator("person-menu summary").click()
        assert touched.evaluate(TOO_SMALL, GLOVE_PX) == []
    for tab in touched.get_by_role("tab").all():
        tab.click()
        assert touched.evaluate(TOO_SMALL, GLOVE_PX) == []
