"""A live run that meets a full disk, is ended by a person, recorded on, and tracked again."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from builders import clip_rig, wait_until
from cameras import MjpegCamera
from playwright.sync_api import Page, expect
from small_disk import small_disk
from steps import Server, log_in


@pytest.mark.long
def test_a_live_run_outlives_a_full_disk_and_a_stop(page: Page, tmp_path: Path) -> None:
    with (
        small_disk(tmp_path / "disk", megabytes=100) as disk,
        MjpegCamera(rate_hz=6) as camera,
        Server(
            disk.place / "data", camera_networks="127.0.0.0/8", disk_reserve_bytes="0"
        ) as server,
    ):
        source = {"kind": "live", "url": camera.url}
        body = {"name": "Culvert 9", "source": source, "rig": clip_rig(), "header": {}}
        path = f"/inspections/{json.load(server.ask('POST', '/api/inspections', body))['id']}"

        def now() -> dict[str, Any]:
            return dict(json.load(server.ask("GET", f"/api{path}")))

        log_in(page, server, path)
        bar = page.locator("live-bar")
        expect(bar).to_contain_text("Camera connected")
        disk.fill()
        expect(bar).to_contain_text("Not recorded: the disk is full")
        frames = now()["progress"]["frames_done"]
        wait_until(lambda: now()["progress"]["frames_done"] > frames)
        disk.make_room()
        expect(bar).to_contain_text("Camera connected")

        cancel = page.get_by_role("button", name="Cancel", exact=True)
        cancel.click()
        page.get_by_role("button", name="Keep recording").click()
        assert now()["status"] == "running"
        cancel.click()
        page.get_by_role("button", name="End the recording").click()
        expect(page.locator(".desk-bar [role=status]").first).to_have_text(re.compile("Cancelled"))
        first = now()["progress"]["frames_done"]

        page.get_by_role("button", name="Continue recording").click()
        dialog = page.get_by_role("dialog")
        dialog.get_by_label("Address of the camera").fill(camera.url)
        dialog.get_by_label("It stood still").check()
        dialog.get_by_role("button", name="Continue recording").click()
        expect(bar).to_contain_text("Camera connected")
        wait_until(lambda: now()["progress"]["frames_done"] > first + 3)
        server.ask("POST", f"/api{path}/finish", {"end_condition": "complete"})

        page.get_by_role("tab", name="Header").click()
        page.get_by_role("button", name="Edit rig and track again").click()
        dialog.locator("#rig-mount-height_mm").fill("123")
        dialog.get_by_role("button", name="Track again").click()
        wait_until(lambda: now()["status"] == "done" and now()["rig"]["mount"]["height_mm"] == 123)
        page.get_by_role("tab", name="History").click()
        history = page.get_by_role("tabpanel", name="History")
        expect(history).to_contain_text("Tracked again with another rig")
        expect(history).to_contain_text("123")
        expect(history).to_contain_text("Recording continued")
        expect(history).to_contain_text("It stood still")
