"""Pictures of every page in three widths and both themes: `python tests/measure screenshots DIR`.

Not a test: for a person to look at.  The film that heads the README is made by
`film_of_the_desk.py`.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import monotonic
from typing import Any, Literal
from urllib.parse import urlsplit

from desks import show_more
from playwright.sync_api import Browser, Page, expect
from steps import Server, log_in

from measure.chromium import chromium

WIDTHS = {360: 800, 1280: 800, 1920: 1080}
THEMES: tuple[Literal["dark", "light"], ...] = ("dark", "light")
SAMPLE_LIMIT_S = 600
LIMIT_MS = 60_000
STILL_3D_LIMIT_S = 90
DRAWN_BYTES = 20_000
"""A PNG of the culvert is larger, one of an empty view smaller."""
TABS = {
    "Defects": ".defect",
    "Header": "header-form .field",
    "Corrections": ".class",
    "Checks": ".check",
    "History": ".event",
}
"""The tabs, each with an element that exists once it is filled."""

Show = Callable[[Page, str], None]
"""Brings a logged-in page to the state of the picture; gets the path of the sample inspection."""


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("folder", type=Path)
    options = arguments.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    expect.set_options(timeout=LIMIT_MS)
    with (
        tempfile.TemporaryDirectory() as data,
        Server(Path(data)) as server,
        chromium() as browser,
    ):
        sample = f"/inspections/{tracked_sample(server)}"
        for width, height in WIDTHS.items():
            for theme in THEMES:
                _picture_all(browser, server, sample, (width, height), theme, options.folder)


def _picture_all(
    browser: Browser,
    server: Server,
    sample: str,
    size: tuple[int, int],
    theme: Literal["dark", "light"],
    folder: Path,
) -> None:
    page = open_page(browser, size, theme)
    page.goto(server.url)
    expect(page.get_by_label("Access code")).to_be_visible()
    page.screenshot(path=folder / f"login-{size[0]}-{theme}.png")
    log_in(page, server)
    for name, show in PICTURES.items():
        show(page, sample)
        page.screenshot(path=folder / f"{name}-{size[0]}-{theme}.png")
        for _ in range(2):  # what lies over the page, and what that lay over
            page.keyboard.press("Escape")
    page.context.close()


def open_page(browser: Browser, size: tuple[int, int], theme: Literal["dark", "light"]) -> Page:
    width, height = size
    context = browser.new_context(
        viewport={"width": width, "height": height}, color_scheme=theme, reduced_motion="reduce"
    )
    page = context.new_page()
    page.set_default_timeout(LIMIT_MS)
    return page


# What is pictured ----------------------------------------------------------------------------


def _show_list(page: Page, _sample: str) -> None:
    _go(page, "/inspections")
    expect(page.locator(".chip").first).to_be_visible()


def _show_new_file(page: Page, _sample: str) -> None:
    _go(page, "/new")
    page.get_by_label("Camera and mount").select_option("preset 0")


def _show_new_live(page: Page, _sample: str) -> None:
    _show_new_file(page, _sample)
    page.get_by_text("Live camera").click()
    expect(page.get_by_label("Address of the camera")).to_be_visible()


def _show_compare(page: Page, sample: str) -> None:
    identifier = sample.rsplit("/", 1)[1]
    _go(page, f"/compare?a={identifier}")
    expect(page.get_by_label("Run A")).to_have_value(identifier)


def _show_settings(page: Page, _sample: str) -> None:
    _go(page, "/settings")
    expect(page.get_by_role("combobox", name="Key 9")).to_be_visible()


def _show_help(page: Page, _sample: str) -> None:
    page.get_by_label("Menu").click()
    page.get_by_role("button", name="Help").click()
    expect(page.get_by_role("dialog")).to_be_visible()


def _show_keys(page: Page, sample: str) -> None:
    _show_inspection(page, sample)
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_be_visible()


def _show_inspection(page: Page, sample: str) -> None:
    _go(page, sample)
    page.get_by_role("tab", name="Defects").click()
    _show_a_defect(page)


def _show_tab(name: str) -> Show:
    def show(page: Page, sample: str) -> None:
        _show_inspection(page, sample)
        page.get_by_role("tab", name=name).click()
        expect(page.locator(TABS[name]).first).to_be_visible()
        page.get_by_role("tab", name=name).scroll_into_view_if_needed()

    return show


def _show_form(page: Page, sample: str) -> None:
    _show_inspection(page, sample)
    page.keyboard.press("e")
    expect(page.get_by_label("Code", exact=True)).to_be_focused()


def _show_asked(page: Page, sample: str) -> None:
    _show_inspection(page, sample)
    page.keyboard.press("3")
    expect(page.locator(".question__choice").first).to_be_visible()


def _show_photo(page: Page, sample: str) -> None:
    _show_form(page, sample)
    show_more(page)
    page.get_by_role("button", name="Open the photo").click()
    expect(page.get_by_role("dialog").get_by_role("img")).to_be_visible()


def _show_finish(page: Page, sample: str) -> None:
    _show_inspection(page, sample)
    page.get_by_role("button", name="Finish", exact=True).click()
    expect(page.get_by_role("dialog")).to_be_visible()


PICTURES: dict[str, Show] = {
    "list": _show_list,
    "new-file": _show_new_file,
    "new-live": _show_new_live,
    "compare": _show_compare,
    "settings": _show_settings,
    "help": _show_help,
    "keys": _show_keys,
    **{f"inspection-{name.lower()}": _show_tab(name) for name in TABS},
    "form": _show_form,
    "asked": _show_asked,
    "photo": _show_photo,
    "finish": _show_finish,
}


def _show_a_defect(page: Page) -> None:
    """Select the second defect, in the middle of the run; wait for all pictures."""
    expect(page.locator(".defect")).not_to_have_count(0)
    page.locator(".defect__main").nth(1).click()
    expect(page.locator(".defect [aria-current=true]")).to_have_count(1)
    expect(page.locator(".stage__note")).to_be_hidden()
    page.wait_for_function("() => document.querySelector('wall-strip')?.pictures?.count > 0")
    page.wait_for_function(
        "() => [...document.images].every((image) => image.complete || !image.checkVisibility())"
    )
    wait_for_still_3d_view(page)


def wait_for_still_3d_view(page: Page, drawn_bytes: int = DRAWN_BYTES) -> None:
    """Wait until two consecutive pictures of the view are equal and show more than a background."""
    view = page.locator("viewer-panel iframe")
    expect(view.content_frame.locator("canvas").first).to_be_visible()
    deadline, last = monotonic() + STILL_3D_LIMIT_S, b""
    while (now := view.screenshot()) != last or len(now) < drawn_bytes:
        assert monotonic() < deadline, "The 3D view did not come to rest."
        last = now


def _go(page: Page, path: str) -> None:
    """Go to a path unless the page is there."""
    here = urlsplit(page.url)
    if here.path != path:
        page.goto(f"{here.scheme}://{here.netloc}{path}")


# What it needs ---------------------------------------------------------------------------------


def tracked_sample(server: Server) -> str:
    """Render and track the sample inspection; return its id."""
    server.ask("POST", "/api/samples")
    deadline = monotonic() + SAMPLE_LIMIT_S
    sample: dict[str, Any] = {}
    while sample.get("state") != "ready":
        assert monotonic() < deadline, sample
        sample = json.load(server.ask("GET", "/api/samples"))
        assert sample["error"] is None, sample
    inspection: dict[str, Any] = {}
    while inspection.get("status") != "done":
        assert monotonic() < deadline, inspection
        inspection = json.load(server.ask("GET", f"/api/inspections/{sample['inspection_id']}"))
    return str(sample["inspection_id"])


if __name__ == "__main__":
    main()
