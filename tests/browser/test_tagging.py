"""Tag first, details later: quick codes, form, stretches, undo and redo, addresses of places."""

from __future__ import annotations

import json
import re
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest
from clip_surveys import FRAMES
from clips import numbered_clip, wide_rig
from desks import delete_observations, expect_frame, expect_saved, observations
from looks import expect_no_fault
from playwright.sync_api import Page, Route, expect
from steps import Server, log_in, start_inspection
from surveys import Survey

STEP_M = 4 * 8.0 / 600
"""The clip moves by 4 px a frame; its wall is 8 m away at a focal length of 600 px."""
TAG = {"pixel": [159.5, 119.5]}


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


@pytest.fixture
def desk(page: Page, server: Server, empty: str) -> Page:
    """The page of an inspection without any tag, at its first frame."""
    return opened(page, server, empty)


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


def forward(page: Page, count: int) -> None:
    """Frame by frame from the first one, or from the last with `End`."""
    before = page.locator(".transport__frame").inner_text()
    start = int(before.rsplit(" ", 1)[1])
    for step in range(count):
        page.keyboard.press("ArrowRight")
        expect_frame(page, start + step + 1)


def codes(page: Page) -> list[str]:
    return page.locator(".defect__what b").all_text_contents()


def test_keys_tag_the_moving_picture_without_stopping_it(
    page: Page, server: Server, tmp_path: Path
) -> None:
    clip = numbered_clip(tmp_path / "long.mp4", "libx264", frames=240)
    log_in(page, server, "/new")
    inspection = start_inspection(page, server, clip, wide_rig(tmp_path / "rig.json"), "Live")
    expect(page.locator(".stage__badge")).to_be_visible()
    page.wait_for_function(
        "() => document.querySelector('inspection-page').desk?.playhead.value.row"
    )
    for key in ("t", "2", "t", "Pause"):
        page.keyboard.press(key)
    expect(page.locator(".defect")).to_have_count(4)
    assert page.evaluate("document.activeElement === document.body")
    expect(page.locator(".chip")).to_have_text("Done")
    expect_saved(page)
    made = observations(server, inspection)
    assert sorted(item["code"] or "" for item in made) == ["", "", "", "BAC"]
    for item in made:
        assert item["distance_m"] == pytest.approx(item["frame"] * STEP_M, abs=0.02)
        assert item["photo"]


def test_the_form_asks_only_for_what_the_code_needs(desk: Page) -> None:
    desk.keyboard.press("t")
    desk.keyboard.press("Enter")
    code, needs = desk.get_by_label("Code", exact=True), desk.locator(".form__needed:visible")
    expect(code).to_be_focused()
    expect(needs).to_have_count(1)
    expect(desk.get_by_role("slider", name="Clock from")).to_be_hidden()
    code.fill("bab b a")
    code.press("Enter")
    # Enter picks the first of the list, and the row with these very letters is the first.
    expect(desk.locator("#defect-code-label")).to_contain_text("line, edges touching, along")
    expect(desk.get_by_role("slider", name="Clock from")).to_be_visible()
    expect(desk.get_by_label("Quantity", exact=True)).to_be_visible()
    expect(needs).to_have_text(["needed"])  # the width of the crack
    desk.get_by_label("Quantity", exact=True).fill("0,4")
    desk.get_by_label("Remark").focus()
    expect(needs).to_have_count(0)

    code.fill("BCD A")
    code.press("Escape")
    desk.keyboard.press("e")
    code.fill("BDD A")
    code.press("Tab")
    expect(desk.get_by_role("slider", name="Clock from")).to_be_hidden()
    expect(desk.locator(".unit").first).to_have_text("%")
    expect(desk.get_by_label("Quantity 2")).to_be_hidden()
    expect_no_fault(desk)


