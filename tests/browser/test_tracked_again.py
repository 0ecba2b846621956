"""An inspection is tracked again while somebody has its page open, which follows the new run."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from builders import clip_rig, wait_until
from cameras import MjpegCamera
from clip_surveys import FRAMES
from desks import expect_frame
from playwright.sync_api import Page, expect
from steps import Server, log_in, wait_until_done
from surveys import Survey

PACE = 1.0
"""The film is tracked as long as it lasts, a second and a half: the page sees a run grow."""

# How the track and the picture health of the page differ from what the server has now.
DIFFERENCES = """async () => {
  const ROUNDING = 0.001; // of the file of a track that has ended
  const { Track } = await import('/static/core/survey/track.js');
  const { Health } = await import('/static/core/survey/health.js');
  const { track, health, inspection } = document.querySelector('inspection-page').desk;
  const stored = { track: new Track(inspection.id), health: new Health(inspection.id) };
  await Promise.all([stored.track.extend(), stored.health.extend()]);
  const isSame = (mine, theirs) => mine.length === theirs.length
    && mine.every((value, frame) => Math.abs(value - theirs[frame]) < ROUNDING);
  return ['time_s', 'distance_mm', 'y_mm', 'sigma_distance_mm', 'status']
    .filter((name) => !isSame(track.column(name), stored.track.column(name)))
    .concat(isSame(health.complaints, stored.health.complaints) ? [] : ['complaints']);
}"""


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One that tracks slowly and may open cameras on loopback."""
    folder = narrow.copied_to(tmp_path_factory.mktemp("data"))
    with Server(folder, pace=str(PACE), camera_networks="127.0.0.0/8") as running:
        yield running


def now(server: Server, path: str) -> dict[str, Any]:
    return dict(json.load(server.ask("GET", path)))


def wait_for_rows(page: Page, rows: int) -> None:
    page.wait_for_function(
        "n => document.querySelector('inspection-page')?.desk?.track.length >= n", arg=rows
    )


def expect_the_tracks_end(page: Page, server: Server, path: str) -> None:
    """The page has all rows of the newest run and no others, and tags its last frame."""
    wait_until(lambda: now(server, path)["status"] == "done")
    page.wait_for_function(
        "n => document.querySelector('inspection-page').desk.track.length === n",
        arg=now(server, path)["progress"]["frames_done"],
    )
    wait_until_done(page)
    wait_until(lambda: page.evaluate(DIFFERENCES) == [])
    defects = page.locator(".defect")
    count = defects.count()
    page.keyboard.press("End")
    page.keyboard.press("4")
    expect(defects).to_have_count(count + 1)


def test_a_page_follows_every_run_that_is_begun_again(
    page: Page, server: Server, narrow: Survey
) -> None:
    path = f"/api/inspections/{narrow.id}"
    server.kill()  # it has read the track
    (server.data / "inspections" / narrow.id / "track.csv").write_text("damaged")
    server.start()
    log_in(page, server, path.removeprefix("/api"))
    expect(page.locator(".desk-messages")).to_contain_text("track of this inspection is damaged")
    page.get_by_role("button", name="Track again").click()
    dialog = page.get_by_role("dialog", name="Edit rig and track again")
    expect(dialog.get_by_text("Without a change it is only tried again")).to_be_visible()
    dialog.get_by_role("button", name="Track again").click()
    expect(page.locator(".desk-messages")).not_to_contain_text("damaged")
    wait_until_done(page)
    wait_for_rows(page, FRAMES)
    page.keyboard.press("End")
    expect_frame(page, FRAMES - 1)
    _give_another_rig(page, server, path)
    _turn_the_picture(page, server, path)
    _cancel_and_begin_again(page, server, path)


def _give_another_rig(page: Page, server: Server, path: str) -> None:
    rig = now(server, path)["rig"]
    rig["mount"]["height_mm"] /= 2
    server.ask("PUT", f"{path}/rig", {"rig": rig})
    expect_the_tracks_end(page, server, path)


def _turn_the_picture(page: Page, server: Server, path: str) -> None:
    """After a look at it."""
    page.get_by_role("tab", name="Header").click()
    page.get_by_role("button", name="180°").click()
    dialog = page.get_by_role("dialog", name="Turn the picture and track again")
    expect(dialog.get_by_role("img")).to_be_visible()
    expect(
        dialog.locator(".rig-picture__lines path, .rig-picture__lines polyline")
    ).not_to_have_count(0)
    dialog.get_by_role("button", name="Turn by 90°").click()
    dialog.get_by_role("button", name="Track again").click()
    expect(dialog).to_have_count(0)
    wait_until(lambda: now(server, path)["rig"]["mount"]["rotation_deg"] == -90)


def _cancel_and_begin_again(page: Page, server: Server, path: str) -> None:
    """The page looks at another frame than the run."""
    wait_for_rows(page, 10)
    page.keyboard.press("Home")  # the server then waits for acknowledgements of its pictures
    server.ask("POST", f"{path}/cancel")
    expect(page.locator(".chip")).to_have_text("Cancelled")
    assert now(server, path)["progress"]["frames_done"] < FRAMES
    server.ask("POST", f"{path}/retry")
    expect(page.locator(".chip")).not_to_have_text("Cancelled")
    expect_the_tracks_end(page, server, path)


def test_rows_of_a_run_that_died_with_the_server_are_not_mixed_with_those_of_the_next(
    page: Page, server: Server
) -> None:
    with MjpegCamera() as camera:
        source = {"kind": "live", "url": camera.url}
        body = {"name": "Culvert 9", "source": source, "rig": clip_rig(), "header": {}}
        path = f"/api/inspections/{json.load(server.ask('POST', '/api/inspections', body))['id']}"
        log_in(page, server, path.removeprefix("/api"))
        wait_for_rows(page, 20)
        # Both runs see the same pictures, so the first row of this one is marked.
        page.evaluate(
            """() => {
              const { track } = document.querySelector('inspection-page').desk;
              track.column('y_mm')[0] = 1e6;
            }"""
        )
        server.kill()
        server.start()
    expect_the_tracks_end(page, server, path)
