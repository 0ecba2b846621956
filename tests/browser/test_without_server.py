"""The page opens while the server cannot be reached, as far as this browser has read it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from builders import wait_until
from desks import WITHOUT_WEBGL, expect_read, expect_saved, observations
from playwright.sync_api import Browser, Page, expect
from steps import Server, log_in
from surveys import Survey

# The page, its two bundles and its words are kept, and so is what an inspection consists of.
IS_KEPT = """async (id) => {
  const paths = [];
  for (const name of await caches.keys()) {
    const requests = await (await caches.open(name)).keys();
    paths.push(...requests.map(({ url }) => new URL(url).pathname));
  }
  const data = ['', '/observations', '/track'].map((part) => `/api/inspections/${id}${part}`);
  const files = ['/page.js', '/page.css', '/words/en.json'];
  const ends = [...data, '/api/header-fields', '/api/packs', ...files];
  return ends.every((end) => paths.some((path) => path.endsWith(end)));
}"""
NAMES_A_PERSON = "async () => Boolean(await caches.match('/'))"
NAMES = "async () => (await caches.keys()).sort()"


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture
def installed(browser: Browser) -> Iterator[Page]:
    """A page whose service worker may keep it."""
    context = browser.new_context(
        viewport={"width": 1024, "height": 768}, service_workers="allow", locale="en-US"
    )
    context.add_init_script(WITHOUT_WEBGL)
    yield context.new_page()
    context.close()


def test_an_inspection_opens_and_takes_changes_without_the_server(
    installed: Page, server: Server, narrow: Survey
) -> None:
    inspection = narrow.id
    path = f"/inspections/{inspection}"
    server.ask(
        "PUT",
        f"/api{path}/observations/0123abcd-0000-4000-8000-00000000cafe",
        {"frame": 4, "code": "BAB"},
    )
    page = installed
    log_in(page, server)
    page.wait_for_function("() => navigator.serviceWorker.controller")
    page.goto(server.url + path)
    expect_read(page)
    page.get_by_role("tab", name="Header").click()
    page.get_by_role("tab", name="Defects").click()
    wait_until(lambda: page.evaluate(IS_KEPT, inspection))

    server.kill()
    page.reload()
    banner = page.locator(".banner")
    expect(banner).to_contain_text(
        "The server cannot be reached. You see what this browser kept at"
    )
    page.get_by_role("tab", name="Header").click()
    expect(page.locator("#header-asset_id")).to_be_visible()
    page.get_by_role("tab", name="Defects").click()
    page.locator(".defect__main").click()
    page.keyboard.press("Shift+Digit4")
    expect(page.locator(".save")).to_contain_text("1")
    page.reload()
    expect(page.locator(".save")).to_contain_text("1")

    server.start()
    expect(banner).to_contain_text("The server is back.")
    expect_saved(page)
    assert [item["severity"] for item in observations(server, inspection)] == [4]
    banner.get_by_role("button", name="Reload").click()
    expect_read(page)
    expect(page.locator(".banner")).to_have_count(0)

    page.get_by_label("Menu").click()
    page.get_by_role("button", name="Log out").click()
    page.wait_for_url("**/login")
    assert page.evaluate(NAMES) == ["chainage-page"]
    assert page.evaluate(NAMES_A_PERSON) is False
