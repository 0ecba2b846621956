"""A server without room: tags wait in the browser, an upload says why it stops."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect
from small_disk import SmallDisk, small_disk
from steps import Server, log_in
from surveys import Survey


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[SmallDisk]:
    with small_disk(tmp_path / "disk") as disk:
        yield disk


def test_tags_wait_until_there_is_room(page: Page, disk: SmallDisk, narrow: Survey) -> None:
    with Server(narrow.copied_to(disk.place / "data"), disk_reserve_bytes="0") as server:
        inspection = narrow.id
        log_in(page, server, f"/inspections/{inspection}")
        expect(page.locator(".transport__clock")).to_have_text(re.compile("frame 0$"))
        save = page.locator(".save")
        page.keyboard.press("1")
        expect(save).to_have_text("Saved")
        disk.fill()
        page.keyboard.press("2")
        expect(save).to_have_text("Waiting (1)")
        page.keyboard.press("3")
        expect(save).to_have_text("Waiting (2)")
        expect(save).to_have_attribute("title", re.compile("disk is full"))
        page.reload()
        expect(save).to_have_text("Waiting (2)")
        disk.make_room()
        expect(save).to_have_text("Saved")
        path = f"/api/inspections/{inspection}/observations"
        assert len(json.load(server.ask("GET", path))["observations"]) == 3
