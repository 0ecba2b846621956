"""No page has a fault that axe-core finds; each fits every screen and a glove."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from clips import numbered_clip, rig_for_clip
from looks import expect_no_fault
from playwright.sync_api import Browser, Page, expect
from steps import TOKEN, Server, log_in
from surveys import Survey

ARCHIVE = [
    f"/archive{part}"
    for part in ("", "/add", "/rules", "/defects", "/projects", "/assets", "/register", "/quality")
]
GLOVE_PX = 43.9
"""44, less what layout rounds away."""


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(narrow: Survey) -> str:
    return narrow.id


@pytest.fixture(scope="module")
def other(server: Server, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A second run, to compare with."""
    folder = tmp_path_factory.mktemp("other")
    clip = numbered_clip(folder / "other.mp4", "libx264", frames=10)
    return server.track(clip, rig_for_clip(folder / "rig.json"))


@pytest.fixture
def touched(browser: Browser) -> Iterator[Page]:
    """A tablet: its pointer is a finger, perhaps in a glove."""
    context = browser.new_context(
        viewport={"width": 820, "height": 1180}, has_touch=True, is_mobile=True
    )
    yield context.new_page()
    context.close()


def test_log_in(page: Page, server: Server) -> None:
    page.goto(server.url)
    expect_no_fault(page)
    page.get_by_label("Access token").fill("not the token")
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("alert")).to_contain_text("not known here")
    expect_no_fault(page, within="form")


def test_new_inspection(page: Page, server: Server) -> None:
    log_in(page, server)
    page.goto(server.url + "/new")
    expect_no_fault(page)
    page.get_by_role("button", name="Start tracking").click()
    expect(page.get_by_text("Choose the video first.")).to_be_visible()
    for folded in page.locator(".rig__fine summary").all():
        folded.click()
    expect_no_fault(page)
    page.get_by_label("Live camera").check()
    page.get_by_role("button", name="Start recording").click()
    expect(page.get_by_text("Type the address of the camera")).to_be_visible()
    expect_no_fault(page, ("light",))


def test_comparison(page: Page, server: Server, inspection: str, other: str) -> None:
    log_in(page, server, f"/compare?a={inspection}")
    expect(page.get_by_label("Run B")).to_be_visible()
    expect_no_fault(page)
    page.get_by_label("Run B").select_option(other)
    expect(page.locator(".compare__stage canvas")).to_have_count(2)
    expect_no_fault(page)


def test_list(page: Page, server: Server, inspection: str) -> None:
    log_in(page, server)
    expect(page.locator(f"a[href='/inspections/{inspection}']")).to_be_visible()
    expect_no_fault(page)
    page.get_by_role("button", name="Delete clip").click()
    expect(page.get_by_role("dialog")).to_be_visible()
    expect_no_fault(page, within="dialog[open]")


def test_menu_and_settings(page: Page, server: Server) -> None:
    log_in(page, server)
    page.get_by_label("Menu").click()
    expect_no_fault(page, within="person-menu")
    page.get_by_role("button", name="Help").click()
    expect(page.get_by_role("dialog")).to_be_visible()
    expect_no_fault(page, within="dialog[open]")
    page.keyboard.press("Escape")
    page.get_by_label("Menu").click()
    page.get_by_role("button", name="Settings").click()
    page.get_by_role("combobox", name="Key 9").fill("crack")
    expect(page.get_by_role("listbox")).to_be_visible()
    expect_no_fault(page, within="dialog[open]")


def test_in_malay(page: Page, server: Server, inspection: str) -> None:
    page.add_init_script("""localStorage.setItem('chainage.preferences', '{"language":"ms"}')""")
    page.route("**/api/me", lambda route: route.abort())  # the server has no say in it here
    page.goto(server.url)
    expect_no_fault(page)
    page.get_by_label("Token akses").fill(TOKEN)
    page.get_by_role("button", name="Log masuk").click()
    expect(page.get_by_role("heading", name="Pemeriksaan", level=1)).to_be_visible()
    for path in ("/new", f"/inspections/{inspection}"):
        page.goto(server.url + path)
        expect(page.get_by_role("heading", level=1)).to_be_visible()
        expect_no_fault(page, ("light",))


