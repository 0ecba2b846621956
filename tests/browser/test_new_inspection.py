"""The form of a new inspection: presets, rig files, and faults shown beside the fields."""

from __future__ import annotations

import json
from pathlib import Path
from uuid import uuid4

import pytest
from clips import numbered_clip, rig_for_clip
from looks import expect_no_fault
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


def test_a_rig_comes_from_a_preset_or_a_file_and_faults_are_shown(
    form: Page, tmp_path: Path
) -> None:
    form.get_by_label("Camera and mount").select_option("preset 0")
    expect(form.locator("#header-height_mm")).to_have_value("300")
    expect(form.get_by_label("Inner diameter")).to_be_hidden()  # it is typed once
    form.get_by_role("button", name="Start tracking").click()
    faults = form.locator("rig-form .fault:not(:empty)")
    expect(faults).to_have_count(0)
    expect(form.get_by_role("img", name="Pipe of")).to_be_visible()
    _the_foot_hides_no_field(form)

    # A fault is shown beside its field until it is put right.
    field = form.get_by_label("Turned by")
    right = field.input_value()
    field.fill("400")
    field.blur()
    expect(field).to_have_attribute("aria-invalid", "true")
    expect(faults).to_have_text(["At most 360 °."])
    field.fill(right)
    field.blur()
    expect(field).to_have_attribute("aria-invalid", "false")
    expect(faults).to_have_count(0)

    rig_file = form.locator("rig-form input[type=file]")
    for name, content, sentence in (
        ("notes.json", "hello", "notes.json is not a JSON file."),
        ("list.json", "[1]", "list.json is not a rig file: it has no camera, no mount, no pipe."),
    ):
        path = tmp_path / name
        path.write_text(content)
        rig_file.set_input_files(path)
        expect(form.get_by_text(sentence)).to_be_visible()
    rig_file.set_input_files(rig_for_clip(tmp_path / "rig.json"))
    # The rig file is read before its values are changed.
    expect(form.get_by_label("Picture width")).to_have_value("320")

    # A lens that was measured in pixels goes with a smaller film of the same camera.
    form.locator("summary", has_text="Expert").click()
    for name, value in (("width", 640), ("height", 480), ("fx", 1200), ("fy", 1200), ("cx", 319.5)):
        form.locator(f"#rig-camera-{name}").fill(str(value))
    form.locator("#rig-camera-cy").fill("239.5")
    clip = numbered_clip(tmp_path / "clip.mp4", "libx264", frames=5)
    form.locator("input[type=file]").first.set_input_files(clip)
    expect(form.get_by_text("The video is 320 × 240 px.")).to_be_visible()
    form.get_by_role("button", name="Take the size of the film").click()
    expect(form.locator("#rig-camera-fx")).to_have_value("600")
    expect(form.locator("#rig-camera-cx")).to_have_value("159.5")
    expect(form.get_by_label("Picture width")).to_have_attribute("aria-invalid", "false")


def _the_foot_hides_no_field(form: Page) -> None:
    """A window of 1440 x 900 at 200 %, WCAG 2.4.11; and one that is wide, but low."""
    size = form.viewport_size
    assert size is not None
    for width, height in ((720, 450), (1024, 640)):
        form.set_viewport_size({"width": width, "height": height})
        form.locator("#main").focus()
        for key in ["Tab"] * 20 + ["Shift+Tab"] * 10:
            form.keyboard.press(key)
            assert form.evaluate(COVERED) is None
    form.set_viewport_size(size)


def test_what_is_no_video_is_refused_and_header_and_rig_are_remembered_for_the_next_time(
    form: Page, server: Server, tmp_path: Path
) -> None:
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
    expect(form.locator(".chip")).to_contain_text("Done")

    form.get_by_label("Menu").click()
    form.get_by_role("link", name="Inspections").click()
    row = form.locator(".inspection", has_text="clip.mp4").first
    expect(row.locator(".chip")).to_contain_text("Done")
    form.get_by_role("link", name="New inspection").click()
    operator = form.get_by_role("textbox", name="Operator", exact=True)
    expect(operator).to_have_value("A. Rahman")
    # The next culvert is another one.
    for field in (asset, form.get_by_role("combobox", name="Direction"), known):
        expect(field).to_have_value("")
    expect(form.locator(".header-form__missing")).to_contain_text("Still empty: Asset, ")
    # Nor is the camera filled in: it is offered by its name, and brings no pipe.
    focal = form.locator("#rig-camera-fx")
    expect(focal).to_have_value("")
    form.get_by_role("button", name="Use the camera of “clip” again").click()
    expect(focal).to_have_value("600")
    for field in ("height_mm", "unit_length_m"):
        expect(form.locator(f"#header-{field}")).to_have_value("")


def test_the_pipe_is_stated_once_and_never_comes_from_the_last_inspection(
    form: Page, server: Server, tmp_path: Path
) -> None:
    asset = {"header": {"shape": "circular", "height_mm": 600, "unit_length_m": 2.4}}
    server.ask("PUT", "/api/register/assets/CV-600", asset)
    rig = json.loads(rig_for_clip(tmp_path / "rig.json").read_text())
    server.ask("PUT", f"/api/rigs/{uuid4()}", {"name": "Crawler A", "rig": rig})
    form.reload()
    height, rig_height = form.locator("#header-height_mm"), form.locator("#rig-pipe-diameter_mm")
    form.get_by_label("Camera and mount").select_option("Crawler A")
    expect(form.locator("#rig-camera-fx")).to_have_value("600")
    expect(form.locator("#header-rig_id")).to_have_value("Crawler A")
    expect(height).to_have_value("")
    form.get_by_role("button", name="Start tracking").click()  # without a film and a diameter
    clip = numbered_clip(tmp_path / "clip.mp4", "libx264", frames=5)
    form.locator("input[type=file]").first.set_input_files(clip)
    form.get_by_role("button", name="Start tracking").click()
    expect(height).to_be_focused()
    expect(height).to_have_attribute("aria-invalid", "true")
    asset_id = form.get_by_role("textbox", name="Asset", exact=True)
    asset_id.fill("CV-600")
    asset_id.blur()
    expect(form.get_by_text("Ø 600 mm, units of 2400 mm: as the header says")).to_be_visible()
    expect(rig_height).to_have_value("600")
    # A file for another pipe changes neither, and says so.
    form.locator("rig-form input[type=file]").set_input_files(tmp_path / "rig.json")
    expect(form.get_by_text("This rig is for another pipe (300")).to_be_visible()
    expect(rig_height).to_have_value("600")
    height.fill("610")
    height.blur()
    expect(rig_height).to_have_value("610")
    form.get_by_label("Camera and mount").select_option("Crawler A")
    expect(rig_height).to_have_value("610")
    expect_no_fault(form, within="rig-form")
    form.get_by_role("button", name="Start tracking").click()
    form.wait_for_url("**/inspections/*")
    made = form.url.rsplit("/", 1)[1]
    server.state_no_counter(made)
    stored = json.load(server.ask("GET", f"/api/inspections/{made}"))
    pipe = stored["rig"]["pipe"]
    assert (pipe["diameter_mm"], pipe["segment_length_mm"]) == (610, 2400)
    assert (stored["header"]["height_mm"], stored["header"]["rig_id"]) == (610, "Crawler A")
    form.goto(server.url + "/new")
    form.get_by_role("button", name="Use Crawler A again").click()
    chosen = form.get_by_label("Camera and mount").locator("option:checked")
    expect(chosen).to_have_text("Crawler A")
