"""A live inspection as a crew drives it: a camera that drops out, tags, the end, the review."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from builders import clip_rig
from cameras import MjpegCamera
from looks import faults
from playwright.sync_api import Page, expect
from steps import Server, log_in

USER, PASSWORD = "crew", "s3cret/with@signs"

# Picture, number, pose and read-out as they are about to be presented, at each animation frame
# until so many pictures were seen: size observers run after all animation callbacks of a frame.
WATCH = """(pictures) => import('/static/core/wall/units.js')
  .then((units) => new Promise((resolve) => {
  const canvas = document.querySelector('.stage__picture');
  const { desk } = document.querySelector('inspection-page');
  const text = (selector) => document.querySelector(selector).textContent;
  const probe = document.createElement('div');
  document.body.append(probe);
  const seen = [];
  const look = () => {
    const { data } = canvas.getContext('2d').getImageData(0, 8, 256, 1);
    let drawn = 0;
    for (let bit = 0; bit < 16; bit += 1) if (data[4 * (16 * bit + 8)] > 128) drawn |= 1 << bit;
    const { row } = desk.playhead.value;
    const m = row.distance_mm / 1000;
    const now = document.querySelector('.strip__track').ariaValueNow;
    const number = text('.transport__frame').split(' ').at(-1);
    const stated = [number, text('.readout__distance span'), now];
    const right = [String(row.frame), units.chainageNumber(m), m.toFixed(2)];
    seen.push([drawn, row.frame, stated, right]);
  };
  const observer = new ResizeObserver(look);
  observer.observe(probe);
  const tick = () => {
    probe.style.width = probe.style.width === '1px' ? '2px' : '1px';
    if (new Set(seen.map(([, frame]) => frame)).size < pictures) requestAnimationFrame(tick);
    else { observer.disconnect(); resolve(seen); }
  };
  requestAnimationFrame(tick);
}))"""

# The number that the blocks of a recorded picture spell.
RECORDED = """(frame) => fetch(`/api${location.pathname}/frames/${frame}.jpg`)
  .then((answer) => answer.blob()).then(createImageBitmap).then((picture) => {
    const canvas = new OffscreenCanvas(picture.width, picture.height);
    const context = canvas.getContext('2d');
    context.drawImage(picture, 0, 0);
    const { data } = context.getImageData(0, 8, 256, 1);
    let drawn = 0;
    for (let bit = 0; bit < 16; bit += 1) if (data[4 * (16 * bit + 8)] > 128) drawn |= 1 << bit;
    return drawn;
  })"""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One that may open cameras on loopback."""
    folder = tmp_path_factory.mktemp("data")
    with Server(folder, camera_networks="127.0.0.0/8") as running:
        yield running


@pytest.fixture
def form(page: Page, server: Server, tmp_path: Path) -> Page:
    """The start screen with a rig, where a camera is to be chosen."""
    log_in(page, server, "/new")
    rig = tmp_path / "rig.json"
    rig.write_text(json.dumps(clip_rig()))
    page.locator("rig-form input[type=file]").set_input_files(rig)
    page.get_by_text("Live camera").click()
    return page


@pytest.fixture
def camera() -> Iterator[MjpegCamera]:
    with MjpegCamera(login=f"{USER}:{PASSWORD}", rate_hz=12) as running:
        yield running


def begin(form: Page, camera: MjpegCamera) -> None:
    """As a crew does: address, user and password, start."""
    form.get_by_label("Address of the camera").fill(f"http://127.0.0.1:{camera.port}/video")
    form.get_by_label("User").fill(USER)
    form.get_by_label("Password").fill(PASSWORD)
    form.get_by_label("Name", exact=True).fill("Culvert 7")
    form.get_by_role("button", name="Test picture").click()
    expect(form.get_by_text("The camera sends 256 × 160 px")).to_be_visible()
    expect(form.locator(".rig-picture img")).to_be_visible()
    form.get_by_role("button", name="Start recording").click()
    form.wait_for_url("**/inspections/*")
    expect(form.locator("live-bar")).to_contain_text("Camera connected")


def address(camera: MjpegCamera) -> str:
    """With its log-in."""
    return f"http://{USER}:{quote(PASSWORD, safe='')}@127.0.0.1:{camera.port}/video"


def inspections(server: Server) -> list[str]:
    return [each["id"] for each in json.load(server.ask("GET", "/api/inspections"))["inspections"]]


def shown_frame(page: Page) -> int:
    return int(
        page.evaluate("document.querySelector('inspection-page')?.desk?.playhead.value.frame ?? -1")
    )


def wait_for_frame_after(page: Page, frame: int) -> None:
    page.wait_for_function(
        "last => document.querySelector('inspection-page')?.desk?.playhead.value.frame > last",
        arg=frame,
    )


def inspection(page: Page, server: Server) -> dict[str, Any]:
    path = "/api" + page.url.removeprefix(server.url).split("?")[0]
    return dict(json.load(server.ask("GET", path)))