def test_a_proposal_of_the_project_becomes_the_recommendation_of_a_defect(
    page: Page, server: Server, empty: str
) -> None:
    proposals = [
        {"text": "Watch it.", "cost": 50.0},
        {"text": "Rebuild the wall.", "code": "BAC", "severity_from": 4, "cost": 9000.0},
        {"text": "Seal the crack.", "code": "BAB"},
    ]
    template = {"recommendations": proposals, "costs": True, "currency": "MYR"}
    server.ask("PUT", "/api/report-templates/", template)
    put(server, empty, frame=0, code="BAC", char1="B", severity=4)
    opened(page, server, empty)
    page.get_by_role("button", name="Edit BAC").click()
    advice = page.get_by_label("Recommendation", exact=True)
    proposed = page.get_by_label("Proposed recommendations")
    expect(proposed.locator("option")).to_have_text(
        ["Take a proposal …", "Rebuild the wall. (9000 MYR)", "Watch it. (50 MYR)"]
    )

    proposed.select_option("0")
    expect(advice).to_have_value("Rebuild the wall.")
    expect(advice).to_be_focused()
    expect(page.get_by_label("Estimated cost")).to_have_value("9000")
    page.keyboard.press("End")
    page.keyboard.type(" Close the road.")
    page.get_by_label("Estimated cost").fill("9500,5")
    page.keyboard.press("Escape")
    expect_saved(page)
    [item] = observations(server, empty)
    assert (item["recommendation"], item["cost"]) == ("Rebuild the wall. Close the road.", 9500.5)

    for _ in range(3):  # the cost, the words, the proposal
        page.keyboard.press("u")
    redo = page.locator("[data-part=redo]")
    expect(redo).to_have_attribute("title", re.compile("^Redo: recommendation – → Rebuild"))
    expect_saved(page)
    [item] = observations(server, empty)
    assert (item["recommendation"], item["cost"], item["severity"]) == (None, None, 4)
    expect_no_fault(page)


def test_the_clock_is_set_by_keys_and_by_drawing(desk: Page, server: Server, empty: str) -> None:
    desk.keyboard.press("1")
    desk.keyboard.press("e")
    start, end = (desk.get_by_role("slider", name=f"Clock {name}") for name in ("from", "to"))
    expect(start).to_have_attribute("aria-valuetext", "measured: 6 o’clock")
    expect(end).to_have_attribute("aria-valuetext", "one position")
    start.focus()
    for _ in range(5):
        desk.keyboard.press("ArrowRight")
    expect(start).to_have_attribute("aria-valuenow", "11")
    end.focus()
    for _ in range(3):
        desk.keyboard.press("ArrowUp")
    expect(end).to_have_attribute("aria-valuetext", "2 o’clock")
    expect_saved(desk)
    assert [(item["clock_from"], item["clock_to"]) for item in observations(server, empty)] == [
        (11, 2)
    ]
    # Delete belongs to the dial here, not to the defect.
    desk.keyboard.press("Delete")
    expect(end).to_have_attribute("aria-valuetext", "one position")
    desk.get_by_role("button", name="All round").click()
    expect(start).to_have_attribute("aria-valuetext", "12 o’clock")
    expect(end).to_have_attribute("aria-valuetext", "12 o’clock")

    # Drawn from 3 back to 1 the sector is the short one, 1 to 3.
    face = desk.locator(".dial")
    face.scroll_into_view_if_needed()
    box = face.bounding_box()
    assert box is not None
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    radius = 68 / 198 * box["width"]
    desk.mouse.move(middle[0] + radius, middle[1])
    desk.mouse.down()
    desk.mouse.move(middle[0] + radius * 0.87, middle[1] - radius * 0.5)
    desk.mouse.move(middle[0] + radius * 0.5, middle[1] - radius * 0.87)
    desk.mouse.up()
    expect(desk.locator(".dial__hours-text")).to_have_text("1 – 3")


def test_a_stretch_is_started_changed_and_finished(desk: Page, server: Server, empty: str) -> None:
    desk.keyboard.press("5")
    desk.keyboard.press("s")
    bar = desk.get_by_role("list", name="Open stretches")
    expect(bar).to_contain_text(re.compile(r"A\d+ BBA"))
    forward(desk, 10)
    expect(bar).to_contain_text("0.53 m long")
    desk.keyboard.press("c")
    # The code is the same throughout: what is changed at one place changes at all.
    desk.keyboard.press("e")
    desk.get_by_label("Kind").select_option("C")
    desk.get_by_role("button", name="Done").click()
    forward(desk, 10)
    bar.get_by_role("button", name=re.compile(r"Finish A\d+ BBA here")).click()
    expect(bar).to_be_hidden()
    expect(desk.locator(".defects__count")).to_have_text(
        re.compile(r"1 defect · stretches cover 5\d % of the length")
    )
    expect_saved(desk)
    parts = [(item["continuous"][0], item["char1"]) for item in observations(server, empty)]
    assert parts == [("A", "C"), ("C", "C"), ("B", "C")]
    for _ in range(3):  # the finish, the kind, the change
        desk.keyboard.press("u")
    expect(desk.locator(".defect")).to_have_count(1)
    expect(bar).to_be_visible()


