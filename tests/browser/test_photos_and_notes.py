"""More photos of a defect, a drawing on a copy, a voice note and a clip, as a person makes them."""

from __future__ import annotations

import io
import json
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from clip_surveys import FRAMES
from desks import expect_frame, expect_read, expect_saved, show_more
from looks import expect_no_fault
from playwright.sync_api import Locator, Page, expect
from steps import Server, log_in, open_format
from surveys import Survey

TAG = "7d444840-9dc0-4d2a-8a6a-000000000001"

# A machine of a test has no microphone: the tone is real sound, and so is the recorder.
MICROPHONE = """navigator.mediaDevices.getUserMedia = async () => {
  const context = new AudioContext();
  const tone = context.createOscillator();
  const { stream } = tone.connect(context.createMediaStreamDestination());
  tone.start();
  return stream;
}"""


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(server: Server, narrow: Survey) -> str:
    fields = {"frame": 9, "code": "BAB", "char1": "B", "char2": "A", "severity": 3}
    server.ask("PUT", f"/api/inspections/{narrow.id}/observations/{TAG}", fields)
    return narrow.id


def attachments(server: Server, inspection: str) -> list[dict[str, Any]]:
    answer = server.ask("GET", f"/api/inspections/{inspection}/attachments")
    found: list[dict[str, Any]] = json.load(answer)["attachments"]
    return found


def drag(page: Page, pad: Locator, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Draw with the mouse between two places, as shares of the picture."""
    box = pad.bounding_box()
    assert box is not None
    at = [(box["x"] + u * box["width"], box["y"] + v * box["height"]) for u, v in (start, end)]
    page.mouse.move(*at[0])
    page.mouse.down()
    page.mouse.move(*at[1], steps=4)
    page.mouse.up()


def test_photos_drawings_notes_and_clips_are_made_and_kept(
    page: Page, server: Server, inspection: str, tmp_path: Path
) -> None:
    page.add_init_script(MICROPHONE)
    log_in(page, server, f"/inspections/{inspection}")
    expect_read(page)
    page.locator(".defect").first.click()
    page.keyboard.press("e")
    form = page.locator("defect-form")
    thumbs = form.locator(".thumbs li")
    show_more(page)
    expect(thumbs).to_have_count(1)

    # A photo of the shown frame.
    page.locator("body").press("Escape")
    page.keyboard.press("End")
    expect_frame(page, FRAMES - 1)
    page.keyboard.press("Shift+P")
    page.keyboard.press("e")
    expect(thumbs).to_have_count(2)
    expect_saved(page)

    # A drawing on a copy of the first: an arrow with the mouse, a line with the keyboard, a text.
    form.get_by_role("button", name="Open the photo").click()
    page.get_by_role("button", name="Draw on a copy").click()
    pad = page.get_by_role("application", name="The photo to draw on")
    drag(page, pad, (0.2, 0.8), (0.5, 0.5))
    page.get_by_text("Freehand", exact=True).click()
    pad.focus()
    for key in ("Enter", "ArrowRight", "ArrowDown", "Enter"):
        pad.press(key)
    page.get_by_text("Text", exact=True).click()
    page.get_by_label("Text to place").fill("root")
    pad.click(position={"x": 40, "y": 60})
    expect_no_fault(page, within="dialog[open]")
    page.get_by_role("button", name="Done").last.click()
    expect(page.get_by_text("Photo 3 of 3")).to_be_visible()
    page.get_by_role("button", name="Make it the main photo").click()
    expect(page.get_by_text("Photo 1 of 3")).to_be_visible()
    with page.expect_download() as saved:
        page.get_by_role("link", name="Save the photo").click()
    assert saved.value.path().read_bytes()[:2] == b"\xff\xd8"
    page.get_by_role("button", name="Close").click()
    expect_saved(page)
    drawing = attachments(server, inspection)[0]
    assert [stroke["kind"] for stroke in drawing["strokes"]] == ["arrow", "line", "text"]
    assert (drawing["frame"], drawing["rank"]) == (9, -1)

    # What is said while the line is dead is in the browser until the server has it.
    page.route("**/voice?*", lambda route: route.abort())
    form.get_by_role("button", name="Record a note").click()
    form.get_by_role("button", name=re.compile("^Stop")).click()
    expect(form.locator(".voices li")).to_contain_text("waits for the server")
    page.reload()
    expect(page.locator(".save")).to_have_text("Waiting (1)")
    in_list = page.locator(".defect [data-part=photo]")
    expect(in_list).to_have_attribute("src", drawing["file"])
    page.unroute("**/voice?*")
    expect_saved(page)
    page.locator(".defect").first.click()
    page.keyboard.press("e")
    expect(form.locator("audio")).to_have_attribute("src", re.compile("/voice$"))

    expect_no_fault(page, ("dark",), within="defect-form")

    # Deleted, and undone.
    form.get_by_role("button", name="Delete", exact=True).click()
    expect(form.locator(".voices li")).to_have_count(0)
    page.locator("toast-stack").get_by_role("button", name="Undo").last.click()
    expect(form.locator(".voices li")).to_have_count(1)
    expect_saved(page)

    form.get_by_role("button", name="Clip").click()
    clip = page.get_by_role("dialog").locator("video")
    expect(clip).to_be_visible()
    page.wait_for_function("() => document.querySelector('dialog video').readyState >= 2")
    last_s = sum(20 + (number * 7) % 50 for number in range(FRAMES - 1)) / 1000
    assert clip.evaluate("video => video.duration") == pytest.approx(last_s, abs=0.1)
    page.get_by_role("button", name="Close").click()

    # The bundle has all of it.
    page.keyboard.press("Escape")
    open_format(page, "ZIP")
    page.get_by_label("Distance and code below each photo").check()
    page.get_by_label(re.compile("^Clips of 6 s")).check()
    with page.expect_download() as bundle:
        page.get_by_role("button", name=re.compile("^Download")).click()
    with zipfile.ZipFile(io.BytesIO(bundle.value.path().read_bytes())) as archive:
        names = archive.namelist()
    kinds = [
        sum(name.startswith(folder) for name in names) for folder in ("photos", "voice", "clips")
    ]
    assert kinds == [6, 1, 1]
