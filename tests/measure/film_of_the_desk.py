"""The short film that heads the README: `python tests/measure film_of_the_desk docs/desk.webp`.

Tracks the sample inspection, opens it in a headless Chromium and plays: the robot drives past a
tagged defect, an operator tags the next one, and the 3D view looks along the pipe from inside.
Each picture is taken when the page has come to rest, so the film is the same on a slow machine.
Not a test.
"""

from __future__ import annotations

import argparse
import io
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Locator, Page, expect
from steps import Server, log_in

from measure.chromium import chromium
from measure.screenshots import open_page, tracked_sample, wait_for_still_3d_view

SIZE = (1440, 900)
SHOWN = (1200, 750)
"""Size of the film, in pixels."""
QUALITY = 60
PICTURE_MS = 125
FRAMES_A_PICTURE = 4
"""Frames per picture, of the sample's 15 a second: the drive is shown at about twice its speed."""
START, SETTLED, END = 122, 246, 330
"""Frames: before the roots at 1.5 m, over the silt at 2.25 m, past the leak at 3 m."""
DRAWN_BYTES = 60_000
"""A PNG of the 3D culvert is larger in this window, one of its empty view smaller."""
POINTER = """() => {
  const pointer = document.createElement('div');
  pointer.id = 'film-pointer';
  pointer.style.cssText = 'position: fixed; z-index: 99999; pointer-events: none; display: none';
  pointer.innerHTML = `<svg width="30" height="30" viewBox="0 0 20 20">
    <path d="M2 1v15l4-4 3 6 3-1.4-3-6h6z" fill="#fff" stroke="#000" stroke-width="1.2"/></svg>`;
  document.body.append(pointer);
}"""
MOVE = """([x, y]) => {
  const { style } = document.getElementById('film-pointer');
  Object.assign(style, { display: 'block', left: `${x - 3}px`, top: `${y - 1}px` });
}"""
"""A headless browser draws no mouse pointer."""


class Film:
    """Pictures of a page, one after the other."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._pictures: list[Image.Image] = []
        self._times_ms: list[int] = []
        self._pointer = (SIZE[0] * 0.45, SIZE[1] * 0.75)
        page.evaluate(POINTER)

    def take(self, hold_ms: int = PICTURE_MS) -> None:
        """Add the present view."""
        wait_for_still_3d_view(self._page)
        shot = Image.open(io.BytesIO(self._page.screenshot())).convert("RGB")
        self._pictures.append(shot.resize(SHOWN, Image.Resampling.LANCZOS))
        self._times_ms.append(hold_ms)

    def play(self, first: int, last: int) -> None:
        """Add the drive from one frame to another."""
        for frame in range(first, last + 1, FRAMES_A_PICTURE):
            show_frame(self._page, frame)
            self.take()

    def click(self, target: Locator, pictures: int = 4) -> None:
        """Move the pointer onto an element over several pictures, then click it."""
        box = target.bounding_box()
        assert box is not None
        (x, y), to = self._pointer, (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        for n in range(1, pictures + 1):
            share = n / pictures
            self._page.evaluate(MOVE, [x + share * (to[0] - x), y + share * (to[1] - y)])
            self.take()
        self._pointer = to
        self._page.mouse.click(*to)

    def write(self, path: Path) -> None:
        """An animated WebP that starts again at its end."""
        first, *others = self._pictures
        first.save(
            path,
            save_all=True,
            append_images=others,
            duration=self._times_ms,
            loop=0,
            quality=QUALITY,
            method=6,
        )


def show_frame(page: Page, frame: int) -> None:
    """Seek, and wait until the page shows that frame."""
    page.evaluate("(frame) => document.querySelector('inspection-page').desk.seek(frame)", frame)
    page.wait_for_function(
        "(frame) => document.querySelector('inspection-page').desk.playhead.value.frame === frame",
        arg=frame,
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("file", type=Path)
    file = arguments.parse_args().file
    with (
        tempfile.TemporaryDirectory() as data,
        Server(Path(data)) as server,
        chromium() as browser,
    ):
        page = open_page(browser, SIZE, "dark")
        log_in(page, server, f"/inspections/{tracked_sample(server)}")
        expect(page.locator(".defect")).to_have_count(3)
        page.wait_for_function("() => document.querySelector('wall-strip')?.pictures?.count > 0")
        show_frame(page, START)
        wait_for_still_3d_view(page, DRAWN_BYTES)
        film = Film(page)
        film.play(START, SETTLED)
        film.click(page.locator(".stage"))
        expect(page.locator(".defect")).to_have_count(4)
        film.take(4 * PICTURE_MS)
        film.click(page.get_by_role("button", name="7 Settled"))
        for answers in ("a", "15", ""):
            film.take(4 * PICTURE_MS)
            page.keyboard.type(answers)
        page.keyboard.press("Shift+Digit3")
        expect(page.locator(".defect").filter(has_text="BBC A")).to_have_count(1)
        expect(page.get_by_text("Saved", exact=True)).to_be_visible()
        film.take(8 * PICTURE_MS)
        film.click(page.get_by_role("button", name="Inside"))
        film.play(SETTLED, END)
        film.take(8 * PICTURE_MS)
        film.write(file)


if __name__ == "__main__":
    main()
