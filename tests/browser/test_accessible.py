"""No page has a fault that axe-core finds, in either colour scheme."""

from __future__ import annotations

from typing import Literal

import pytest
from axe_playwright_python.sync_playwright import Axe
from clips import numbered_clip, rig_for_clip
from playwright.sync_api import Page, expect
from steps import Server, log_in

# viser's client in its frame is not ours to mend.
OPTIONS = {"iframes": False}


@pytest.fixture(scope="module")
def inspection(server: Server, tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("clip")
    clip = numbered_clip(folder / "clip.mp4", "libx264", frames=30)
    return server.track(clip, rig_for_clip(folder / "rig.json"))


def expect_no_fault(
    page: Page, schemes: tuple[Literal["dark", "light"], ...] = ("dark", "light")
) -> None:
    for scheme in schemes:
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
        results = Axe().run(page, options=OPTIONS)
        assert results.violations_count == 0, results.generate_report()


def test_log_in(page: Page, server: Server) -> None:
    page.goto(server.url)
    expect_no_fault(page)
    page.get_by_label("Access token").fill("not the token")
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("alert")).to_contain_text("not known here")
    expect_no_fault(page)


def test_new_inspection(page: Page, server: Server) -> None:
    log_in(page, server)
    page.goto(server.url + "/new")
    expect_no_fault(page)
    page.get_by_role("button", name="Start tracking").click()
    expect(page.get_by_text("Choose the video first.")).to_be_visible()
    page.locator(".rig__fine summary").click()
    expect_no_fault(page)


def test_list(page: Page, server: Server, inspection: str) -> None:
    log_in(page, server)
    expect(page.locator(f"a[href='/inspections/{inspection}']")).to_be_visible()
    expect_no_fault(page)


def test_inspection(page: Page, server: Server, inspection: str) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    expect(page.locator(".chip")).to_have_text("Done")
    expect_no_fault(page)
    page.keyboard.press("1")
    page.keyboard.press("t")
    expect(page.locator(".defect")).to_have_count(2)
    page.get_by_text("Export", exact=True).click()
    expect_no_fault(page)
    page.keyboard.press("Escape")
    page.keyboard.press("e")
    page.get_by_label("Code", exact=True).fill("crack")
    expect(page.get_by_role("listbox")).to_be_visible()
    expect_no_fault(page)
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_be_visible()
    expect_no_fault(page)


@pytest.mark.parametrize("width", [360, 800, 1440, 3840])
def test_no_page_is_wider_than_its_window(
    page: Page, server: Server, inspection: str, width: int
) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    log_in(page, server)
    for path in ("/", "/new", f"/inspections/{inspection}"):
        page.goto(server.url + path)
        expect(page.locator("main")).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") <= width
