"""A real server process over a temporary data folder, and a window of Chromium that looks at it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from urllib.parse import urlsplit

import pytest
from clip_surveys import clip_survey, several_clips
from clips import rig_for_clip, wide_rig
from desks import WITHOUT_WEBGL
from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, expect
from playwright.sync_api import TimeoutError as TooLate
from steps import Server
from surveys import Survey, another

PATIENCE_MS = 60_000
"""Other workers of the same test run may have both cores."""
CLOSES, CLOSE_MS = 20, 3000
"""How often Chromium is asked to close a page, and how long each time may take."""
STORES = "local_storage,indexeddb,cache_storage"
"""What a page keeps in the browser, beside cookies."""

expect.set_options(timeout=PATIENCE_MS)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(tmp_path_factory.mktemp("data")) as running:
        yield running


@pytest.fixture(scope="session")
def narrow_server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One for all tests on that clip: each file has an inspection of its own there."""
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(narrow: Survey, narrow_server: Server) -> str:
    """On that server, without any tag."""
    return another(narrow, narrow_server)


@pytest.fixture(scope="session")
def window(browser: Browser) -> Iterator[BrowserContext]:
    """One window for all tests: the files of the page are loaded once, like for a real user."""
    context = browser.new_context(viewport={"width": 1440, "height": 900}, accept_downloads=True)
    context.set_default_timeout(PATIENCE_MS)
    yield context
    context.close()


@pytest.fixture(scope="session")
def keeper(window: BrowserContext) -> Page:
    """An empty page, open as long as the window: the pages of all tests share its process, which
    has compiled their scripts and need not be started again.
    """
    page = window.new_page()
    page.route("**/*", lambda route: route.fulfill(body=""))
    page.goto("http://127.0.0.1/")
    return page


@pytest.fixture
def page(window: BrowserContext, keeper: Page, request: pytest.FixtureRequest) -> Iterator[Page]:
    """A page of a first-time visitor; a script error or a violated policy fails the test.

    Without the mark `webgl` it cannot draw in 3D, for which software takes a core.
    """
    page = window.new_page()
    if request.node.get_closest_marker("webgl") is None:
        page.add_init_script(WITHOUT_WEBGL)
    faults: list[str] = []
    seen: set[str] = set()
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.extend(_faults_in(message)))
    page.on("framenavigated", lambda frame: seen.add(frame.url))
    yield page
    for opened in window.pages:
        if opened is not keeper:
            _close(opened)
    window.set_offline(False)
    window.unroute_all()
    _forget(keeper, seen)
    assert not faults, faults


def _close(page: Page) -> None:
    """Close a page, at the latest when it has loaded what it is about to show.

    Chromium may forget to close a page that is between two documents; Playwright's own `close`
    asks once and waits without a limit.
    """
    session = page.context.new_cdp_session(page)
    target = session.send("Target.getTargetInfo")["targetInfo"]["targetId"]
    assert page.context.browser is not None
    browser = page.context.browser.new_browser_cdp_session()
    for _ in range(CLOSES):
        if page.is_closed():
            break
        with suppress(TooLate), page.expect_event("close", timeout=CLOSE_MS):
            browser.send("Target.closeTarget", {"targetId": target})
    assert page.is_closed(), f"Chromium does not close {page.url}."
    browser.detach()


def _forget(keeper: Page, urls: Iterable[str]) -> None:
    """Make the next visitor a first-time one, whose browser has the files of the page already.

    Playwright's own `set_storage_state` drops these files, and visits each origin without a limit.
    """
    keeper.context.clear_cookies()
    session = keeper.context.new_cdp_session(keeper)
    for origin in {url._replace(path="", query="", fragment="") for url in map(urlsplit, urls)}:
        if origin.netloc:
            stores = {"origin": origin.geturl(), "storageTypes": STORES}
            session.send("Storage.clearDataForOrigin", stores)
    session.detach()


def _faults_in(message: ConsoleMessage) -> list[str]:
    """Return errors of our own pages; viser's client in its frame is not ours."""
    is_ours = "/viewer/" not in message.location["url"]
    # Refused requests and an unreachable server are the subject of some tests.
    is_network = "Failed to load resource" in message.text or "net::ERR_" in message.text
    is_fault = message.type == "error" and not is_network
    return [message.text] if is_ours and is_fault else []


@pytest.fixture(scope="session")
def narrow(tmp_path_factory: pytest.TempPathFactory) -> Survey:
    """A tracked clip in a pipe of 300 mm."""
    return clip_survey(tmp_path_factory, "narrow", rig_for_clip)


@pytest.fixture(scope="session")
def wide(tmp_path_factory: pytest.TempPathFactory) -> Survey:
    """A tracked clip in a culvert so wide that it drives two metres."""
    return clip_survey(tmp_path_factory, "wide", wide_rig)


@pytest.fixture(scope="session")
def several(tmp_path_factory: pytest.TempPathFactory) -> Survey:
    """Tracked inspections of one short clip."""
    return several_clips(tmp_path_factory)