def test_a_stretch_without_a_length_is_asked_about(desk: Page, server: Server, empty: str) -> None:
    desk.keyboard.press("5")
    desk.keyboard.press("s")
    name = desk.locator(".open-stretch b").first
    number = int(name.inner_text().split()[0][1:])
    desk.keyboard.press("f")
    expect(desk.locator(".toast").last).to_contain_text("has no length")
    desk.get_by_role("button", name="Keep one point").click()
    expect(desk.locator(".defect")).to_have_count(1)
    expect_saved(desk)
    assert [item["continuous"] for item in observations(server, empty)] == [None]
    # A number is never used twice.
    desk.keyboard.press("s")
    expect(name).to_have_text(f"A{number + 1} BBA")


def test_two_like_points_far_apart_are_offered_as_a_stretch(
    page: Page, server: Server, empty: str
) -> None:
    put(server, empty, frame=2, code="BBA", char1="A")
    put(server, empty, frame=30, code="BBA", char1="A")
    desk = opened(page, server, empty)
    desk.locator(".defect__main").last.click()
    desk.keyboard.press("e")
    desk.get_by_role("button", name="Make it a stretch from 0.11 m").click()
    expect(desk.locator("[data-part=stretch]")).to_contain_text("finish of stretch")
    expect_saved(desk)
    roles = [item["continuous"][0] for item in observations(server, empty)]
    assert roles == ["A", "B"]
    # It was one step.
    desk.get_by_role("button", name="Done").click()
    desk.keyboard.press("u")
    expect(desk.locator(".toast").last).to_contain_text("Undone: stretch of BBA")
    expect_saved(desk)
    assert [item["continuous"] for item in observations(server, empty)] == [None, None]


def test_everything_is_undone_and_done_again_across_a_restart_of_the_server(
    desk: Page, server: Server, empty: str
) -> None:
    undo, redo = desk.locator("[data-part=undo]"), desk.locator("[data-part=redo]")
    desk.keyboard.press("1")
    desk.keyboard.press("Shift+Digit3")
    desk.keyboard.press("Shift+Digit4")
    expect(undo).to_have_attribute("title", "Undo: severity 3 → 4 of BAB at 0.00 m (U)")
    forward(desk, 5)
    desk.keyboard.press("m")
    expect(desk.locator(".defect__where")).to_have_text(re.compile(r"0\.2[67] m"))
    desk.keyboard.press("s")
    expect_saved(desk)
    server.kill()
    desk.keyboard.press("Delete")
    expect(desk.locator(".defect")).to_have_count(0)
    for _ in range(3):  # the deletion, the stretch, the move
        desk.keyboard.press("u")
    expect(desk.locator(".defect__where")).to_have_text("0.00 m")
    expect(desk.locator(".save")).to_have_text(re.compile("Waiting"))
    expect_frame(desk, 5)  # undo does not move the picture
    server.start()
    expect_saved(desk)
    desk.keyboard.press("Control+z")
    expect(redo).to_have_attribute("title", "Redo: severity 3 → 4 of BAB at 0.00 m (Shift + U)")
    expect_saved(desk)
    [item] = observations(server, empty)
    assert (item["frame"], item["severity"], item["continuous"]) == (0, 3, None)
    assert item["photo"].endswith("frame=0")
    for key in ("Shift+U", "Control+y", "Control+Shift+Z", "Shift+U"):
        desk.keyboard.press(key)
    expect(desk.locator(".defect")).to_have_count(0)
    desk.keyboard.press("u")
    expect(desk.locator(".defect")).to_have_count(1)
    expect_saved(desk)
    [item] = observations(server, empty)
    assert (item["frame"], item["severity"], item["continuous"][0]) == (5, 4, "A")


