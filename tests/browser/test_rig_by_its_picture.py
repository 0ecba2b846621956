"""A rig as people know it, seen to be right on the first picture of its film."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from clips import SIZE, numbered_clip
from looks import expect_no_fault
from playwright.sync_api import Page, expect
from steps import Server, log_in

FOCAL_PX = 600.0
WAY = "rig-picture .rig-picture__way"


def test_a_first_rig_needs_no_pixels_and_shows_its_wall(
    page: Page, server: Server, tmp_path: Path
) -> None:
    log_in(page, server, "/new")
    clip = numbered_clip(tmp_path / "clip.mp4", "libx264", frames=5)
    page.locator("input[type=file]").first.set_input_files(clip)
    page.locator("#header-height_mm").fill("300")
    page.get_by_label("Height of the lens").fill("230")
    page.get_by_label("Turned by").fill("0")

    # The size comes from the film, and a missing lens is asked for in the words of the form.
    expect(page.get_by_label("Picture width")).to_have_value(str(SIZE[0]))
    expect(page.get_by_label("Focal length fx")).to_be_hidden()
    page.get_by_role("button", name="Start tracking").click()
    angle = page.get_by_label("Angle of view", exact=True)
    expect(angle).to_be_focused()
    expect(page.locator("#lens-fault")).to_have_text("Needed.")
    true_deg = 2 * np.degrees(np.arctan(SIZE[0] / 2 / FOCAL_PX))
    angle.fill(f"{true_deg:.3f}")
    fx = page.locator("#rig-camera-fx")
    assert float(fx.input_value()) == pytest.approx(FOCAL_PX, rel=1e-4)

    # The same lens by its diagonal, and by its sensor of 4.8 mm.
    diagonal_deg = 2 * np.degrees(np.arctan(np.hypot(*SIZE) / 2 / FOCAL_PX))
    page.get_by_label("Measured across").select_option("diagonal")
    angle.fill(f"{diagonal_deg:.3f}")
    assert float(fx.input_value()) == pytest.approx(FOCAL_PX, rel=1e-4)
    page.get_by_label("How the lens is known").select_option("sensor")
    page.get_by_label("Width of the sensor").fill("4,8")
    page.get_by_label("Lens in mm").fill("9")
    assert float(fx.input_value()) == FOCAL_PX

    # The picture shows where forward is; one click turns it, and the words follow.
    expect(page.get_by_role("img", name="First picture of the film")).to_be_visible()
    expect(page.locator("rig-picture").get_by_role("status")).to_contain_text(
        "mm of wall; drive below"
    )
    right = page.locator(WAY).get_attribute("d")
    page.get_by_role("button", name="Turn by 180°").click()
    expect(page.get_by_label("Turned by")).to_have_value("-180")
    expect(page.locator(WAY)).not_to_have_attribute("d", str(right))

    page.get_by_label("How well is this known?").select_option("calibrated")
    expect(page.locator("#rig-tolerance-focal_percent")).to_have_value("0.2")
    page.locator("summary", has_text="Expert").click()
    page.locator("#rig-tolerance-focal_percent").fill("0.7")
    expect(page.get_by_label("How well is this known?")).to_have_value("own")
    expect_no_fault(page, within="rig-form")

    # It is kept under a name, which the header takes over, and is there for the next film.
    page.get_by_role("button", name="Library", exact=True).click()
    page.get_by_label("Keep this rig as").fill("Crawler 2")
    page.get_by_role("button", name="Keep", exact=True).click()
    expect(page.locator("#header-rig_id")).to_have_value("Crawler 2")
    page.locator("#rig-mount-height_mm").fill("111")
    page.get_by_role("button", name="Library", exact=True).click()
    name = page.get_by_label("Name of Crawler 2")
    name.fill("Crawler 3")
    name.blur()
    page.get_by_role("button", name="Delete Crawler 3").click()
    expect(page.get_by_role("button", name="Take Crawler 3")).to_have_count(0)
    page.get_by_role("button", name="Undo").click()
    expect_no_fault(page, within="rig-form")
    page.get_by_role("button", name="Take Crawler 3").click()
    expect(page.get_by_label("Height of the lens")).to_have_value("230")
    expect(page.locator("#header-rig_id")).to_have_value("Crawler 3")