def test_a_live_inspection_from_its_start_through_drop_outs_to_its_review(
    form: Page, server: Server, camera: MjpegCamera
) -> None:
    begin(form, camera)
    page, bar, age = form, form.locator("live-bar"), form.locator("picture-age")
    expect(age).to_have_text(re.compile(r"\d+\.\d\d s old"))
    assert faults(page, within="live-bar") == []
    _expect_parts_of_one_frame(page)
    _look_back_and_return(page)
    _hide_and_show(page)

    camera.drop_out()
    expect(bar).to_contain_text("Camera gone for")
    expect(age).to_have_text(re.compile(r"No new picture for \d+\.\d s"))
    expect(page.locator("distance-readout")).to_contain_text("No new picture for")
    assert page.locator("distance-readout").get_attribute("data-status") == "lost"
    last = shown_frame(page)
    page.keyboard.press("t")  # nothing stands in the way of a tag on the last picture
    expect(page.locator(".defect")).to_have_count(1)
    camera.come_back()
    expect(bar).to_contain_text("Camera connected")
    wait_for_frame_after(page, last + 5)
    expect(page.locator(".save")).to_have_text("Saved")
    assert inspection(page, server)["live"]["reconnects"] == 1
    _lose_the_net(page)

    page.get_by_role("button", name="Finish").click()
    page.get_by_label("The end was reached").check()
    page.get_by_role("button", name="Stop and finish").click()
    expect(page.locator(".chip")).to_contain_text("Done")
    expect(page.get_by_role("dialog")).to_have_count(0)  # it would take the key
    expect(bar).to_be_hidden()
    page.keyboard.press("Home")
    expect(page.locator(".transport__clock")).to_have_text(re.compile(r"frame 0$"))
    assert page.evaluate(RECORDED, 0) >= 0
    shown = page.content() + json.dumps(inspection(page, server))
    assert PASSWORD.split("/")[0] not in shown


def _expect_parts_of_one_frame(page: Page) -> None:
    """Picture, number, pose and read-out."""
    seen = page.evaluate(WATCH, 6)
    assert [stated for _, _, stated, _ in seen] == [right for _, _, _, right in seen]
    frames = {frame: drawn for drawn, frame, *_ in seen}
    assert all(frames[frame] == drawn for drawn, frame, *_ in seen)
    for frame in sorted(frames)[::2]:
        assert page.evaluate(RECORDED, frame) == frames[frame]


def _look_back_and_return(page: Page) -> None:
    page.wait_for_function("() => document.querySelector('inspection-page').desk.track.length > 5")
    page.keyboard.press("Home")
    expect(page.locator(".transport__clock")).to_have_text(re.compile(r"frame 0$"))
    expect(page.locator("picture-age")).to_be_hidden()
    page.locator(".transport").get_by_role("button", name="Live").click()
    wait_for_frame_after(page, 5)
    wait_for_frame_after(page, shown_frame(page))
    expect(page.locator("picture-age")).to_be_visible()


def _hide_and_show(page: Page) -> None:
    """A hidden page asks for nothing."""
    page.evaluate("""() => {
      Object.defineProperty(document, 'hidden', { value: true, configurable: true });
      document.dispatchEvent(new Event('visibilitychange'));
    }""")
    expect(page.locator("picture-age")).to_contain_text("No new picture for")
    last = shown_frame(page)
    page.evaluate("""() => {
      delete document.hidden;
      document.dispatchEvent(new Event('visibilitychange'));
    }""")
    wait_for_frame_after(page, last)
    expect(page.locator("live-bar")).to_contain_text("Camera connected")


def _lose_the_net(page: Page) -> None:
    """The silence that gives a line up is not lived through: the clock of the page goes ahead."""
    page.context.set_offline(True)
    page.evaluate("""() => {
      const now = performance.now.bind(performance);
      performance.now = () => now() + 10_000;
    }""")
    expect(page.locator("live-bar")).to_contain_text("No connection to the server for")
    page.keyboard.press("t")
    expect(page.locator(".save")).to_have_text("Waiting (1)")
    last = shown_frame(page)
    page.context.set_offline(False)
    wait_for_frame_after(page, last)
    expect(page.locator("live-bar")).to_contain_text("Camera connected")
    expect(page.locator(".save")).to_have_text("Saved")


def test_what_keeps_a_camera_from_starting_is_shown_at_its_field_and_nothing_is_left(
    form: Page, server: Server, camera: MjpegCamera
) -> None:
    expect(form.get_by_text("Plug a camera in")).to_be_visible()
    form.get_by_role("button", name="Look again").click()
    expect(form.get_by_text("Plug a camera in")).to_be_visible()
    assert faults(form, within="source-picker") == []
    before = inspections(server)
    form.get_by_label("Address of the camera").fill("rtsp://8.8.8.8/stream")
    form.get_by_role("button", name="Start recording").click()
    expect(form.locator("#source-address-fault")).to_contain_text("may not be opened")
    expect(form.get_by_label("Address of the camera")).to_be_focused()

    form.get_by_label("Picture width").fill("640")
    form.get_by_label("Address of the camera").fill(address(camera))
    form.get_by_label("Address of the camera").blur()
    expect(form.get_by_label("Address of the camera")).to_have_value(
        f"http://127.0.0.1:{camera.port}/video"
    )
    expect(form.get_by_label("User")).to_have_value("crew")
    form.get_by_role("button", name="Start recording").click()
    expect(form.get_by_text("The video is 256 × 160 px.")).to_be_visible()
    expect(form.get_by_role("button", name="Start recording")).to_be_enabled()
    assert inspections(server) == before
