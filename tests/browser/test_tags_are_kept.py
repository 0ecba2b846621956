"""Tagging, editing and undoing; nothing is lost when the server is away."""

from __future__ import annotations

import json
import re

import pytest
from clips import numbered_clip, rig_for_clip
from playwright.sync_api import Page, expect
from steps import Server, log_in


@pytest.fixture(scope="module")
def inspection(server: Server, tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("clip")
    clip = numbered_clip(folder / "clip.mp4", "libx264", frames=30)
    return server.track(clip, rig_for_clip(folder / "rig.json"))


@pytest.fixture
def desk(page: Page, server: Server, inspection: str) -> Page:
    """The page of an inspection without any tag."""
    path = f"/api/inspections/{inspection}/observations"
    for item in json.load(server.ask("GET", path))["observations"]:
        server.ask("DELETE", f"{path}/{item['id']}")
    log_in(page, server, f"/inspections/{inspection}")
    expect(page.locator(".transport__clock")).to_have_text(re.compile("frame 0$"))
    return page


def test_tags_made_without_a_server_are_saved_when_it_is_back(desk: Page, server: Server) -> None:
    save = desk.locator(".save")
    server.kill()
    desk.keyboard.press("1")
    desk.keyboard.press("2")
    expect(save).to_have_text("Waiting (2)")
    server.start()
    expect(save).to_have_text("Saved", timeout=20_000)
    desk.reload()
    expect(desk.locator(".defect__what b")).to_have_text(["BAB", "BAC"])


def test_tags_survive_a_reload_before_they_are_saved(desk: Page, server: Server) -> None:
    # The page is reloaded while the server hangs on to nothing: saving is held back by the browser.
    desk.route("**/observations/*", lambda route: route.abort())
    desk.keyboard.press("5")
    expect(desk.locator(".save")).to_have_text("Waiting (1)")
    desk.reload()
    expect(desk.locator(".defect__what b")).to_have_text(["BBA"])
    expect(desk.locator(".save")).to_have_text("Waiting (1)")
    desk.unroute("**/observations/*")
    expect(desk.locator(".save")).to_have_text("Saved", timeout=20_000)


def test_each_change_is_undone_in_turn(desk: Page) -> None:
    code = desk.locator(".defect__what b")
    desk.keyboard.press("t")
    desk.keyboard.press("e")
    desk.get_by_label("Code", exact=True).fill("crack spiral")
    desk.get_by_role("option").first.click()
    desk.get_by_role("button", name="Done").click()
    expect(code).to_have_text(["BAB A D"])
    desk.keyboard.press("Delete")
    expect(code).to_have_count(0)

    desk.get_by_role("status").get_by_role("button", name="Undo").click()
    expect(code).to_have_text(["BAB A D"])
    desk.keyboard.press("u")
    expect(code).to_have_text([""])
    desk.keyboard.press("Control+z")
    expect(code).to_have_count(0)
    expect(desk.locator(".save")).to_have_text("Saved")
    desk.reload()
    expect(desk.locator(".defects__empty")).to_be_visible()


def test_the_form_saves_every_field_as_it_is_left(desk: Page) -> None:
    desk.keyboard.press("1")
    desk.keyboard.press("e")
    desk.get_by_label("Kind").select_option("B")
    desk.get_by_label("Detail").select_option("A")
    desk.locator("input[name=severity][value='4']").check(force=True)
    for name, strokes in (("from", 5), ("to", 3)):
        desk.get_by_role("slider", name=f"Clock {name}").focus()
        for _ in range(strokes):
            desk.keyboard.press("ArrowRight")
    desk.get_by_label("Quantity", exact=True).fill("3.5")
    desk.get_by_label("Remark").fill("=2+2 at the crown")
    desk.get_by_role("button", name="Done").click()
    expect(desk.locator(".save")).to_have_text("Saved")
    desk.reload()
    expect(desk.locator(".defect__what")).to_have_text(
        re.compile("BAB B A Crack: line, edges touching, along the pipe")
    )
    expect(desk.locator(".defect__more")).to_contain_text("11 to 2 o’clock")
    expect(desk.locator(".defect__more")).to_contain_text("=2+2 at the crown")
    expect(desk.locator(".defect .severity")).to_have_attribute(
        "aria-label", "severity 4, plan repair"
    )


def test_keys_belong_to_a_field_while_it_is_typed_in(desk: Page) -> None:
    desk.keyboard.press("1")
    desk.keyboard.press("e")
    desk.get_by_label("Remark").fill("t 1 u")
    desk.get_by_label("Remark").press("t")
    expect(desk.locator(".form__head h2")).to_contain_text("BAB")
    desk.get_by_label("Remark").press("Escape")
    expect(desk.locator(".defect")).to_have_count(1)


def test_a_closed_form_gives_the_keys_back_to_the_film(desk: Page) -> None:
    desk.keyboard.press("1")
    desk.keyboard.press("e")
    expect(desk.get_by_label("Code", exact=True)).to_be_focused()
    desk.keyboard.press("Escape")
    desk.keyboard.press("ArrowRight")
    expect(desk.locator(".transport__clock")).to_have_text(re.compile("frame 1$"))
    desk.keyboard.press(" ")
    expect(desk.locator(".transport__clock")).to_have_text(re.compile("frame 29$"))


def test_a_tag_does_not_scroll_the_page_away_from_the_picture(desk: Page) -> None:
    desk.set_viewport_size({"width": 390, "height": 844})
    for _ in range(3):
        desk.keyboard.press("t")
    expect(desk.locator(".defect")).to_have_count(3)
    assert desk.evaluate("scrollY") == 0
