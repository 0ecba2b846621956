"""The picture, its frame number and everything drawn over it always belong together."""

from __future__ import annotations

import pytest
from clips import numbered_clip, rig_for_clip
from desks import DRAWN_AND_STATED, expect_frame
from playwright.sync_api import Page
from steps import Server, log_in

FRAMES = 60

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


CLIPS = {"playable.mp4": "libx264", "crawler.avi": "mpeg4"}
"""One that browsers play, and one that they do not: it is shown as single pictures."""


@pytest.fixture(scope="module", params=CLIPS)
def inspection(
    request: pytest.FixtureRequest, server: Server, tmp_path_factory: pytest.TempPathFactory
) -> str:
    folder = tmp_path_factory.mktemp("clip")
    clip = numbered_clip(folder / request.param, CLIPS[request.param], frames=FRAMES)
    return server.track(clip, rig_for_clip(folder / "rig.json"))


def test_picture_and_number_agree_however_the_film_is_moved(
    page: Page, server: Server, inspection: str
) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    expect_frame(page, 0)
    for number in range(1, 12):
        page.keyboard.press("ArrowRight")
        expect_frame(page, number)
        assert page.evaluate(DRAWN_AND_STATED) == [number, number], "a step"
    for number in (57, 3, 58, 21, 20, 22, 45, 59, 1, 0):
        page.evaluate("frame => document.querySelector('video-panel').seek(frame)", number)
        expect_frame(page, number)
        assert page.evaluate(DRAWN_AND_STATED) == [number, number], "a seek"
    page.evaluate(WATCH)
    page.keyboard.press(" ")
    seen = page.evaluate("() => globalThis.watched")
    assert [pair for pair in seen if pair[0] != pair[1]] == [], "while it plays"
    assert len({drawn for drawn, _ in seen}) > 1
    expect_frame(page, FRAMES - 1)
    assert page.evaluate(DRAWN_AND_STATED) == [FRAMES - 1, FRAMES - 1], "at the end"
    page.keyboard.press("j")
    expect_frame(page, 0)
    assert page.evaluate(DRAWN_AND_STATED) == [0, 0], "backwards"
