"""The 3D view and the unrolled wall in windows of their own, tied to the desk that opened them."""

from __future__ import annotations

import re

import pytest
from desks import expect_frame, expect_read, expect_saved, observations
from playwright.sync_api import Page, Route, expect
from steps import Server, log_in

ON_WALL = """([along, arc]) => {
  const strip = document.querySelector('wall-strip');
  return [strip.plot.toX(along), strip.rows.toY(arc)].map((place) => place * strip.scale);
}"""
OWN_WINDOW = "Show the unrolled wall in a window of its own"
BACK = "Bring the unrolled wall back"


@pytest.fixture(scope="module")
def server(narrow_server: Server) -> Server:
    return narrow_server


def press(page: Page, name: str) -> None:
    page.get_by_role("button", name=name).click()


def click_wall(wall: Page, along_mm: float) -> None:
    wall.wait_for_function(
        "() => { const { rows, desk } = document.querySelector('wall-strip');"
        " return rows && desk.track.length; }"
    )
    x, y = wall.evaluate(ON_WALL, [along_mm, 0])
    wall.locator("wall-strip [data-part=above]").click(position={"x": x, "y": y}, force=True)


def refuse(route: Route) -> None:
    route.fulfill(status=422, json={"code": "elsewhere", "detail": "Not here."})


def test_the_wall_in_its_own_window_moves_with_the_film_and_tags(
    page: Page, server: Server, inspection: str
) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    expect_read(page)
    page.locator(".viewer__stage > *").evaluate("view => view.dataset.loaded = 'once'")
    with page.expect_popup() as opened:
        press(page, OWN_WINDOW)
    wall = opened.value
    expect(page.locator("wall-strip")).to_be_hidden()
    expect(page.locator(".viewer__stage > [data-loaded]")).to_have_count(1)
    expect(wall.locator("wall-strip")).to_be_visible()
    expect(wall.locator("video-panel")).to_have_count(0)

    page.keyboard.press("End")
    expect_frame(page, 39)
    here, there = page.locator(".readout__distance"), wall.locator(".readout__distance")
    at_end = here.inner_text()
    expect(there).to_have_text(at_end)
    wall.get_by_role("button", name="Seek").click()
    click_wall(wall, 20)
    expect(here).not_to_have_text(at_end)
    expect_frame(page, r"[12]?\d")
    expect(there).to_have_text(here.inner_text())

    # A tag made there is selected here, so that the next key gives it a code; undo is there too.
    wall.get_by_role("button", name="Tag").click()
    click_wall(wall, 30)
    expect(page.locator(".defect")).to_have_count(1)
    expect_saved(page)
    page.bring_to_front()
    page.keyboard.press("1")
    expect(page.locator(".defect")).to_contain_text("BAB")
    expect_saved(page)
    (tag,) = observations(server, inspection)
    assert (tag["code"], tag["pixel"] is None) == ("BAB", False)
    page.keyboard.press("Delete")
    expect(page.locator(".defect")).to_have_count(0)
    wall.wait_for_function(
        "() => document.querySelector('inspection-page').desk.observations.value.length === 0"
    )

    # A reload of the desk finds its window again; closing that brings the wall back.
    page.reload()
    expect(page.get_by_role("button", name=BACK)).to_be_visible()
    with wall.expect_event("close"):
        wall.evaluate("() => { setTimeout(() => window.close()); }")  # as a person does
    expect(page.locator("wall-strip")).to_be_visible()
    with page.expect_popup() as opened:
        press(page, OWN_WINDOW)
    expect(page.locator("wall-strip")).to_be_hidden()

    # What the server refuses is shown in the window where it was made, with what waits there.
    page.context.route("**/observations/*", refuse)
    expect(opened.value.locator(".save")).to_have_text("Saved")
    click_wall(opened.value, 25)
    expect(opened.value.locator(".toast--error")).to_have_text(re.compile("Not here"))
    with opened.value.expect_event("close"):
        press(page, BACK)
    expect(page.locator("wall-strip")).to_be_visible()

    page.evaluate("() => { window.open = () => null; }")
    press(page, "Show the 3D view in a window of its own")
    expect(page.locator("toast-stack")).to_contain_text(re.compile("blocked the window"))
