"""The picture, its frame number and everything drawn over it always belong together."""

from __future__ import annotations

import re

import pytest
from clips import numbered_clip, rig_for_clip
from playwright.sync_api import Page, expect
from steps import Server, log_in

FRAMES = 60

# The number that the blocks of the shown picture spell, and the one that the page states.
READ = """() => {
  const canvas = document.querySelector('.stage__picture');
  const { data } = canvas.getContext('2d').getImageData(0, 8, 256, 1);
  let drawn = 0;
  for (let bit = 0; bit < 16; bit += 1) if (data[4 * (16 * bit + 8)] > 128) drawn |= 1 << bit;
  const stated = document.querySelector('.transport__clock').textContent;
  return [drawn, Number(/frame (\\d+)/.exec(stated)[1])];
}"""

# Both numbers at every animation frame from when the film begins to play until it stands still.
WATCH = f"""() => {{
  const read = {READ};
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


@pytest.fixture
def reviewed(page: Page, server: Server, inspection: str) -> Page:
    log_in(page, server, f"/inspections/{inspection}")
    expect_frame(page, 0)
    return page


def expect_frame(page: Page, number: int) -> None:
    expect(page.locator(".transport__clock")).to_have_text(re.compile(rf"frame {number}$"))


def test_every_step_shows_the_next_frame(reviewed: Page) -> None:
    for number in range(1, FRAMES // 2):
        reviewed.keyboard.press("ArrowRight")
        expect_frame(reviewed, number)
        assert reviewed.evaluate(READ) == [number, number]


def test_every_seek_shows_the_asked_frame(reviewed: Page) -> None:
    for number in (57, 3, 58, 21, 20, 22, 0, 45, 59, 1):
        reviewed.evaluate("frame => document.querySelector('video-panel').seek(frame)", number)
        expect_frame(reviewed, number)
        assert reviewed.evaluate(READ) == [number, number]


def test_picture_and_number_agree_while_it_plays(reviewed: Page) -> None:
    reviewed.evaluate(WATCH)
    reviewed.keyboard.press(" ")
    seen = reviewed.evaluate("() => globalThis.watched")
    assert [pair for pair in seen if pair[0] != pair[1]] == []
    assert len({drawn for drawn, _ in seen}) > 1
    expect_frame(reviewed, FRAMES - 1)
    assert reviewed.evaluate(READ) == [FRAMES - 1, FRAMES - 1]


def test_picture_and_number_agree_backwards(reviewed: Page) -> None:
    reviewed.keyboard.press("End")
    expect_frame(reviewed, FRAMES - 1)
    reviewed.keyboard.press("j")
    expect_frame(reviewed, 0)
    assert reviewed.evaluate(READ) == [0, 0]
