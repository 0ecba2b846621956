"""The desk of an inspection as tests look at it: its frame, its picture, its observations."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from playwright.sync_api import Locator, Page, expect
from steps import Server

# The number that the blocks of the shown picture spell, and the one that the page states.
DRAWN_AND_STATED = """() => {
  const canvas = document.querySelector('.stage__picture');
  const { data } = canvas.getContext('2d').getImageData(0, 8, 256, 1);
  let drawn = 0;
  for (let bit = 0; bit < 16; bit += 1) if (data[4 * (16 * bit + 8)] > 128) drawn |= 1 << bit;
  const stated = document.querySelector('.transport__clock').textContent;
  return [drawn, Number(/frame (\\d+)/.exec(stated)[1])];
}"""

# What the page of an ended inspection reads when it is opened; nothing is read again by itself.
HAS_READ = """() => {
  const desk = document.querySelector('inspection-page')?.desk;
  return desk?.track.length && desk.observations.isRead && desk.corrections.value
    && desk.checks.value && desk.live.state === 'OPEN' && !desk.inspection.isUnfinished;
}"""

# Software takes a core for the 3D view.
WITHOUT_WEBGL = """(() => {
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    return kind.startsWith('webgl') ? null : getContext.call(this, kind, ...rest);
  };
})()"""


def another_tab(page: Page) -> Page:
    """A second page of the same browser, which does not draw in 3D either."""
    tab = page.context.new_page()
    tab.add_init_script(WITHOUT_WEBGL)
    return tab


@contextmanager
def drawn_in_3d(page: Page) -> Iterator[Page]:
    """Open the address of a page in a page that draws in 3D, for which software takes a core."""
    other = page.context.new_page()
    faults: list[str] = []
    other.on("pageerror", lambda error: faults.append(str(error)))
    other.goto(page.url)
    yield other
    other.close()
    assert not faults, faults


def box_of(place: Locator) -> dict[str, float]:
    """Where it is on the screen: x, y, width, height."""
    box = place.bounding_box()
    assert box is not None
    return {"x": box["x"], "y": box["y"], "width": box["width"], "height": box["height"]}


def click_at(place: Locator, across: float, down: float = 0.5) -> None:
    """By shares of its width and height."""
    box = box_of(place)
    place.page.mouse.click(box["x"] + across * box["width"], box["y"] + down * box["height"])


def expect_read(page: Page) -> None:
    """The page of an ended inspection has read everything, and follows what changes."""
    page.wait_for_function(HAS_READ)


def expect_frame(page: Page, frame: int | str) -> None:
    """The transport states it; a string is a regular expression."""
    expect(page.locator(".transport__frame")).to_have_text(re.compile(rf"frame {frame}$"))


def ask(page: Page, question: str) -> None:
    """Show the choices of a question in the form of a defect: `char1`, `clock`, `quant1`, ..."""
    chip = page.locator(f".question[data-key={question}]")
    if chip.get_attribute("aria-expanded") == "false":
        chip.click()


def choose(page: Page, question: str, choice: str) -> None:
    """Answer a question by one of its choices."""
    ask(page, question)
    page.locator(f".question__choice[data-choice='{choice}']").click()


def show_more(page: Page) -> None:
    """Show what the form of a defect has behind More."""
    if page.locator("defect-form details.more:not([open])").count():
        page.locator("defect-form details.more > summary").click()


def expect_saved(page: Page) -> None:
    """All that was tagged and typed is on the server's disk."""
    expect(page.locator(".save")).to_have_text("Saved")


def observations(server: Server, inspection: str) -> list[dict[str, Any]]:
    """As the server has them."""
    answer = server.ask("GET", f"/api/inspections/{inspection}/observations")
    found: list[dict[str, Any]] = json.load(answer)["observations"]
    return found


def delete_observations(server: Server, inspection: str) -> None:
    """All of them."""
    for item in observations(server, inspection):
        server.ask("DELETE", f"/api/inspections/{inspection}/observations/{item['id']}")
