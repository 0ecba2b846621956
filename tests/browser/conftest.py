"""A real server process over a temporary data folder, and a real Chromium that looks at it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, expect, sync_playwright
from steps import Server

CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
# WebGL in software, as in the notes on viser; no other combination draws the 3D view everywhere.
CHROMIUM_FLAGS = ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"]


# Other workers of the same test run may have both cores.
expect.set_options(timeout=20_000)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(tmp_path_factory.mktemp("data")) as running:
        yield running


def _installed_chromium() -> str | None:
    found = next((path for name in CHROMIUM if (path := shutil.which(name))), None)
    if found is None and os.geteuid() == 0 and shutil.which("apt-get"):
        subprocess.run(["apt-get", "update", "-q"], check=True)
        subprocess.run(["apt-get", "install", "-y", "-q", "chromium"], check=True)
        found = shutil.which("chromium")
    return found


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        path = _installed_chromium()
        if path is None and not Path(playwright.chromium.executable_path).exists():
            subprocess.run([sys.executable, "-m", "playwright", "install", "chromium"], check=False)
            if not Path(playwright.chromium.executable_path).exists():
                pytest.fail(
                    "There is no Chromium. Install it with `apt-get install chromium` or "
                    "`playwright install chromium`, then run the browser tests again."
                )
        running = playwright.chromium.launch(executable_path=path, args=CHROMIUM_FLAGS)
        yield running
        running.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A new browser window; a script error or a violated content policy fails the test."""
    context = browser.new_context(viewport={"width": 1440, "height": 900}, accept_downloads=True)
    page = context.new_page()
    page.set_default_timeout(20_000)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.extend(_ours(str(error))))
    page.on("console", lambda message: faults.extend(_faults_in(message)))
    yield page
    context.close()
    assert not faults, faults


def _ours(error: str) -> list[str]:
    """viser's client tries eval once a load, and our policy of its page refuses it."""
    return [] if "'wasm-unsafe-eval'" in error else [error]


def _faults_in(message: ConsoleMessage) -> list[str]:
    """Errors of our own pages; viser's client in its frame is not ours."""
    is_ours = "/viewer/" not in message.location["url"]
    # Refused requests and a server that is away are what some tests are about.
    is_network = "Failed to load resource" in message.text or "net::ERR_" in message.text
    is_fault = message.type == "error" and not is_network
    return [message.text] if is_ours and is_fault else []
