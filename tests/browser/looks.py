"""How a page looks to those who see it differently: the faults that axe-core finds."""

from __future__ import annotations

from typing import Literal

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

# viser's client in its frame is not ours to mend.
OPTIONS = {"iframes": False}


def expect_no_fault(
    page: Page, schemes: tuple[Literal["dark", "light"], ...] = ("dark", "light")
) -> None:
    """In no scheme of colours."""
    for scheme in schemes:
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
        results = Axe().run(page, options=OPTIONS)
        assert results.violations_count == 0, results.generate_report()
