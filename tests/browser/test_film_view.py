"""The film is enlarged, lightened, slowed down and fills the screen; the panels are resized."""

from __future__ import annotations

import pytest
from clip_surveys import FRAMES
from desks import (
    DRAWN_AND_STATED,
    box_of,
    delete_observations,
    expect_frame,
    expect_read,
    observations,
)
from playwright.sync_api import Page, Route, expect
from steps import Server, log_in


@pytest.fixture(scope="module")
def server(narrow_server: Server) -> Server:
    return narrow_server


@pytest.fixture
def desk(page: Page, server: Server, inspection: str) -> Page:
    delete_observations(server, inspection)
    page.set_viewport_size({"width": 1366, "height": 768})
    log_in(page, server, f"/inspections/{inspection}")
    expect_read(page)
    expect_frame(page, 0)
    return page


def test_the_film_is_enlarged_tagged_lightened_and_resized(
    desk: Page, server: Server, inspection: str
) -> None:
    stage = box_of(desk.locator(".stage"))
    # Of a picture of 320 x 240 that fills the height of the stage, a point right of its middle.
    scale = stage["height"] / 240
    x = stage["x"] + stage["width"] / 2 + 60 * scale
    y = stage["y"] + stage["height"] / 2 + 20 * scale
    desk.mouse.move(x, y)
    desk.mouse.wheel(0, -500)
    zoom = desk.locator(".stage__tools [data-part=whole]")
    expect(zoom).to_have_text("349 %")
    desk.mouse.click(x, y)
    [tag] = observations_after(desk, server, inspection, 1)
    assert tag["pixel"] == pytest.approx([219.5, 139.5], abs=1)  # the wheel kept it under the hand

    desk.mouse.down()
    desk.mouse.move(x - 40 * scale, y, steps=4)
    desk.mouse.up()
    expect(desk.locator(".defect")).to_have_count(1)  # a drag tags nothing
    desk.mouse.click(x, y)
    first, second = observations_after(desk, server, inspection, 2)
    assert second["pixel"][0] - first["pixel"][0] == pytest.approx(40 / 3.49, abs=1)

    desk.keyboard.press("w")
    expect(zoom).to_have_text("100 %")
    assert desk.evaluate(DRAWN_AND_STATED) == [0, 0]
    the_look_the_size_and_the_speed_of_the_film_are_chosen_and_remembered(desk)


def observations_after(desk: Page, server: Server, inspection: str, count: int) -> list[dict]:
    expect(desk.locator(".save")).to_have_text("Saved")
    expect(desk.locator(".defect")).to_have_count(count)
    return sorted(observations(server, inspection), key=lambda item: item["seq"])


def the_look_the_size_and_the_speed_of_the_film_are_chosen_and_remembered(desk: Page) -> None:
    picture = desk.locator(".stage__picture")
    expect(picture).to_have_css("filter", "none")
    desk.get_by_label("Brightness and contrast").first.click()
    desk.get_by_label("Gamma").fill("1.8")
    desk.get_by_label("Local contrast").fill("1")
    expect(picture).to_have_css("filter", 'url("#film-look")')
    assert desk.evaluate(DRAWN_AND_STATED) == [0, 0]
    desk.get_by_label("Brightness and contrast").first.click()

    # The film fills the screen, and a defect is edited beside it.
    stage, window = desk.locator(".stage"), desk.viewport_size
    assert window is not None
    usual = box_of(stage)
    assert usual["height"] > 320
    desk.keyboard.press("Shift+F")
    expect(desk.locator(".desk__strip")).to_be_hidden()
    assert box_of(stage)["height"] > 0.85 * window["height"]
    expect(desk.locator(".readout__distance")).to_be_in_viewport()
    expect(desk.locator(".desk__side")).to_be_hidden()
    desk.keyboard.press("t")
    desk.keyboard.press("e")
    expect(desk.get_by_label("Code", exact=True)).to_be_in_viewport()
    desk.get_by_role("button", name="Done").click()
    expect(desk.locator(".desk__side")).to_be_hidden()
    desk.keyboard.press("Escape")
    expect(desk.locator(".desk__strip")).to_be_visible()
    assert box_of(stage) == usual

    # Panels are resized by hand and by key, and remember it.
    edge = desk.get_by_role("separator", name="Height of the strips")
    height = box_of(stage)["height"]
    grip = box_of(edge)
    x, y = grip["x"] + grip["width"] / 2, grip["y"] + grip["height"] / 2
    desk.mouse.move(x, y)
    desk.mouse.down()
    desk.mouse.move(x, y + 120, steps=3)
    desk.mouse.up()
    assert box_of(stage)["height"] == pytest.approx(height + 120, abs=1)
    side = desk.locator(".desk__side")
    width = box_of(side)["width"]
    desk.get_by_role("separator", name="Width of the list").focus()
    desk.keyboard.press("ArrowRight")
    assert box_of(side)["width"] == pytest.approx(width - 24, abs=1)
    expect_frame(desk, 0)  # the key moved the edge, not the film
    desk.reload()
    expect_read(desk)
    assert box_of(side)["width"] == pytest.approx(width - 24, abs=1)
    assert box_of(stage)["height"] == pytest.approx(height + 120, abs=1)
    expect(picture).to_have_css("filter", 'url("#film-look")')
    desk.get_by_label("Brightness and contrast").first.click()
    expect(desk.get_by_label("Gamma")).to_have_value("1.8")
    desk.get_by_role("button", name="Reset").click()
    expect(picture).to_have_css("filter", "none")
    desk.get_by_label("Brightness and contrast").first.click()
    edge.dblclick()
    assert box_of(stage)["height"] == pytest.approx(height, abs=1)

    # Slow motion plays the frames and keeps its speed. Of a film of variable rate, like this one,
    # Chromium 150 passes over up to 6 of 40, which are much shorter than those before.
    speed = desk.get_by_label("Speed of playing")
    for _ in range(3):
        desk.keyboard.press("<")
    expect(speed).to_have_value("0.1")
    desk.evaluate("""() => {
      const { playhead } = document.querySelector('inspection-page').desk;
      window.shown = new Set();
      playhead.addEventListener('change', () => window.shown.add(playhead.value.frame));
    }""")
    desk.keyboard.press("Space")
    expect_frame(desk, FRAMES - 1)
    assert desk.evaluate("() => window.shown.size") >= 0.75 * FRAMES
    desk.keyboard.press(">")
    expect(speed).to_have_value("0.25")

    # The tag buttons are in sight on a tablet.
    desk.set_viewport_size({"width": 1024, "height": 768})
    expect(desk.locator(".quick__code").last).to_be_in_viewport(ratio=1)


def test_a_frame_that_was_asked_for_is_shown_by_single_pictures_where_the_film_cannot_be_played(
    page: Page, server: Server, inspection: str
) -> None:
    films: list[Route] = []
    page.route("**/video", lambda route: films.append(route))
    with page.expect_request("**/video"):
        log_in(page, server, f"/inspections/{inspection}")
    expect_read(page)
    page.keyboard.press("End")
    for film in films:
        film.abort()
    expect_frame(page, FRAMES - 1)

    # a picture that does not come is said, and asked for again by the next key
    page.route("**/frames/*.jpg", lambda route: route.abort())
    page.keyboard.press("Home")
    expect(page.locator(".toast")).to_contain_text("The server cannot be reached.")
    page.unroute("**/frames/*.jpg")
    page.keyboard.press("Home")
    expect_frame(page, 0)