def test_inspection(page: Page, server: Server, inspection: str) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    expect(page.locator(".chip")).to_have_text("Done")
    expect_no_fault(page)
    page.emulate_media(contrast="more")
    expect_no_fault(page)
    page.emulate_media(contrast="no-preference")
    page.keyboard.press("1")
    page.keyboard.press("t")
    expect(page.locator(".defect").nth(1)).to_be_visible()
    page.get_by_text("Export", exact=True).click()
    expect_no_fault(page, within="desk-bar")
    page.keyboard.press("Escape")
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


def test_panels_and_dialogs_of_an_inspection(page: Page, server: Server, inspection: str) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    expect(page.locator(".readout__distance")).to_contain_text("0.00")
    page.keyboard.press("1")
    expect(page.locator(".defect [aria-current=true]")).to_have_count(1)
    for tab in ("Corrections", "Checks", "History"):
        page.get_by_role("tab", name=tab).click()
        expect(page.get_by_role("tabpanel", name=tab)).to_be_visible()
        expect_no_fault(page, within=f"{tab.lower()}-panel")
    page.keyboard.press("e")
    page.get_by_role("button", name="Open the photo").click()
    expect(page.get_by_role("dialog").get_by_role("img")).to_be_visible()
    expect_no_fault(page, within="dialog[open]")
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    page.keyboard.press("g")
    page.get_by_role("textbox", name="Distance, time, frame or joint").fill("far away")
    page.keyboard.press("Enter")
    expect(page.get_by_role("dialog").get_by_role("alert")).not_to_be_empty()
    expect_no_fault(page, within="dialog[open]")
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Finish", exact=True).click()
    page.get_by_role("dialog").get_by_label("Abandoned", exact=True).check()
    expect(page.get_by_label("Why it was abandoned")).to_be_visible()
    expect_no_fault(page, within="dialog[open]")


TOO_SMALL = """least => [...document.querySelectorAll(
  'button, summary, input, select, textarea, [role=slider], [role=option], [role=tab], nav a')]
  .filter(element => element.checkVisibility({ visibilityProperty: true, opacityProperty: true }))
  .map(element => [element, (element.closest('label') ?? element).getBoundingClientRect()])
  .filter(([, { width, height }]) => width > 0 && (height < least || width < least))
  .map(([element, { width, height }]) => `${element.outerHTML.slice(0, 90)} ${width} x ${height}`)
"""


def test_every_target_is_large_enough_for_a_glove(
    touched: Page, server: Server, inspection: str
) -> None:
    log_in(touched, server)
    for path in ("/", "/new", *ARCHIVE, f"/inspections/{inspection}"):
        touched.goto(server.url + path)
        touched.locator("person-menu summary").click()
        assert touched.evaluate(TOO_SMALL, GLOVE_PX) == []
    for tab in touched.get_by_role("tab").all():
        tab.click()
        assert touched.evaluate(TOO_SMALL, GLOVE_PX) == []


WIDTHS = (360, 3840, 1440, 800)
"""Of the window as it is opened, and then."""
FITS = "width => document.documentElement.scrollWidth <= width"


def test_no_page_is_wider_than_its_window(page: Page, server: Server, inspection: str) -> None:
    """As it is opened in a narrow one, and in a wide one that is made narrower step by step."""
    log_in(page, server, "/healthz")
    for path in ("/", "/new", *ARCHIVE, f"/inspections/{inspection}"):
        page.set_viewport_size({"width": WIDTHS[0], "height": 900})
        page.goto(server.url + path)
        expect(page.locator("main")).to_be_visible()
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 900})
            page.wait_for_function(FITS, arg=width)
