"""The map of assets: moved, narrowed, read by keyboard, with and without tiles."""

from __future__ import annotations

import json
import re
import threading
from collections.abc import Iterator
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np
import pytest
from builders import wait_until
from looks import expect_no_fault
from mapped_assets import Inspected, Registered, fill
from playwright.sync_api import Page, expect
from steps import Server, log_in

from app.storage.database.database import Database

MIDDLE = [101.69, 3.14]
REGISTER = [
    Registered("CV-01", [MIDDLE, [101.6902, 3.1402]], "North"),
    Registered("CV-02", [[101.9, 3.3]], "North"),
    Registered("CV-02b", [[101.9, 3.3]], "South"),
    Registered("CV-03", [[102.4, 3.9], [102.4003, 3.9]]),
    Registered("CV-04"),
]
INSPECTIONS = [
    Inspected("CV-01", "2024-05-02", (4, 1)),
    Inspected("CV-02", "2024-05-02", (2,)),
    Inspected("CV-05", "2023-05-02", (), None, {"start_lat": 3.5, "start_lon": 102.0}),
]
CENTRE = """() => {
  const box = document.querySelector('.map__sheet').getBoundingClientRect();
  return [box.left + box.width / 2, box.top + box.height / 2];
}"""
GREEN_BGR = (40, 160, 80)


