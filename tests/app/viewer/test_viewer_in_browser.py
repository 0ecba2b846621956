"""The 3D view in a real browser: it is drawn, can be clicked, and asks no foreign server."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from builders import PATIENCE_S
from playwright.sync_api import Browser, Page
from viewer_client import Served, make_estimate

from app.viewer.pin import Pin
from app.viewer.wall import WallPictures, WallTile
from vo_core.mosaic.layout import UNSEEN_GREY, Layout

FIRST_PICTURE_MS = 60_000
"""Software GL takes 5 to 7 s on an idle machine."""

CYAN, YELLOW, RED, MAGENTA = (95, 80, 90), (18, 120, 90), (0, 90, 90), (150, 60, 60)
"""HSV centres of the interval's ring, the robot's body, a pin of severity 5 and a made wall."""


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    page = browser.new_page(viewport={"width": 320, "height": 240})
    yield page
    page.close()


def pixels(page: Page, hsv: tuple[int, int, int]) -> int:
    """Number of pixels of the canvas with about this hue and at least this saturation and value."""
    png = np.frombuffer(page.locator("canvas").first.screenshot(), np.uint8)
    picture = cv2.cvtColor(cv2.imdecode(png, cv2.IMREAD_COLOR), cv2.COLOR_BGR2HSV)
    hue, least_saturation, least_value = hsv
    near = np.abs((picture[..., 0].astype(int) - hue + 90) % 180 - 90) <= 8
    return int(
        (near & (picture[..., 1] >= least_saturation) & (picture[..., 2] >= least_value)).sum()
    )


def wait_for_pixels(page: Page, hsv: tuple[int, int, int], at_least: int) -> None:
    for _ in range(FIRST_PICTURE_MS // 250):
        if page.locator("canvas").count() and pixels(page, hsv) >= at_least:
            return
        page.wait_for_timeout(250)
    raise AssertionError(f"fewer than {at_least} pixels of {hsv}")


def test_scene_is_drawn_and_clicked_in_a_browser(page: Page, served: Served) -> None:
    served.scene.show(length_m=4.5)
    served.scene.show(pose=make_estimate(2000.0))
    served.scene.show(mode="follow")
    page.goto(served.page_url + "?fixedDpr=1")

    wait_for_pixels(page, YELLOW, 375)
    wait_for_pixels(page, CYAN, 75)
    assert pixels(page, RED) < 12
    served.scene.show(pins=[Pin("a", 2.2, 9.0, 0.005, 5, "BAC C")])
    wait_for_pixels(page, RED, 15)
    assert page.locator('[data-testid="floating-panel"]').is_hidden()

    magenta = cv2.imencode(".jpg", np.full((64, 64, 3), (230, 20, 230), np.uint8))[1].tobytes()
    wall = [WallTile(k, 1, 0.5 * k, 0.5 * k + 0.5) for k in range(8)]
    assert pixels(page, MAGENTA) < 12
    served.scene.show(wall=WallPictures(wall, Layout(500, 8, -470, 0, 64, 64), lambda _: magenta))
    wait_for_pixels(page, MAGENTA, 1250)

    middle = page.locator("canvas").first.bounding_box()
    assert middle is not None
    at = (middle["x"] + 0.35 * middle["width"], middle["y"] + 0.4 * middle["height"])
    page.mouse.click(*at)  # a plain click is for turning the view
    page.keyboard.down("Shift")
    page.mouse.click(*at)
    page.keyboard.up("Shift")
    hit = served.clicks.get(timeout=PATIENCE_S)
    assert 1.0 < hit.distance_m < 3.5
    assert hit.clock_h is not None
    assert served.clicks.empty()


def test_wall_that_was_not_seen_is_transparent(page: Page, served: Served) -> None:
    """A JPEG has no transparency, so the page makes it where there is nothing but one grey."""
    rng = np.random.default_rng(3)
    wall = rng.integers(UNSEEN_GREY - 25, UNSEEN_GREY + 25, (80, 120, 3), np.uint8)
    wall[:, 60:] = UNSEEN_GREY
    jpeg = cv2.imencode(".jpg", wall, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tolist()
    page.goto(served.page_url)

    alphas = page.evaluate(
        """async (jpeg) => {
          const blob = new Blob([new Uint8Array(jpeg)], { type: "image/jpeg" });
          const bitmap = await createImageBitmap(blob, { premultiplyAlpha: "none" });
          const context = new OffscreenCanvas(120, 80).getContext("2d");
          context.drawImage(bitmap, 0, 0);
          return Array.from(context.getImageData(0, 40, 120, 1).data.filter((_, i) => i % 4 === 3));
        }""",
        jpeg,
    )

    assert set(alphas[:30]) == {255}
    assert set(alphas[66:]) == {0}


def test_foreign_server_named_in_the_address_is_not_asked(page: Page, served: Served) -> None:
    with socket.create_server(("127.0.0.1", 0)) as foreign:
        foreign.setblocking(False)
        address = f"ws://127.0.0.1:{foreign.getsockname()[1]}"
        with page.expect_console_message(lambda m: m.text.startswith(f"Connecting to: {address}")):
            page.goto(f"{served.page_url}?websocket={address}/")
        page.wait_for_timeout(1500)  # its worker asks once a second

        with pytest.raises(BlockingIOError):
            foreign.accept()