def test_what_somebody_else_has_changed_is_not_undone_in_silence(
    desk: Page, server: Server, empty: str
) -> None:
    desk.keyboard.press("1")
    desk.keyboard.press("Shift+Digit2")
    expect_saved(desk)
    [item] = observations(server, empty)
    put(server, empty, item["id"], frame=0, code="BAB", severity=5)
    desk.keyboard.press("u")
    expect(desk.locator(".toast")).to_contain_text(
        "Not undone: severity – → 2 of BAB at 0.00 m. Somebody has changed it meanwhile."
    )
    expect(desk.locator(".defect .severity")).to_have_attribute("aria-label", re.compile("5"))
    desk.get_by_role("button", name="Undo it nevertheless").click()
    expect(desk.locator(".defect .severity")).to_have_attribute("aria-label", "not rated")
    expect_saved(desk)
    assert [item["severity"] for item in observations(server, empty)] == [None]


def test_a_change_of_the_header_is_undone_field_by_field(
    page: Page, server: Server, empty: str
) -> None:
    path = f"/api/inspections/{empty}"
    server.ask("PATCH", path, {"header": {"client": "Town"}})
    desk = opened(page, server, empty)
    desk.get_by_role("tab", name="Header").click()
    operator = desk.get_by_role("textbox", name="Operator", exact=True)
    operator.fill("Aisyah")
    operator.press("Tab")
    undo = desk.locator("[data-part=undo]")
    expect(undo).to_have_attribute("title", "Undo: operator – → Aisyah (U)")
    server.ask("PATCH", path, {"header": {"client": "County", "operator": "Aisyah"}})
    undo.click()
    expect(desk.locator(".toast")).to_contain_text("Undone: operator")
    assert json.load(server.ask("GET", path))["header"] == {"client": "County"}


def test_an_address_shows_its_place(page: Page, server: Server, empty: str) -> None:
    log_in(page, server, f"/inspections/{empty}?frame=12")
    expect_frame(page, 12)
    page.goto(f"{server.url}/inspections/{empty}?d=1.07")
    expect_frame(page, 20)
    page.goto(f"{server.url}/inspections/{empty}?t=0.5")
    expect(page.locator(".transport__clock")).to_have_text(re.compile(r"^0:00\.(4[3-9]|50)"))
    page.goto(f"{server.url}/inspections/{empty}?frame=9999")
    expect_frame(page, FRAMES - 1)


def test_the_address_follows_the_selection_and_leads_back_to_it(
    page: Page, server: Server, empty: str
) -> None:
    one = put(server, empty, frame=7, code="BAB")
    put(server, empty, frame=9, code="BAC")
    desk = opened(page, server, empty)
    row = desk.locator(".defect__main").first
    expect(row).to_have_attribute("href", f"/inspections/{empty}?defect={one}")
    row.click()
    expect(desk).to_have_url(f"{server.url}/inspections/{empty}?defect={one}")
    desk.context.grant_permissions(["clipboard-read", "clipboard-write"])
    desk.keyboard.press("y")
    expect(desk.locator(".toast")).to_contain_text("Link copied")
    link = desk.evaluate("navigator.clipboard.readText()")
    desk.keyboard.press("Escape")
    expect(desk).to_have_url(f"{server.url}/inspections/{empty}")
    desk.goto(link)
    expect(row).to_have_attribute("aria-current", "true")
    expect_frame(desk, 7)


def test_of_marks_on_one_spot_of_the_picture_the_gravest_is_taken(
    page: Page, server: Server, empty: str
) -> None:
    put(server, empty, frame=0, severity=1)
    grave = put(server, empty, frame=0, severity=4)
    put(server, empty, frame=0, severity=2)
    desk = opened(page, server, empty)
    expect(desk.locator(".defect")).to_have_count(3)
    desk.locator(".stage__overlay").click()
    expect(desk).to_have_url(f"{server.url}/inspections/{empty}?defect={grave}")


def test_the_list_is_filtered_and_walked_by_keys(page: Page, server: Server, empty: str) -> None:
    put(server, empty, frame=3, code="BAB", char1="B", char2="A", quant1=0.5, severity=5)
    put(server, empty, frame=9, code="BBA", char1="A", remark="by the headwall")
    put(server, empty, frame=15)
    desk = opened(page, server, empty)
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
    expect_no_fault(desk)