class TileServer(BaseHTTPRequestHandler):
    """Green tiles; one row of them in four is missing."""

    def do_GET(self) -> None:
        is_missing = int(self.path.split("/")[3].partition(".")[0]) % 4 == 0
        tile = np.full((256, 256, 3), GREEN_BGR, np.uint8)
        with suppress(ConnectionError):  # the page no longer wants it
            self.send_response(404 if is_missing else 200)
            self.end_headers()
            self.wfile.write(b"" if is_missing else cv2.imencode(".png", tile)[1].tobytes())

    def log_message(self, *_: object) -> None:
        """Write nothing."""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with the assets above, and tiles of another server."""
    data = tmp_path_factory.mktemp("data")
    database = Database(data / "chainage.db")
    fill(database, REGISTER, INSPECTIONS)
    database.close()
    tiles = ThreadingHTTPServer(("127.0.0.1", 0), TileServer)
    threading.Thread(target=tiles.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{tiles.server_address[1]}/{{z}}/{{x}}/{{y}}.png"
    with Server(data, map_tiles=address, map_attribution="© Surveyors") as running:
        wait_until(lambda: json.load(running.ask("GET", "/api/map"))["pending"] == 0)
        yield running
    tiles.shutdown()
    tiles.server_close()


def test_assets_are_found_on_the_map_and_in_the_list_beside_it(page: Page, server: Server) -> None:
    log_in(page, server, "/assets/map")
    rows = page.locator(".map-list__row")
    expect(rows.locator("b")).to_have_text(["CV-01", "CV-02", "CV-02b", "CV-03", "CV-05"])
    expect(rows.first).to_contain_text("North · plan repair · ")
    expect(rows.nth(2)).to_contain_text("South · never inspected")
    expect(page.get_by_text("1 asset has no coordinates and is not on the map.")).to_be_visible()

    # tiles, of which some are missing
    expect(page.get_by_text("© Surveyors")).to_be_visible()
    expect(page.get_by_text("Part of the background map could not be loaded.")).to_be_visible()
    wait_until(lambda: 0.4 < (map_picture(page) == GREEN_BGR).all(axis=2).mean() < 0.9)
    expect_no_fault(page)

    # one is shown by keyboard; its card opens its page
    page.get_by_role("button", name="Show CV-01 on the map").focus()
    page.keyboard.press("Enter")
    expect(rows.locator("b")).to_have_text(["CV-01"])
    page.wait_for_url(re.compile(r"at=3\.1401\d%2C101\.6901\d%2C19"))
    centre = page.evaluate(CENTRE)
    page.mouse.move(*centre)
    card = page.get_by_role("group", name="Asset on the map")
    expect(card).to_contain_text("4 plan repair")
    expect(card).to_contain_text("1 inspection")
    page.mouse.move(centre[0] + 40, centre[1])
    expect(card.get_by_role("link", name="CV-01")).to_have_attribute("href", "/assets?asset=CV-01")
    page.mouse.move(centre[0], centre[1] + 200)
    expect(card).to_be_hidden()

    # the view is moved by keys and by the pointer, and the address keeps it
    page.get_by_role("application").focus()
    for key in ("-", "-", "ArrowRight"):
        page.keyboard.press(key)
    moved = re.compile("at=3.1401.*%2C17.64$")
    page.wait_for_url(lambda url: moved.search(url) is not None and lon_of(url) > 101.6904)
    page.mouse.move(*centre)
    page.mouse.down()
    page.mouse.move(centre[0] + 80, centre[1], steps=4)  # as far back as the arrow moved it
    page.mouse.up()
    page.wait_for_url(lambda url: lon_of(url) == pytest.approx(101.6901, abs=5e-5))

    # without its server the page still knows the place, also for the next reload
    before = page.url
    page.route("**/api/map?**", lambda route: route.abort())
    page.reload()
    expect(page.get_by_text("Trying again")).to_be_visible()
    expect(page.locator(".map-list")).to_have_text("Loading…")
    assert page.url == before
    page.unroute("**/api/map?**")
    expect(rows.locator("b")).to_have_text(["CV-01"])
    assert lon_of(page.url) == pytest.approx(lon_of(before), abs=1e-4)

    # two in one place are named
    page.keyboard.press("f")
    page.get_by_label("Project").select_option("North")
    expect(rows.locator("b")).to_have_text(["CV-01", "CV-02"])
    page.get_by_label("Worst grade from").select_option("3")
    expect(rows.locator("b")).to_have_text(["CV-01"])
    page.wait_for_url("**/assets/map?project=North&severity_from=3&at=*")
    page.get_by_label("Worst grade from").select_option("5")
    expect(page.get_by_text("No asset with coordinates fits.")).to_be_visible()
    page.get_by_label("Worst grade from").select_option("")
    page.get_by_label("Project").select_option("")
    page.get_by_role("button", name="Show CV-02b on the map").click()
    expect(rows).to_have_count(2)
    page.mouse.click(*page.evaluate(CENTRE))
    expect(card.get_by_role("link")).to_have_text(["CV-02", "CV-02b"])
    page.keyboard.press("Escape")
    expect(card).to_be_hidden()

    # tiles that were missing are asked for again once there is a network
    note = page.get_by_text("Part of the background map could not be loaded.")
    expect(note).to_be_visible()
    tile = cv2.imencode(".png", np.full((256, 256, 3), GREEN_BGR, np.uint8))[1].tobytes()
    page.route(re.compile(r"\.png$"), lambda route: route.fulfill(body=tile))
    page.evaluate("dispatchEvent(new Event('online'))")
    expect(note).to_be_hidden()

    # two fingers, twice as far apart at the end
    twice = zoom_of(page.url) + 1
    x, y = page.evaluate(CENTRE)
    fingers = page.context.new_cdp_session(page)
    for kind, apart in (("Start", 50), ("Move", 60), ("Move", 100), ("End", None)):
        points = [] if apart is None else [{"x": x - apart, "y": y}, {"x": x + apart, "y": y}]
        fingers.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": points})
    page.wait_for_url(lambda url: zoom_of(url) == pytest.approx(twice, abs=0.05))


def map_picture(page: Page) -> np.ndarray:
    """What the screen shows of the map: the page itself may not read foreign tiles."""
    png = page.locator("map-canvas").screenshot()
    return cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)


def lon_of(url: str) -> float:
    return float(url.partition("at=")[2].split("%2C")[1])


def zoom_of(url: str) -> float:
    return float(url.rpartition("%2C")[2])


def test_a_map_without_assets_says_how_they_get_there_and_one_asset_has_a_picture(
    page: Page, server: Server
) -> None:
    nothing = {"assets": [], "placed": 0, "unplaced": 3, "projects": [], "pending": 0}
    page.route(re.compile(r"/api/map\?$"), lambda route: route.fulfill(json=nothing))
    log_in(page, server, "/assets/map")
    expect(page.get_by_role("heading", name="No asset has coordinates yet")).to_be_visible()
    expect(page.get_by_text("Latitude of the start")).to_be_visible()
    expect(page.get_by_role("link", name="Register of assets")).to_be_visible()

    shown = page.locator("asset-map")
    page.evaluate(
        """async () => {
          const main = document.querySelector('main');
          main.replaceChildren(document.createElement('asset-map'));
          main.firstChild.show(await (await fetch('/api/map?asset=CV-01')).json());
        }"""
    )
    expect(page.get_by_role("img", name="Where CV-01 lies")).to_be_visible()
    expect(shown).to_contain_text("Start 3.140000, 101.690000")
    expect(shown).to_contain_text("End 3.140200, 101.690200")
    expect(shown).to_contain_text("© Surveyors")
    expect(shown.get_by_role("link")).to_have_attribute("href", re.compile(r"\?at=3\.1401"))
    page.evaluate("document.querySelector('asset-map').show({ assets: [] })")
    expect(shown).to_have_text("The coordinates of this asset are not known.")
