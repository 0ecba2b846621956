"""The form of a new inspection: presets, rig files, and faults shown beside the fields."""

from __future__ import annotations

from pathlib import Path

import pytest
from clips import numbered_clip, rig_for_clip
from playwright.sync_api import Page, expect
from steps import Server, log_in

COVERED = """() => {
  const focused = document.activeElement;
  const foot = document.querySelector('.new__foot');
  if (focused === document.body || foot.contains(focused)) return null;
  const { bottom } = focused.getBoundingClientRect();
  const { top } = foot.getBoundingClientRect();
  const isCovered = bottom > top + 1 && top < innerHeight;
  return isCovered ? `${focused.outerHTML.slice(0, 90)}: ${bottom} > ${top}` : null;
}"""
"""What has the focus and reaches below the edge of the foot."""


@pytest.fixture
def form(page: Page, server: Server) -> Page:
    log_in(page, server, "/new")
    return page


def test_a_preset_fills_a_rig_without_faults_and_faults_are_shown(form: Page) -> None:
    form.get_by_label("Start from").select_option(index=1)
    assert float(form.get_by_label("Inner diameter").input_value()) > 0
    form.get_by_role("button", name="Start tracking").click()
    expect(form.locator("rig-form .fault:not(:empty)")).to_have_count(0)
    expect(form.get_by_role("img", name="Pipe of")).to_be_visible()

    # A fault is shown beside its field until it is put right.
    form.get_by_text("Lens distortion and fine adjustment").click()
    faults = form.locator("rig-form .fault:not(:empty)")
    for label, text, sentence in (
        ("Inner diameter", "20", "At least 50 mm."),
        ("Inner diameter", "three hundred", "Not a number."),
        ("Height of the lens", "100000", "At most 10000 mm."),
        ("Height of the lens", "0", "More than 0 mm."),
        ("Picture width", "640.5", "A whole number is needed."),
        ("Turned by", "", "Needed."),
        ("Focal length fx", "8", "Is it the lens’s focal length in mm?"),
        ("Distortion", "0.1, 0.2", "2 numbers; this lens takes 4, 5, 8, 12, 14, or none."),
    ):
        field = form.get_by_label(label)
        right = field.input_value()
        field.fill(text)
        field.blur()
        expect(field).to_have_attribute("aria-invalid", "true")
        expect(faults.filter(has_text=sentence)).to_be_visible()
        field.fill(right)
        field.blur()
        expect(field).to_have_attribute("aria-invalid", "false")
        expect(faults).to_have_count(0)
    form.get_by_label("Inner diameter").fill("300")
    form.get_by_label("Height of the lens").fill("310")
    form.get_by_label("Height of the lens").blur()
    expect(form.get_by_text("outside the pipe")).to_be_visible()


def test_a_file_that_is_no_rig_is_refused_with_its_name(form: Page, tmp_path: Path) -> None:
    for name, content, sentence in (
        ("notes.json", "hello", "notes.json is not a JSON file."),
        ("list.json", "[1]", "list.json is not a rig file: it has no camera, no mount, no pipe."),
    ):
        path = tmp_path / name
        path.write_text(content)
        form.locator("rig-form input[type=file]").set_input_files(path)
        expect(form.get_by_text(sentence)).to_be_visible()


def test_a_video_of_another_size_than_the_camera_is_reported(form: Page, tmp_path: Path) -> None:
    rig = rig_for_clip(tmp_path / "rig.json")
    form.locator("rig-form input[type=file]").set_input_files(rig)
    width = form.get_by_label("Picture width")
    expect(width).to_have_value("320")  # the rig file is read before its value is changed
    width.fill("1920")
    clip = numbered_clip(tmp_path / "clip.mp4", "libx264", frames=5)
    form.locator("input[type=file]").first.set_input_files(clip)
    expect(form.get_by_text("The video is 320 × 240 px.")).to_be_visible()


def test_a_file_that_is_no_video_is_refused_with_the_reason(form: Page, tmp_path: Path) -> None:
    text = tmp_path / "story.mp4"
    text.write_text("Once upon a time there was a culvert.")
    form.locator("input[type=file]").first.set_input_files(text)
    form.locator("rig-form input[type=file]").set_input_files(rig_for_clip(tmp_path / "rig.json"))
    form.get_by_role("button", name="Start tracking").click()
    expect(form.locator(".new__foot .fault")).not_to_be_empty()
    expect(form.get_by_role("button", name="Start tracking")).to_be_enabled()
    form.reload()
    expect(form.get_by_role("button", name="Start tracking")).to_be_visible()
    expect(form.get_by_text("story.mp4")).to_have_count(0)  # nothing of it goes on


def test_header_and_rig_are_remembered_for_the_next_time(
    form: Page, server: Server, tmp_path: Path
) -> None:
    clip = numbered_clip(tmp_path / "clip.mp4", "libx264", frames=20)
    form.locator("input[type=file]").first.set_input_files(clip)
    form.locator("rig-form input[type=file]").set_input_files(rig_for_clip(tmp_path / "rig.json"))
    form.get_by_role("textbox", name="Operator", exact=True).fill("A. Rahman")
    asset = form.get_by_role("textbox", name="Asset", exact=True)
    asset.fill("KL-204")
    form.get_by_role("combobox", name="Direction").select_option("with_flow")
    form.get_by_text("More fields", exact=True).click()
    known = form.locator("#header-known_length_m")  # folded away next time
    known.fill("6.3")
    form.get_by_role("button", name="Start tracking").click()
    form.wait_for_url("**/inspections/*")
    server.state_no_counter(form.url.rsplit("/", 1)[1])
    expect(form.locator(".chip")).to_have_text("Done")

    form.get_by_role("link", name="All inspections").click()
    row = form.locator(".inspection", has_text="clip.mp4").first
    expect(row.locator(".chip")).to_have_text("Done")
    form.get_by_role("link", name="New inspection").click()
    operator = form.get_by_role("textbox", name="Operator", exact=True)
    expect(operator).to_have_value("A. Rahman")
    # The next culvert is another one.
    for field in (asset, form.get_by_role("combobox", name="Direction"), known):
        expect(field).to_have_value("")
    expect(form.locator(".header-form__missing")).to_contain_text("Still empty: Asset, ")
    expect(form.get_by_label("Focal length fx")).to_have_value("600")


def test_the_foot_hides_no_field_at_double_zoom(form: Page) -> None:
    """A window of 1440 x 900 at 200 %, WCAG 2.4.11; and one that is wide, but low."""
    for width, height in ((720, 450), (1024, 640)):
        form.set_viewport_size({"width": width, "height": height})
        form.locator("#main").focus()
        for key in ["Tab"] * 30 + ["Shift+Tab"] * 20:
            form.keyboard.press(key)
            assert form.evaluate(COVERED) is None
