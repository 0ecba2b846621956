"""Tagging, editing and undoing; nothing is lost when the server is away."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import pytest
from clip_surveys import FRAMES
from desks import delete_observations, expect_frame, expect_read, expect_saved, observations
from lines import Line
from playwright.sync_api import Page, expect
from steps import Server, log_in
from surveys import Survey


@pytest.fixture(scope="module")
def server(wide: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(wide.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(wide: Survey) -> str:
    return wide.id


@pytest.fixture
def desk(page: Page, server: Server, inspection: str) -> Page:
    """The page of an inspection without any tag."""
    delete_observations(server, inspection)
    log_in(page, server, f"/inspections/{inspection}")
    expect_frame(page, 0)
    return page


def test_tags_made_without_a_server_are_saved_when_it_is_back(desk: Page, server: Server) -> None:
    save = desk.locator(".save")
    server.kill()
    desk.keyboard.press("1")
    desk.keyboard.press("2")
    expect(save).to_have_text("Waiting (2)")
    server.start()
    expect(save).to_have_text("Saved")
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
    expect(desk.locator(".save")).to_have_text("Saved")


def test_changes_are_saved_after_a_line_that_breaks_within_answers(
    page: Page, server: Server, inspection: str
) -> None:
    delete_observations(server, inspection)
    with Line(server) as line:
        log_in(page, server)
        page.goto(f"{line.url}/inspections/{inspection}")
        expect_frame(page, 0)
        page.get_by_role("tab", name="Header").click()
        asset = page.get_by_role("textbox", name="Asset", exact=True)
        expect(asset).to_be_visible()
        expect_read(page)
        line.breaks = True
        asset.fill("KL-204")
        asset.blur()
        expect(page.locator(".header-panel__state")).to_contain_text("cannot be reached")
        page.get_by_role("tab", name="Defects").click()
        page.keyboard.press("1")
        expect(page.locator(".save")).to_have_attribute("title", re.compile("cannot be reached"))
        line.breaks = False
        expect_saved(page)
        page.get_by_role("tab", name="Header").click()
        expect(page.locator(".header-panel__state")).to_have_text("Saved")
    [item] = observations(server, inspection)
    assert item["code"] == "BAB"
    answer = server.ask("GET", f"/api/inspections/{inspection}")
    assert json.load(answer)["header"] == {"asset_id": "KL-204"}
    server.ask("PATCH", f"/api/inspections/{inspection}", {"header": {}})


def test_each_change_is_undone_in_turn(desk: Page) -> None:
    code = desk.locator(".defect__what b")
    desk.keyboard.press("t")
    desk.keyboard.press("e")
    desk.get_by_label("Code", exact=True).fill("crack spiral")
    desk.get_by_role("listbox", name="Codes").get_by_role("option").first.click()
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
    expect_frame(desk, 1)
    desk.keyboard.press(" ")
    expect_frame(desk, FRAMES - 1)


def test_a_tag_does_not_scroll_the_page_away_from_the_picture(desk: Page) -> None:
    desk.set_viewport_size({"width": 390, "height": 844})
    for _ in range(3):
        desk.keyboard.press("t")
    expect(desk.locator(".defect")).to_have_count(3)
    assert desk.evaluate("scrollY") == 0


def test_what_is_typed_survives_a_reload_and_a_closed_tab(
    desk: Page, server: Server, inspection: str
) -> None:
    save, remark = desk.locator(".save"), desk.get_by_label("Remark")
    desk.keyboard.press("1")
    desk.keyboard.press("e")
    expect_saved(desk)
    desk.route("**/observations/*", lambda route: route.abort())
    remark.press_sequentially("root")
    desk.get_by_label("Quantity", exact=True).press_sequentially("0,4")
    expect(save).to_have_text(re.compile(r"Waiting \([12]\)"))  # 2: one was just being sent
    desk.reload()
    expect(desk.locator(".defect__more")).to_contain_text("root")
    desk.locator(".defect__main").click()
    desk.keyboard.press("e")
    expect(desk.get_by_label("Quantity", exact=True)).to_have_value("0.4")
    remark.press("End")
    remark.press_sequentially("s at the joint")
    other = desk.context.new_page()
    desk.close()
    other.goto(f"{server.url}/inspections/{inspection}")
    expect(other.locator(".defect__more")).to_contain_text("roots at the joint")
    expect_saved(other)
    [item] = observations(server, inspection)
    assert (item["remark"], item["quant1"]) == ("roots at the joint", 0.4)

    # All letters of a visit of the field are one step, which the button names.
    other.locator(".defect__main").click()
    other.keyboard.press("e")
    other.get_by_label("Remark").fill("")
    other.get_by_label("Remark").press_sequentially("dry")
    other.get_by_role("button", name="Done").click()
    undo = other.locator("[data-part=undo]")
    expect(undo).to_have_attribute(
        "title", "Undo: remark roots at the joint → dry of BAB at 0.00 m (U)"
    )
    undo.click()
    expect(other.locator(".defect__more")).to_contain_text("roots at the joint")
    expect(undo).to_be_disabled()


def test_a_stretch_starts_where_the_robot_is_and_says_so(
    desk: Page, server: Server, inspection: str
) -> None:
    toast = desk.locator(".toast").last

    def starts() -> list[tuple[int, str | None, bool]]:
        expect_saved(desk)
        made = observations(server, inspection)
        return [(item["frame"], item["code"], item["continuous"] is not None) for item in made]

    desk.keyboard.press("5")
    desk.keyboard.press("s")  # where it was just tagged
    expect(toast).to_contain_text(re.compile(r"Stretch A\d+ starts at 0\.00 m"))
    assert starts() == [(0, "BBA", True)]
    desk.keyboard.press("u")
    expect(desk.locator("open-stretches li")).to_have_count(0)
    desk.keyboard.press("End")
    expect_frame(desk, FRAMES - 1)
    desk.keyboard.press("s")
    expect(toast).to_contain_text(re.compile(r"Stretch A\d+ starts at 2\.0\d m"))
    assert starts() == [(0, "BBA", False), (FRAMES - 1, None, True)]
    desk.get_by_role("button", name="Start it at 0.00 m instead").click()
    expect(toast).to_contain_text(re.compile(r"Stretch A\d+ starts at 0\.00 m"))
    assert starts() == [(0, "BBA", True)]
    toast.get_by_role("button", name="Undo").click()
    expect(desk.locator("open-stretches li")).to_have_count(0)
    assert starts() == [(0, "BBA", False)]
    # The form is about its own tag, wherever the robot is.
    desk.keyboard.press("e")
    desk.get_by_role("button", name="Start a stretch at 0.00 m").click()
    assert starts() == [(0, "BBA", True)]


def test_a_clicked_tag_gets_the_code_of_the_next_key(
    desk: Page, server: Server, inspection: str
) -> None:
    def tags() -> list[tuple[str | None, bool]]:
        expect_saved(desk)
        made = observations(server, inspection)
        in_middle = [item["pixel"] == [159.5, 119.5] for item in made]
        return sorted(zip((item["code"] or "" for item in made), in_middle, strict=True))

    stage = desk.locator(".stage__overlay")
    box = stage.bounding_box()
    assert box is not None
    stage.click(position={"x": 0.4 * box["width"], "y": 0.7 * box["height"]})
    desk.keyboard.press("ArrowRight")
    expect_frame(desk, 1)
    desk.keyboard.press("1")
    assert tags() == [("BAB", False)]
    desk.keyboard.press("u")
    expect(desk.locator(".defect__what b")).to_have_text([""])
    assert tags() == [("", False)]
    # Elsewhere the key means what is seen there.
    desk.keyboard.press("End")
    expect_frame(desk, FRAMES - 1)
    desk.keyboard.press("2")
    assert tags() == [("", False), ("BAC", True)]
    desk.locator(".defect__main").first.click()
    expect_frame(desk, 0)
    desk.locator(".quick__code", has_text="Surface").click()
    assert tags() == [("BAC", True), ("BAF", False)]


@pytest.mark.parametrize(("width", "height"), [(1024, 768), (390, 844)])
def test_the_form_comes_into_sight_below_the_film_and_goes_again(
    desk: Page, width: int, height: int
) -> None:
    desk.set_viewport_size({"width": width, "height": height})
    desk.keyboard.press("1")
    desk.keyboard.press("e")
    code = desk.get_by_label("Code", exact=True)
    expect(code).to_be_focused()
    expect(code).to_be_in_viewport(ratio=1)
    readout = desk.locator("distance-readout").bounding_box()
    title = desk.locator(".form__head").bounding_box()
    assert readout is not None
    assert title is not None
    assert title["y"] >= readout["y"] + readout["height"]
    desk.keyboard.press("Escape")
    expect(desk.locator(".stage")).to_be_in_viewport(ratio=0.7)
