"""The picture, its frame number and everything drawn over it always belong together."""

from __future__ import annotations

import json
from pathlib import Path

import PIL.Image
import pytest
from clip_surveys import SHORT_FRAMES
from clips import NARROWED, SIZE, numbered_clip, rig_for_clip
from desks import DRAWN_AND_STATED, box_of, expect_frame
from playwright.sync_api import Page, expect
from steps import Server, log_in
from surveys import Survey

# Both numbers at every animation frame from when the film begins to play until it stands still.
WATCH = f"""() => {{
  const read = {DRAWN_AND_STATED};
  const seen = [];
  globalThis.watched = new Promise((resolve) => {{
    const look = () => {{
      const isPlaying = document.querySelector('[aria-label=Pause]') !== null;
      if (isPlaying || seen.length) seen.push(read());
      if (isPlaying || !seen.length) requestAnimationFrame(look); else resolve(seen);
    }};
    look();
  }});
}}"""


@pytest.fixture(scope="module")
def server(narrow_server: Server) -> Server:
    return narrow_server


@pytest.fixture(params=["playable", "not playable"])
def inspection(
    request: pytest.FixtureRequest, server: Server, narrow: Survey, tmp_path: Path
) -> str:
    """Of a film that browsers play, and of one that is shown as single pictures."""
    if request.param == "playable":
        return narrow.id
    clip = numbered_clip(tmp_path / "crawler.avi", "mpeg4", frames=SHORT_FRAMES)
    return server.track(clip, rig_for_clip(tmp_path / "rig.json"))


def test_picture_and_number_agree_however_the_film_is_moved(
    page: Page, server: Server, inspection: str
) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    expect_frame(page, 0)
    tracked = json.load(server.ask("GET", f"/api/inspections/{inspection}"))
    last = tracked["progress"]["frames_done"] - 1
    for number in range(1, 5):
        page.keyboard.press("ArrowRight")
        expect_frame(page, number)
        assert page.evaluate(DRAWN_AND_STATED) == [number, number], "a step"
    for number in (last - 2, 3, 11, 10, last, 0):
        page.evaluate("frame => document.querySelector('video-panel').seek(frame)", number)
        expect_frame(page, number)
        assert page.evaluate(DRAWN_AND_STATED) == [number, number], "a seek"
    page.evaluate(WATCH)
    page.keyboard.press(" ")
    seen = page.evaluate("() => globalThis.watched")
    assert [pair for pair in seen if pair[0] != pair[1]] == [], "while it plays"
    assert len({drawn for drawn, _ in seen}) > 1
    expect_frame(page, last)
    assert page.evaluate(DRAWN_AND_STATED) == [last, last], "at the end"
    page.keyboard.press("j")
    expect_frame(page, 0)
    assert page.evaluate(DRAWN_AND_STATED) == [0, 0], "backwards"


def test_a_film_upside_down_with_wide_pixels_is_shown_and_tagged_as_people_see_it(
    page: Page, server: Server, tmp_path: Path
) -> None:
    clip = numbered_clip(tmp_path / "held.mp4", "libx264", frames=12, is_upside_down=True)
    inspection = server.track(clip, rig_for_clip(tmp_path / "rig.json", NARROWED))
    log_in(page, server, f"/inspections/{inspection}")
    expect_frame(page, 0)
    page.keyboard.press("ArrowRight")
    expect_frame(page, 1)
    assert page.evaluate(DRAWN_AND_STATED) == [1, 1]
    stage = box_of(page.locator(".stage__overlay"))
    scale = min(stage["width"] / SIZE[0], stage["height"] / SIZE[1])
    left = stage["x"] + (stage["width"] - scale * SIZE[0]) / 2
    top = stage["y"] + (stage["height"] - scale * SIZE[1]) / 2
    page.mouse.click(left + 0.7 * scale * SIZE[0], top + 0.2 * scale * SIZE[1])
    expect(page.locator(".defect img:visible")).to_have_count(1)
    path = f"/api/inspections/{inspection}/observations"
    (tag,) = json.load(server.ask("GET", path))["observations"]
    assert tag["pixel"] == pytest.approx([0.7 * NARROWED[0], 0.2 * NARROWED[1]], abs=2)
    photo = PIL.Image.open(server.ask("GET", f"{path}/{tag['id']}/photo"))
    assert photo.size == SIZE
    assert [photo.convert("L").getpixel((x, 8)) > 128 for x in (8, 24)] == [True, False], "frame 1"
