"""A defect is measured by clicks on the picture and on the unrolled wall, and keeps its sizes."""

from __future__ import annotations

import re
import uuid

import pytest
from clips import SIZE
from desks import box_of, expect_frame, expect_read, expect_saved, observations
from looks import expect_no_fault
from playwright.sync_api import Page, expect
from steps import Server, log_in

MM_PER_PX = 230 / 600
"""At the invert: height of the camera over the focal length."""
CRACK = {"code": "BAB", "char1": "B", "char2": "A", "severity": 3, "clock_from": 6}
FRAME = 10
ON_STRIP = """([along, arc]) => {
  const strip = document.querySelector('wall-strip');
  return [strip.plot.toX(along), strip.rows.toY(arc)].map((place) => place * strip.scale);
}"""


@pytest.fixture(scope="module")
def server(narrow_server: Server) -> Server:
    return narrow_server


def click_picture(page: Page, u: float, v: float) -> None:
    """Click a pixel of the film."""
    box = box_of(page.locator(".stage__picture"))
    width, height = SIZE
    scale = min(box["width"] / width, box["height"] / height)
    left = box["x"] + (box["width"] - scale * width) / 2
    top = box["y"] + (box["height"] - scale * height) / 2
    page.mouse.click(left + (u + 0.5) * scale, top + (v + 0.5) * scale)


def test_a_crack_is_measured_on_the_picture_and_on_the_wall(
    page: Page, server: Server, inspection: str
) -> None:
    tag = {"frame": FRAME, "pixel": [159.5, 119.5], **CRACK}
    server.ask("PUT", f"/api/inspections/{inspection}/observations/{uuid.uuid4()}", tag)
    log_in(page, server, f"/inspections/{inspection}")
    expect_read(page)
    page.keyboard.press("n")
    expect_frame(page, FRAME)
    page.keyboard.press("Shift+M")
    box = page.locator("measure-box")
    expect(box.get_by_label("Measure on the wall")).to_have_value("width")

    click_picture(page, 129.5, 119.5)
    click_picture(page, 189.5, 119.5)
    width = box.locator("li")
    expect(width).to_have_text(re.compile(r"Width 2[23]\.\d ± 0\.\d mm|Width 23 ± \d mm"))
    expect(page.locator(".question[data-key=quant1]")).to_contain_text("23 mm")
    page.get_by_role("button", name="Open the photo").click()
    expect(page.locator("dialog .photo__size")).to_have_count(1)
    page.keyboard.press("Escape")
    expect_saved(page)
    (stored,) = observations(server, inspection)
    assert stored["quant1"] == 23
    (figure,) = stored["measured"]
    assert figure["value"] == pytest.approx(60 * MM_PER_PX, rel=0.02)

    # A line of three points on the unrolled wall; the width stays the quantity that was stated.
    box.get_by_label("Measure on the wall").select_option("length")
    box.get_by_role("button", name="Measure", exact=True).click()
    wall = page.locator("wall-strip [data-part=above]")
    for n, (along_mm, arc_mm) in enumerate([(10, -10), (30, 0), (40, 0)], 1):
        x, y = page.evaluate(ON_STRIP, [along_mm, arc_mm])
        wall.click(position={"x": x, "y": y}, force=True)
        expect(box.locator("[data-part=figure]")).to_have_text(re.compile(f"^Points: {n}"))
    box.get_by_role("button", name="Last point back").click()
    expect_no_fault(page, within="measure-box")
    box.get_by_role("button", name="Keep").click()
    expect(width).to_have_count(2)
    expect_saved(page)
    (stored,) = observations(server, inspection)
    assert [len(measure["points"]) for measure in stored["measures"]] == [2, 2]
    assert all(figure["u95"] > 0 for figure in stored["measured"])

    # Escape ends measuring; undo takes the last measure back.
    page.keyboard.press("Shift+M")
    expect(box.locator("[data-part=now]")).to_be_visible()
    page.locator(".stage").hover()
    page.keyboard.press("Escape")
    expect(box.locator("[data-part=now]")).to_be_hidden()
    page.keyboard.press("u")
    expect(width).to_have_count(1)
