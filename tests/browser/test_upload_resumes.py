"""An upload survives a killed server and a reload, and what arrives is the file to the byte."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest
from clips import numbered_clip, rig_for_clip
from playwright.sync_api import Page, expect
from steps import Server, limit_upload, log_in

PADDING_BYTES = 9_000_000
BYTES_PER_S = 300_000
"""So slow that a busy machine, too, kills the server and reloads the page before the last piece."""


@pytest.fixture(scope="module")
def large_video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A playable film with a large 'free' box at its end, which players skip."""
    video = numbered_clip(tmp_path_factory.mktemp("large") / "large.mp4", "libx264", frames=20)
    with video.open("ab") as file:
        file.write((PADDING_BYTES + 8).to_bytes(4, "big") + b"free" + bytes(PADDING_BYTES))
    return video


def _wait_for_share(page: Page, percent: int) -> None:
    page.wait_for_function(
        "percent => parseInt(document.querySelector('.drop__state').textContent) >= percent",
        arg=percent,
    )


def test_upload_goes_on_after_the_server_was_killed_and_after_a_reload(
    page: Page, server: Server, large_video: Path
) -> None:
    log_in(page, server, "/new")
    limit = limit_upload(page, BYTES_PER_S)
    file_input = page.locator("input[type=file]").first
    file_input.set_input_files(large_video)
    _wait_for_share(page, 10)
    server.kill()
    expect(page.locator(".drop__state")).to_contain_text("Trying again")
    server.start()
    _wait_for_share(page, 25)

    page.on("dialog", lambda dialog: dialog.accept())
    page.reload()
    expect(page.get_by_text("was interrupted")).to_be_visible()
    limit.detach()
    sent: list[int] = []
    page.on("request", lambda request: sent.append(_offset_of(request.headers)))
    file_input.set_input_files(large_video)
    expect(page.locator(".drop__state")).to_have_text("Uploaded")
    assert min(offset for offset in sent if offset >= 0) > 0.2 * PADDING_BYTES

    page.reload()
    expect(page.get_by_text("no inspection was started")).to_be_visible()
    sent.clear()
    file_input.set_input_files(large_video)
    expect(page.locator(".drop__state")).to_have_text("Uploaded")
    assert max(sent) < 0  # no piece again

    page.locator("rig-form input[type=file]").set_input_files(
        rig_for_clip(large_video.with_name("rig.json"))
    )
    page.get_by_role("button", name="Start tracking").click()
    page.wait_for_url("**/inspections/*")
    server.state_no_counter(page.url.rsplit("/", 1)[1])
    inspection = json.load(server.ask("GET", f"/api{page.url.removeprefix(server.url)}"))
    assert inspection["source"]["sha256"] == hashlib.sha256(large_video.read_bytes()).hexdigest()


def _offset_of(headers: dict[str, str]) -> int:
    return int(headers.get("upload-offset", -1))