def test_two_tabs_share_one_outbox(desk: Page, server: Server, empty: str) -> None:
    other = desk.context.new_page()
    other.goto(desk.url)
    expect_frame(other, 0)
    server.kill()
    desk.bring_to_front()
    desk.keyboard.press("1")
    desk.keyboard.press("Shift+Digit1")
    other.bring_to_front()
    expect(other.locator(".save")).to_have_text(re.compile(r"Waiting \([12]\)"))
    other.keyboard.press("2")
    desk.bring_to_front()
    desk.keyboard.press("Shift+Digit3")
    server.start()
    for tab in (desk, other):
        tab.bring_to_front()
        expect_saved(tab)
        expect(tab.locator(".defect")).to_have_count(2)
    saved = {item["code"]: item["severity"] for item in observations(server, empty)}
    assert saved == {"BAB": 3, "BAC": None}


def test_a_tag_that_the_server_refuses_stays_and_says_why(
    desk: Page, server: Server, empty: str
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
    assert [item["frame"] for item in observations(server, empty)] == [0]


def test_tags_are_sent_from_memory_when_the_browser_keeps_nothing(
    page: Page, server: Server, empty: str
) -> None:
    page.add_init_script("Object.defineProperty(window, 'indexedDB', { value: undefined })")
    opened(page, server, empty)
    expect(page.get_by_text("gives the page no storage")).to_be_visible()
    page.keyboard.press("1")
    expect_saved(page)
    assert [item["code"] for item in observations(server, empty)] == ["BAB"]


def test_a_full_disk_of_the_browser_is_reported(desk: Page, server: Server, empty: str) -> None:
    desk.evaluate(
        """() => {
          IDBObjectStore.prototype.put = () => {
            throw new DOMException('', 'QuotaExceededError');
          };
        }"""
    )
    desk.route("**/observations/*", lambda route: route.abort())
    desk.keyboard.press("1")
    expect(desk.get_by_text("gives the page no storage")).to_be_visible()
    expect(desk.locator(".save")).to_have_text("Waiting (1)")
    desk.unroute("**/observations/*")
    expect_saved(desk)
    expect(desk.get_by_text("gives the page no storage")).to_be_hidden()
    assert [item["code"] for item in observations(server, empty)] == ["BAB"]


def test_the_photo_opens_large_with_its_mark(desk: Page) -> None:
    desk.keyboard.press("1")
    desk.keyboard.press("e")
    desk.get_by_role("button", name="Open the photo").click()
    photo = desk.get_by_role("dialog").get_by_role("img", name=re.compile("Photo of BAB"))
    expect(photo).to_be_visible()
    shown, mark = photo.bounding_box(), desk.locator(".photo__line circle").bounding_box()
    assert shown is not None
    assert mark is not None
    for at, size in (("x", "width"), ("y", "height")):
        middle = shown[at] + shown[size] / 2
        assert mark[at] + mark[size] / 2 == pytest.approx(middle, abs=2)
    expect_no_fault(desk)


def test_a_pedal_tags_while_a_form_is_filled_in(desk: Page) -> None:
    desk.keyboard.press("1")
    desk.keyboard.press("e")
    desk.get_by_label("Remark").fill("half a sent")
    desk.keyboard.press("Pause")
    expect(desk.locator("#tab-defects")).to_contain_text("2")
    expect(desk.get_by_label("Remark")).to_be_focused()
    expect(desk.get_by_label("Remark")).to_have_value("half a sent")


def test_a_click_in_the_3d_view_tags_the_wall_or_selects_the_pin(
    desk: Page, server: Server, empty: str
) -> None:
    dispatch = """([type, detail]) => document.querySelector('inspection-page').desk.live
        .dispatchEvent(new CustomEvent(type, { detail }))"""
    desk.evaluate(dispatch, ["wall_click", {"distance_m": 0.8, "clock_h": 6.0, "lateral_m": 0.0}])
    expect(desk.locator(".defect__where")).to_have_text(re.compile(r"0\.(79|80) m"))
    expect_saved(desk)
    [item] = observations(server, empty)
    assert item["distance_m"] == pytest.approx(0.8, abs=0.02)
    desk.keyboard.press("Escape")
    desk.evaluate(dispatch, ["pin_click", {"observation": item["id"]}])
    expect(desk.locator(".defect__main")).to_have_attribute("aria-current", "true")
    expect_frame(desk, item["frame"])
