"""Tag first, details later: quick codes, form, stretches, undo and redo, addresses of places."""

from __future__ import annotations

import json
import re
import uuid
from collections.abc import Iterator

import pytest
from clip_surveys import FRAMES
from desks import (
    another_tab,
    ask,
    box_of,
    choose,
    click_at,
    delete_observations,
    expect_frame,
    expect_saved,
    observations,
    show_more,
)
from looks import expect_no_fault
from playwright.sync_api import Page, Route, expect
from steps import Server, log_in
from surveys import Survey

TAG = {"pixel": [159.5, 119.5]}


TEMPLATE = {
    "recommendations": [
        {"text": "Watch it.", "cost": 50.0},
        {"text": "Rebuild the wall.", "code": "BAC", "severity_from": 4, "cost": 9000.0},
        {"text": "Seal the crack.", "code": "BAB"},
    ],
    "costs": True,
    "currency": "MYR",
}
"""Of the reports of all projects."""


@pytest.fixture(scope="module")
def server(wide: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(wide.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(wide: Survey) -> str:
    return wide.id


@pytest.fixture
def empty(server: Server, inspection: str) -> str:
    """The inspection without any tag."""
    delete_observations(server, inspection)
    return inspection


def opened(page: Page, server: Server, inspection: str) -> Page:
    """Open the page of an inspection, at its first frame."""
    log_in(page, server, f"/inspections/{inspection}")
    expect_frame(page, 0)
    return page


def put(server: Server, inspection: str, observation: str | None = None, **fields: object) -> str:
    """A tag as somebody else makes or changes it; answers its id."""
    name = observation or str(uuid.uuid4())
    server.ask("PUT", f"/api/inspections/{inspection}/observations/{name}", TAG | fields)
    return name


def seek(page: Page, frame: int) -> None:
    page.evaluate("frame => document.querySelector('video-panel').seek(frame)", frame)
    expect_frame(page, frame)


def codes(page: Page) -> list[str]:
    return page.locator(".defect__what b").all_text_contents()


def start_anew(desk: Page, server: Server, inspection: str) -> None:
    """Without any tag, form or dialog, at the first frame; the history of the page stays."""
    for _ in range(2):
        desk.keyboard.press("Escape")
    desk.get_by_role("tab", name="Defects").click()
    expect_saved(desk)
    delete_observations(server, inspection)
    expect(desk.locator(".defect")).to_have_count(0)
    desk.keyboard.press("Home")
    expect_frame(desk, 0)


def test_defects_are_tagged_described_and_undone(page: Page, server: Server, empty: str) -> None:
    server.ask("PUT", "/api/report-templates/", TEMPLATE)
    opened(page, server, empty)
    for step in (
        the_form_asks_only_for_what_the_code_needs,
        every_field_is_saved_and_the_clock_is_set_by_keys_and_by_drawing,
        a_stretch_is_started_changed_and_finished,
        a_stretch_without_a_length_is_asked_about,
        two_like_points_far_apart_are_offered_as_a_stretch,
        what_somebody_else_has_changed_is_not_undone_in_silence,
        the_address_follows_the_selection_and_leads_back_to_it,
        of_marks_on_one_spot_of_the_picture_the_gravest_is_taken,
        keys_belong_to_a_field_a_pedal_to_the_film_and_all_to_the_film_after_the_form,
        a_click_in_the_3d_view_tags_the_wall_or_selects_the_pin,
        a_stretch_starts_where_the_robot_is_and_says_so,
        a_clicked_tag_gets_the_code_of_the_next_key,
        a_proposal_of_the_project_becomes_the_recommendation_of_a_defect,
        the_list_is_filtered_and_walked_by_keys,
        a_change_of_the_header_is_undone_field_by_field,
        everything_is_undone_and_done_again_also_without_a_line,
        two_tabs_share_one_outbox,
        a_tag_that_cannot_be_stored_stays_and_says_why,
        below_the_film_the_form_comes_into_sight_and_goes_again_and_a_tag_scrolls_nothing,
    ):
        start_anew(page, server, empty)
        step(page, server, empty)


def test_an_address_shows_its_place(page: Page, server: Server, empty: str) -> None:
    log_in(page, server, f"/inspections/{empty}?d=1.07")
    expect_frame(page, "2[01]")  # the address states centimetres, frames are millimetres apart
    page.goto(f"{server.url}/inspections/{empty}?t=0.5")
    expect(page.locator(".transport__clock")).to_have_text(re.compile(r"^0:00\.(4[3-9]|50)"))
    page.goto(f"{server.url}/inspections/{empty}?frame=9999")
    expect_frame(page, FRAMES - 1)


def the_form_asks_only_for_what_the_code_needs(desk: Page, server: Server, inspection: str) -> None:
    desk.keyboard.press("t")
    desk.keyboard.press("Enter")
    code = desk.get_by_label("Code", exact=True)
    asked, questions = desk.locator("#question-asked"), desk.locator(".question")
    expect(code).to_be_focused()
    expect(desk.locator("#needs-code")).to_be_visible()
    expect(questions).to_have_count(0)
    code.fill("crack spiral")
    desk.get_by_role("listbox", name="Codes").get_by_role("option").first.click()
    expect(desk.locator(".defect__what b")).to_have_text(["BAB A D"])
    code.fill("bab b a")
    code.press("Enter")
    # Enter picks the first of the list, and the row with these very letters is the first.
    expect(desk.locator("#defect-code-label")).to_contain_text("line, edges touching, along")
    expect(questions).to_have_text(
        [
            re.compile(text)
            for text in ("^Kind.*B", "^Detail.*A", "^Clock", "^Quantity.*needed$", "^Sev", "^Rem")
        ]
    )
    quantity = desk.get_by_label("Quantity", exact=True)
    expect(quantity).to_be_focused()  # the width of the crack is what is missing
    quantity.fill("0,4")
    quantity.press("Enter")
    expect(asked).to_have_text("Severity")
    desk.keyboard.press("Enter")
    expect(desk.locator(".questions__one")).to_be_hidden()
    expect(desk.get_by_role("button", name="Done")).to_be_focused()
    expect(questions.get_by_text("needed").locator("visible=true")).to_have_count(0)

    code.fill("BCD A")
    code.press("Escape")
    desk.keyboard.press("e")
    code.fill("BDD A")
    code.press("Tab")
    expect(desk.locator(".question[data-key=clock]")).to_have_count(0)
    ask(desk, "quant1")
    expect(desk.locator(".unit").first).to_have_text("%")
    expect(desk.locator(".question[data-key=quant2]")).to_have_count(0)


def every_field_is_saved_and_the_clock_is_set_by_keys_and_by_drawing(
    desk: Page, server: Server, inspection: str
) -> None:
    desk.keyboard.press("1")
    desk.keyboard.press("e")
    start, end = (desk.get_by_role("slider", name=f"Clock {name}") for name in ("from", "to"))
    ask(desk, "clock")
    expect(start).to_have_attribute("aria-valuetext", "measured: 6 o’clock")
    expect(end).to_have_attribute("aria-valuetext", "one position")
    choose(desk, "char1", "B")
    choose(desk, "char2", "A")
    choose(desk, "severity", "4")
    ask(desk, "quant1")
    desk.get_by_label("Quantity", exact=True).fill("3.5")
    ask(desk, "remark")
    desk.get_by_label("Remark").fill("=2+2 at the crown")
    ask(desk, "clock")
    start.focus()
    for _ in range(5):
        desk.keyboard.press("ArrowRight")
    expect(start).to_have_attribute("aria-valuenow", "11")
    end.focus()
    for _ in range(3):
        desk.keyboard.press("ArrowUp")
    expect(end).to_have_attribute("aria-valuetext", "2 o’clock")
    expect_saved(desk)
    assert [
        (item["clock_from"], item["clock_to"]) for item in observations(server, inspection)
    ] == [(11, 2)]
    expect(desk.locator(".defect__what")).to_have_text(
        re.compile("BAB B A Crack: line, edges touching, along the pipe")
    )
    expect(desk.locator(".defect__more")).to_contain_text("11 to 2 o’clock")
    expect(desk.locator(".defect__more")).to_contain_text("=2+2 at the crown")
    expect(desk.locator(".defect .severity")).to_have_attribute(
        "aria-label", "severity 4, plan repair"
    )

    show_more(desk)
    desk.get_by_role("button", name="Open the photo").click()
    photo = desk.get_by_role("dialog").get_by_role("img", name=re.compile("Photo of BAB"))
    photo.evaluate("(image) => image.decode()")
    shown, mark = box_of(photo), box_of(desk.locator(".photo__line circle"))
    for at, size in (("x", "width"), ("y", "height")):
        middle = shown[at] + shown[size] / 2
        assert mark[at] + mark[size] / 2 == pytest.approx(middle, abs=2)
    expect_no_fault(desk, within="dialog[open]")
    desk.keyboard.press("Escape")
    end.focus()

    # Delete belongs to the dial here, not to the defect.
    desk.keyboard.press("Delete")
    expect(end).to_have_attribute("aria-valuetext", "one position")
    desk.get_by_role("button", name="All round").click()
    expect(start).to_have_attribute("aria-valuetext", "12 o’clock")
    expect(end).to_have_attribute("aria-valuetext", "12 o’clock")

    # Drawn from 3 back to 1 the sector is the short one, 1 to 3.
    face = desk.locator(".dial")
    face.scroll_into_view_if_needed()
    box = box_of(face)
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    radius = 68 / 198 * box["width"]
    desk.mouse.move(middle[0] + radius, middle[1])
    desk.mouse.down()
    desk.mouse.move(middle[0] + radius * 0.87, middle[1] - radius * 0.5)
    desk.mouse.move(middle[0] + radius * 0.5, middle[1] - radius * 0.87)
    desk.mouse.up()
    expect(desk.locator(".dial__hours-text")).to_have_text("1 – 3")


def a_stretch_is_started_changed_and_finished(desk: Page, server: Server, inspection: str) -> None:
    desk.keyboard.press("5")
    desk.keyboard.press("s")
    bar = desk.get_by_role("list", name="Open stretches")
    expect(bar).to_contain_text(re.compile(r"A\d+ BBA"))
    seek(desk, 10)
    expect(bar).to_contain_text("0.53 m long")
    desk.keyboard.press("Escape")  # until then C answers what is asked
    desk.keyboard.press("c")
    # The code is the same throughout: what is changed at one place changes at all.
    choose(desk, "char1", "C")
    desk.get_by_role("button", name="Done").click()
    seek(desk, 20)
    bar.get_by_role("button", name=re.compile(r"Finish A\d+ BBA here")).click()
    expect(bar).to_be_hidden()
    expect(desk.locator(".defects__count")).to_have_text(
        re.compile(r"1 defect · stretches cover 5\d % of the length")
    )
    expect_saved(desk)
    parts = [(item["continuous"][0], item["char1"]) for item in observations(server, inspection)]
    assert parts == [("A", "C"), ("C", "C"), ("B", "C")]
    for _ in range(3):  # the finish, the kind, the change
        desk.keyboard.press("u")
    expect(desk.locator(".defect")).to_have_count(1)
    expect(bar).to_be_visible()


def a_stretch_without_a_length_is_asked_about(desk: Page, server: Server, inspection: str) -> None:
    desk.keyboard.press("5")
    desk.keyboard.press("s")
    name = desk.locator(".open-stretch b").first
    number = int(name.inner_text().split()[0][1:])
    desk.keyboard.press("f")
    expect(desk.locator(".toast").last).to_contain_text("has no length")
    desk.get_by_role("button", name="Keep one point").click()
    expect(desk.locator(".defect")).to_have_count(1)
    expect_saved(desk)
    assert [item["continuous"] for item in observations(server, inspection)] == [None]
    # A number is never used twice.
    desk.keyboard.press("s")
    expect(name).to_have_text(f"A{number + 1} BBA")


def two_like_points_far_apart_are_offered_as_a_stretch(
    desk: Page, server: Server, inspection: str
) -> None:
    put(server, inspection, frame=2, code="BBA", char1="A")
    put(server, inspection, frame=30, code="BBA", char1="A")
    expect(desk.locator(".defect__main")).to_have_count(2)
    desk.locator(".defect__main").last.click()
    desk.keyboard.press("e")
    desk.get_by_role("button", name="Make it a stretch from 0.11 m").click()
    expect(desk.locator("[data-part=stretch]")).to_contain_text("finish of stretch")
    expect_saved(desk)
    roles = [item["continuous"][0] for item in observations(server, inspection)]
    assert roles == ["A", "B"]
    # It was one step.
    desk.get_by_role("button", name="Done").click()
    desk.keyboard.press("u")
    expect(desk.locator(".toast").last).to_contain_text("Undone: stretch of BBA")
    expect_saved(desk)
    assert [item["continuous"] for item in observations(server, inspection)] == [None, None]


def what_somebody_else_has_changed_is_not_undone_in_silence(
    desk: Page, server: Server, inspection: str
) -> None:
    desk.keyboard.press("1")
    desk.keyboard.press("Shift+Digit2")
    expect_saved(desk)
    [item] = observations(server, inspection)
    put(server, inspection, item["id"], frame=0, code="BAB", severity=5)
    desk.keyboard.press("u")
    expect(desk.locator(".toast").last).to_contain_text(
        "Not undone: severity – → 2 of BAB at 0.00 m. Somebody has changed it meanwhile."
    )
    expect(desk.locator(".defect .severity")).to_have_attribute("aria-label", re.compile("5"))
    desk.get_by_role("button", name="Undo it nevertheless").click()
    expect(desk.locator(".defect .severity")).to_have_attribute("aria-label", "not rated")
    expect_saved(desk)
    assert [item["severity"] for item in observations(server, inspection)] == [None]


def a_change_of_the_header_is_undone_field_by_field(
    desk: Page, server: Server, inspection: str
) -> None:
    path = f"/api/inspections/{inspection}"
    server.ask("PATCH", path, {"header": {"client": "Town"}})
    desk.get_by_role("tab", name="Header").click()
    operator = desk.get_by_role("textbox", name="Operator", exact=True)
    operator.fill("Aisyah")
    operator.press("Tab")
    undo = desk.locator("[data-part=undo]")
    expect(undo).to_have_attribute("title", "Undo: operator – → Aisyah (U)")
    server.ask("PATCH", path, {"header": {"client": "County", "operator": "Aisyah"}})
    undo.click()
    expect(desk.locator(".toast").last).to_contain_text("Undone: operator")
    assert json.load(server.ask("GET", path))["header"] == {"client": "County"}


def the_address_follows_the_selection_and_leads_back_to_it(
    desk: Page, server: Server, inspection: str
) -> None:
    one = put(server, inspection, frame=7, code="BAB")
    put(server, inspection, frame=9, code="BAC")
    row = desk.locator(".defect__main").first
    expect(row).to_have_attribute("href", f"/inspections/{inspection}?defect={one}")
    row.click()
    expect(desk).to_have_url(f"{server.url}/inspections/{inspection}?defect={one}")
    desk.context.grant_permissions(["clipboard-read", "clipboard-write"])
    desk.keyboard.press("y")
    expect(desk.locator(".toast").last).to_contain_text("Link copied")
    assert desk.evaluate("navigator.clipboard.readText()") == desk.url
    desk.keyboard.press("Escape")
    expect(desk).to_have_url(f"{server.url}/inspections/{inspection}")


def of_marks_on_one_spot_of_the_picture_the_gravest_is_taken(
    desk: Page, server: Server, inspection: str
) -> None:
    put(server, inspection, frame=0, severity=1)
    grave = put(server, inspection, frame=0, severity=4)
    put(server, inspection, frame=0, severity=2)
    expect(desk.locator(".defect")).to_have_count(3)
    desk.locator(".stage__overlay").click()
    expect(desk).to_have_url(f"{server.url}/inspections/{inspection}?defect={grave}")


def the_list_is_filtered_and_walked_by_keys(desk: Page, server: Server, inspection: str) -> None:
    put(server, inspection, frame=3, code="BAB", char1="B", char2="A", quant1=0.5, severity=5)
    put(server, inspection, frame=9, code="BBA", char1="A", remark="by the headwall")
    put(server, inspection, frame=15)
    rows = desk.locator(".defect__main")
    expect(desk.locator(".defect__lacks")).to_have_text(["", "quantity missing", "no code"])
    rows.first.focus()
    desk.keyboard.press("ArrowDown")
    expect(rows.nth(1)).to_be_focused()
    expect_frame(desk, 9)
    desk.keyboard.press("Delete")
    expect(rows).to_have_count(2)
    expect(rows.nth(1)).to_be_focused()
    desk.keyboard.press("u")
    expect(rows).to_have_count(3)
    desk.get_by_placeholder("Filter by code or word").fill("headwall")
    expect(desk.locator(".defects__count")).to_have_text("1 of 3 defects")
    desk.get_by_placeholder("Filter by code or word").fill("")
    desk.get_by_label("Which defects").select_option("Incomplete")
    assert codes(desk) == ["BBA A", ""]
    desk.get_by_label("Which defects").select_option("Act now (5)")
    assert codes(desk) == ["BAB B A"]
    desk.get_by_label("Which defects").select_option("All")
    desk.get_by_role("button", name="Newest first").click()
    assert codes(desk) == ["", "BBA A", "BAB B A"]
    expect_no_fault(desk, within="defect-list")


def keys_belong_to_a_field_a_pedal_to_the_film_and_all_to_the_film_after_the_form(
    desk: Page, server: Server, inspection: str
) -> None:
    desk.keyboard.press("1")
    desk.keyboard.press("e")
    expect(desk.locator(".questions__one")).to_be_focused()
    ask(desk, "remark")
    remark = desk.get_by_label("Remark")
    remark.fill("half a sen")
    remark.press("t")
    expect(desk.locator(".defect")).to_have_count(1)
    desk.keyboard.press("Pause")
    expect(desk.locator("#tab-defects")).to_contain_text("2")
    expect(remark).to_be_focused()
    expect(remark).to_have_value("half a sent")
    expect(desk.locator(".form__head h2")).to_contain_text("BAB")
    desk.keyboard.press("Escape")
    desk.keyboard.press("ArrowRight")
    expect_frame(desk, 1)
    desk.keyboard.press(" ")
    expect_frame(desk, FRAMES - 1)


def a_click_in_the_3d_view_tags_the_wall_or_selects_the_pin(
    desk: Page, server: Server, inspection: str
) -> None:
    dispatch = """([type, detail]) => document.querySelector('inspection-page').desk.live
        .dispatchEvent(new CustomEvent(type, { detail }))"""
    desk.evaluate(dispatch, ["wall_click", {"distance_m": 0.8, "clock_h": 6.0, "lateral_m": 0.0}])
    expect(desk.locator(".defect__where")).to_have_text(re.compile(r"0\.(79|80) m"))
    expect_saved(desk)
    [item] = observations(server, inspection)
    assert item["distance_m"] == pytest.approx(0.8, abs=0.02)
    desk.keyboard.press("Escape")
    desk.evaluate(dispatch, ["pin_click", {"observation": item["id"]}])
    expect(desk.locator(".defect__main")).to_have_attribute("aria-current", "true")
    expect_frame(desk, item["frame"])


def a_proposal_of_the_project_becomes_the_recommendation_of_a_defect(
    desk: Page, server: Server, inspection: str
) -> None:
    put(server, inspection, frame=0, code="BAC", char1="B", severity=4)
    desk.get_by_role("button", name="Edit BAC").click()
    show_more(desk)
    advice = desk.get_by_label("Recommendation", exact=True)
    proposed = desk.get_by_label("Proposed recommendations")
    expect(proposed.locator("option")).to_have_text(
        ["Take a proposal …", "Rebuild the wall. (9000 MYR)", "Watch it. (50 MYR)"]
    )

    proposed.select_option("0")
    expect(advice).to_have_value("Rebuild the wall.")
    expect(advice).to_be_focused()
    expect(desk.get_by_label("Estimated cost")).to_have_value("9000")
    desk.keyboard.press("End")
    desk.keyboard.type(" Close the road.")
    desk.get_by_label("Estimated cost").fill("9500,5")
    expect_no_fault(desk, within="defect-form")
    desk.keyboard.press("Escape")
    expect_saved(desk)
    [item] = observations(server, inspection)
    assert (item["recommendation"], item["cost"]) == ("Rebuild the wall. Close the road.", 9500.5)

    for _ in range(3):  # the cost, the words, the proposal
        desk.keyboard.press("u")
    redo = desk.locator("[data-part=redo]")
    expect(redo).to_have_attribute("title", re.compile("^Redo: recommendation – → Rebuild"))
    expect_saved(desk)
    [item] = observations(server, inspection)
    assert (item["recommendation"], item["cost"], item["severity"]) == (None, None, 4)


def a_stretch_starts_where_the_robot_is_and_says_so(
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


def a_clicked_tag_gets_the_code_of_the_next_key(
    desk: Page, server: Server, inspection: str
) -> None:
    def tags() -> list[tuple[str | None, bool]]:
        expect_saved(desk)
        made = observations(server, inspection)
        in_middle = [item["pixel"] == [159.5, 119.5] for item in made]
        return sorted(zip((item["code"] or "" for item in made), in_middle, strict=True))

    stage = desk.locator(".stage__overlay")
    click_at(stage, 0.4, 0.7)
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
    desk.keyboard.press("Escape")
    desk.locator(".defect__main").first.click()
    expect_frame(desk, 0)
    desk.locator(".quick__code", has_text="Surface").click()
    assert tags() == [("BAC", True), ("BAF", False)]


def below_the_film_the_form_comes_into_sight_and_goes_again_and_a_tag_scrolls_nothing(
    desk: Page, server: Server, inspection: str
) -> None:
    code = desk.get_by_label("Code", exact=True)
    for width, height in ((1024, 768), (390, 844)):
        desk.set_viewport_size({"width": width, "height": height})
        desk.keyboard.press("t")
        desk.keyboard.press("e")
        expect(code).to_be_focused()
        expect(code).to_be_in_viewport(ratio=1)
        readout = box_of(desk.locator("distance-readout"))
        title = box_of(desk.locator(".form__head"))
        assert title["y"] >= readout["y"] + readout["height"]
        desk.keyboard.press("Escape")
        expect(desk.locator(".stage")).to_be_in_viewport(ratio=0.7)
    desk.evaluate("scrollTo(0, 0)")
    desk.keyboard.press("t")
    expect(desk.locator(".defect")).to_have_count(3)
    assert desk.evaluate("scrollY") == 0


def everything_is_undone_and_done_again_also_without_a_line(
    desk: Page, server: Server, inspection: str
) -> None:
    undo, redo = desk.locator("[data-part=undo]"), desk.locator("[data-part=redo]")
    desk.keyboard.press("1")
    desk.keyboard.press("Shift+Digit3")
    desk.keyboard.press("Shift+Digit4")
    expect(undo).to_have_attribute("title", "Undo: severity 3 → 4 of BAB at 0.00 m (U)")
    seek(desk, 5)
    desk.keyboard.press("m")
    expect(desk.locator(".defect__where")).to_have_text(re.compile(r"0\.2[67] m"))
    desk.keyboard.press("s")
    expect_saved(desk)
    desk.context.set_offline(True)
    desk.keyboard.press("Delete")
    expect(desk.locator(".defect")).to_have_count(0)
    for _ in range(3):  # the deletion, the stretch, the move
        desk.keyboard.press("u")
    expect(desk.locator(".defect__where")).to_have_text("0.00 m")
    expect(desk.locator(".save")).to_have_text(re.compile("Waiting"))
    expect_frame(desk, 5)  # undo does not move the picture
    desk.context.set_offline(False)
    expect_saved(desk)
    desk.keyboard.press("Control+z")
    expect(redo).to_have_attribute("title", "Redo: severity 3 → 4 of BAB at 0.00 m (Shift + U)")
    expect_saved(desk)
    [item] = observations(server, inspection)
    assert (item["frame"], item["severity"], item["continuous"]) == (0, 3, None)
    assert item["photo"].endswith("frame=0")
    for key in ("Shift+U", "Control+y", "Control+Shift+Z", "Shift+U"):
        desk.keyboard.press(key)
    expect(desk.locator(".defect")).to_have_count(0)
    expect(desk.locator(".defects__empty")).to_be_visible()
    desk.keyboard.press("u")
    expect(desk.locator(".defect")).to_have_count(1)
    expect_saved(desk)
    [item] = observations(server, inspection)
    assert (item["frame"], item["severity"], item["continuous"][0]) == (5, 4, "A")


def two_tabs_share_one_outbox(desk: Page, server: Server, inspection: str) -> None:
    other = another_tab(desk)
    other.goto(desk.url)
    expect_frame(other, 0)
    desk.context.set_offline(True)
    desk.bring_to_front()
    desk.keyboard.press("1")
    desk.keyboard.press("Shift+Digit1")
    other.bring_to_front()
    expect(other.locator(".save")).to_have_text(re.compile(r"Waiting \([12]\)"))
    other.keyboard.press("2")
    desk.bring_to_front()
    desk.keyboard.press("Shift+Digit3")
    desk.context.set_offline(False)
    for tab in (desk, other):
        tab.bring_to_front()
        expect_saved(tab)
        expect(tab.locator(".defect")).to_have_count(2)
    saved = {item["code"]: item["severity"] for item in observations(server, inspection)}
    assert saved == {"BAB": 3, "BAC": None}
    other.close()
    desk.bring_to_front()


def a_tag_that_cannot_be_stored_stays_and_says_why(
    desk: Page, server: Server, inspection: str
) -> None:
    def far_away(route: Route) -> None:
        route.continue_(post_data=json.dumps(route.request.post_data_json | {"frame": 9999}))

    desk.route("**/observations/*", far_away)
    desk.keyboard.press("1")
    expect(desk.locator(".defect__save")).to_have_text("Not saved: The video has no such frame.")
    desk.reload()
    expect(desk.locator(".defect__save")).to_have_text(re.compile("Not saved: "))
    desk.unroute("**/observations/*", far_away)
    desk.locator(".defect__main").click()
    desk.keyboard.press("e")
    desk.get_by_role("button", name="Send again").click()
    expect_saved(desk)
    expect(desk.locator(".form__body [role=alert]")).to_be_hidden()
    assert [item["frame"] for item in observations(server, inspection)] == [0]

    # The browser's disk is full: it is sent from memory.
    desk.evaluate(
        """() => {
          IDBObjectStore.prototype.put = () => {
            throw new DOMException('', 'QuotaExceededError');
          };
        }"""
    )
    desk.route("**/observations/*", lambda route: route.abort())
    desk.keyboard.press("2")
    expect(desk.get_by_text("gives the page no storage")).to_be_visible()
    expect(desk.locator(".save")).to_have_text("Waiting (1)")
    desk.unroute("**/observations/*")
    expect_saved(desk)
    expect(desk.get_by_text("gives the page no storage")).to_be_hidden()
    assert [item["code"] for item in observations(server, inspection)] == ["BAB", "BAC"]
