"""The browser of the scripts: with the flags of the tests."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from conftest import CHROMIUM_FLAGS, installed_chromium
from playwright.sync_api import Browser, sync_playwright


@contextmanager
def chromium() -> Iterator[Browser]:
    """Run a headless Chromium until the block ends."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=installed_chromium(), args=CHROMIUM_FLAGS
        )
        yield browser
        browser.close()
