"""Two people change the same thing: both versions are shown, and who was second decides.

What is then stored is tried below the page: `tests/javascript/lost-updates.test.js`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from clip_surveys import FRAMES
from desks import ask, expect_frame, expect_read
from looks import expect_no_fault
from playwright.sync_api import Locator, Page, Route, expect
from steps import Server, log_in

ID = "0123abcd-0000-4000-8000-00000000cafe"
TAG = {"frame": 4, "pixel": [159.5, 119.5], "code": "BAB", "severity": 2}
UNSTATED = {"zero": None, "lengths": [], "rig_sigma": None, "forced": None, "remark": None} | {
    "joints": {"use": None, "marked": [], "left_out": []}
}
LINE = re.compile("/live")
"""On which a page hears what others change."""
SCREENS = [(1440, 900), (1366, 768), (1024, 768), (390, 844)]


@pytest.fixture(scope="module")
def server(narrow_server: Server) -> Server:
    return narrow_server


@pytest.fixture
def path(server: Server, inspection: str) -> str:
    """The address of an inspection in the API, with one tag and an empty header, nothing stated."""
    tracked = f"/api/inspections/{inspection}"
    for item in read(server, f"{tracked}/observations")["observations"]:
        server.ask("DELETE", f"{tracked}/observations/{item['id']}")
    change_as_another(server, tracked)
    server.ask("PUT", f"{tracked}/corrections", UNSTATED)
    server.ask("PATCH", tracked, {"header": {}})
    return tracked


def opened(page: Page, server: Server, path: str) -> Page:
    """The page with the list of defects; it hears of no change, as when its line is silent."""
    page.route_web_socket(LINE, lambda line: None)
    log_in(page, server, path.removeprefix("/api"))
    expect(page.locator(".defect")).to_have_count(1)
    expect_read(page)
    return page


def read(server: Server, path: str) -> dict:
    return dict(json.load(server.ask("GET", path)))


def tag_of(server: Server, path: str) -> dict:
    """What is entered about the one defect."""
    [item] = read(server, f"{path}/observations")["observations"]
    return {name: item[name] for name in (*TAG, "remark")}


def change_as_another(server: Server, path: str, **fields: object) -> None:
    server.ask("PUT", f"{path}/observations/{ID}", TAG | fields)


def rate(page: Page, grade: int) -> None:
    page.locator(".defect__main").click()
    page.keyboard.press(f"Shift+Digit{grade}")


def delete(page: Page) -> None:
    page.locator(".defect__main").click()
    page.keyboard.press("Delete")


def enter_remark(page: Page) -> Locator:
    """The cursor is in the remark of the defect."""
    page.locator(".defect__main").click()
    page.keyboard.press("e")
    ask(page, "remark")
    field = page.get_by_label("Remark", exact=True)
    field.focus()
    return field


def write_remark(page: Page, text: str) -> None:
    enter_remark(page).fill(text)
    page.keyboard.press("Escape")


def question(page: Page) -> Locator:
    found = page.get_by_role("dialog", name=re.compile("^Two versions of"))
    expect(found).to_be_visible()
    return found


def versions(asked: Locator) -> dict[str, tuple[str, str, bool]]:
    """By field: mine, theirs, and whether they are marked as different."""
    rows = asked.locator("tbody tr").evaluate_all(
        """(rows) => rows.map((row) => [
          row.querySelector('th').innerText.split('\\n')[0],
          ...[...row.querySelectorAll('td')].map((cell) => cell.innerText),
          row.innerText.includes('differs'),
        ])"""
    )
    return {label: (mine, theirs, is_other) for label, mine, theirs, is_other in rows}


def decide(page: Page, answer: str) -> None:
    question(page).get_by_role("button", name=answer, exact=True).click()
    expect(page.get_by_role("dialog")).to_have_count(0)


def expect_settled(page: Page) -> None:
    expect(page.locator(".save")).to_have_text("Saved")
    expect(page.locator("conflict-notice")).to_be_hidden()


@contextmanager
def cut_off(page: Page) -> Iterator[None]:
    """The page cannot read the list by itself, as it does for photos: it does not know what another
    changes meanwhile.
    """
    page.context.set_offline(True)
    yield
    page.context.set_offline(False)


def read_list_again(page: Page) -> None:
    """As the page does for a missing photo, or for distances that were corrected."""
    page.evaluate("() => document.querySelector('inspection-page').desk.observations.load()")


def test_who_was_second_is_asked_about_a_defect_the_header_and_corrections(
    page: Page, server: Server, path: str
) -> None:
    state_zero(server, path, 0.0)
    desk = opened(page, server, path)
    for step in (
        both_versions_are_shown_and_what_is_decided_later_stays_in_sight,
        a_question_that_is_overtaken_shows_the_newest_version_and_whose_it_is,
        what_is_typed_is_asked_about_only_where_the_text_before_it_is_no_longer_stored,
        a_deletion_is_asked_about,
        a_field_of_the_header_is_asked_about_and_others_are_all_kept,
        corrections_are_asked_about_and_wait_as_a_draft,
    ):
        change_as_another(server, path)
        read_list_again(desk)
        step(desk, server, path)


def both_versions_are_shown_and_what_is_decided_later_stays_in_sight(
    desk: Page, server: Server, path: str
) -> None:
    with cut_off(desk):
        change_as_another(server, path, severity=4, remark="roots")
        rate(desk, 3)
    asked = question(desk)
    assert versions(asked) == {
        "Code": ("BAB Crack", "BAB Crack", False),
        "Severity": ("severity 3, watch", "severity 4, plan repair", True),
        "Remark": ("–", "roots", True),
        "Place": ("Frame 4 · pixel 160, 120", "Frame 4 · pixel 160, 120", False),
    }
    expect(asked).to_contain_text(re.compile(r"By .+, .+\."))
    # A key that was meant for the film decides nothing.
    expect(asked.get_by_role("button", name="Close")).to_be_focused()
    for name in ("Decide later", "Take theirs", "Keep mine"):
        desk.keyboard.press("Tab")
        expect(asked.get_by_role("button", name=name)).to_be_focused()
    expect_no_fault(desk, within="dialog[open]")
    desk.keyboard.press("Escape")

    expect(desk.get_by_role("dialog")).to_have_count(0)
    expect(desk.locator(".save")).to_have_text("Undecided (1)")
    expect(desk.locator(".defect__save--refused")).to_be_visible()
    notice = desk.locator("conflict-notice")
    expect(notice).to_contain_text("1 change waits for your decision")
    expect_no_fault(desk, ("light",), within="conflict-notice")
    notice.get_by_role("button", name="Compare").click()
    question(desk)
    desk.keyboard.press("Escape")
    # From the form of the defect, too.
    enter_remark(desk)
    desk.locator("defect-form").get_by_role("button", name="Compare").click()
    question(desk)
    desk.keyboard.press("Escape")
    # It outlives the page, which asks again once it has read the list.
    held: list[Route] = []
    desk.route("**/observations", lambda route: held.append(route))
    with desk.expect_request("**/observations"):
        desk.reload()
    expect(desk.locator(".save")).to_have_text("Undecided (1)")
    expect(desk.get_by_role("dialog")).to_have_count(0)
    held[-1].continue_()
    desk.unroute("**/observations")
    decide(desk, "Take theirs")
    expect(desk.locator(".defect__more")).to_contain_text("roots")
    expect_settled(desk)

    # On every screen the answers are in sight, also of a long text.
    long = {"remark": "Roots through the joint, from the crown down to the bench. " * 4}
    with cut_off(desk):
        change_as_another(server, path, severity=4, quant1=35, clock_from=10, clock_to=2, **long)
        rate(desk, 3)
    asked = question(desk)
    for width, height in SCREENS:
        desk.set_viewport_size({"width": width, "height": height})
        for name in ("Keep mine", "Take theirs", "Decide later"):
            expect(asked.get_by_role("button", name=name)).to_be_in_viewport(ratio=1)
        assert asked.evaluate("(dialog) => dialog.scrollWidth <= dialog.clientWidth")
    decide(desk, "Keep mine")
    expect_settled(desk)
    desk.set_viewport_size({"width": 1440, "height": 900})
    assert tag_of(server, path) == TAG | {"severity": 3, "remark": "roots"}


def a_deletion_is_asked_about(desk: Page, server: Server, path: str) -> None:
    with cut_off(desk):
        change_as_another(server, path, severity=5, remark="roots")
        delete(desk)
    asked = question(desk)
    expect(asked.get_by_role("heading")).to_have_text("Two versions of BAB at 0.00 m")
    expect(asked).to_contain_text("You deleted it, and somebody else changed it")
    expect(asked.locator("thead")).to_contain_text("Theirs, saved")
    expect(asked.locator("tbody")).to_contain_text("severity 5, act now")
    expect(asked.locator("td")).to_have_count(asked.locator("tbody tr").count())
    # Until then it is in the list.
    expect(desk.locator(".defect__save--refused")).to_be_attached()
    expect(desk.locator(".defect__more")).to_contain_text("roots")
    decide(desk, "Delete it nevertheless")
    expect(desk.locator(".defect")).to_have_count(0)
    expect_settled(desk)
    assert read(server, f"{path}/observations")["observations"] == []

    # What was deleted elsewhere comes back only when it is wanted.
    desk.keyboard.press("u")
    expect(desk.locator(".defect")).to_have_count(1)
    expect_settled(desk)
    with cut_off(desk):
        server.ask("DELETE", f"{path}/observations/{ID}")
        rate(desk, 3)
    expect(question(desk)).to_contain_text("it was deleted")
    decide(desk, "Leave it deleted")
    expect(desk.locator(".defect")).to_have_count(0)
    expect_settled(desk)


def what_is_typed_is_asked_about_only_where_the_text_before_it_is_no_longer_stored(
    desk: Page, server: Server, path: str
) -> None:
    remark = enter_remark(desk)
    remark.press_sequentially("crack")
    expect_settled(desk)
    change_as_another(server, path, remark="crack, roots 30 %")
    read_list_again(desk)
    expect(remark).to_have_value("crack")
    remark.press("Tab")
    expect(remark).to_have_value("crack, roots 30 %")
    expect_settled(desk)
    assert tag_of(server, path)["remark"] == "crack, roots 30 %"
    # What follows is made of what the field shows now.
    remark.focus()
    remark.press("End")
    remark.press_sequentially("!")
    expect_settled(desk)
    assert tag_of(server, path)["remark"] == "crack, roots 30 %!"
    desk.get_by_role("button", name="Done").click()


def a_question_that_is_overtaken_shows_the_newest_version_and_whose_it_is(
    desk: Page, server: Server, path: str
) -> None:
    with cut_off(desk):
        change_as_another(server, path, remark="first")
        write_remark(desk, "second")
    assert versions(question(desk))["Remark"] == ("second", "first", True)
    change_as_another(server, path, severity=5, remark="first")  # meanwhile
    question(desk).get_by_role("button", name="Keep mine").click()
    expect(question(desk)).to_contain_text("severity 5, act now")
    decide(desk, "Take theirs")
    expect_settled(desk)
    assert tag_of(server, path) == TAG | {"severity": 5, "remark": "first"}
    as_van = {"Authorization": f"Bearer {server.make_token('Van 2', 'operator')}"}
    with cut_off(desk):
        server.ask("PUT", f"{path}/observations/{ID}", TAG | {"severity": 1}, as_van)
        rate(desk, 0)
    expect(question(desk)).to_contain_text("By Van 2")
    decide(desk, "Take theirs")


def header_of(server: Server, path: str) -> dict:
    return dict(read(server, path)["header"])


def fill_header(page: Page, label: str, text: str) -> None:
    field = page.get_by_role("textbox", name=label, exact=True)
    field.fill(text)
    field.blur()


def a_field_of_the_header_is_asked_about_and_others_are_all_kept(
    desk: Page, server: Server, path: str
) -> None:
    desk.get_by_role("tab", name="Header").click()
    asset = desk.get_by_role("textbox", name="Asset", exact=True)
    client = desk.get_by_role("textbox", name="Client", exact=True)
    state = desk.locator(".header-panel__state")
    expect(client).to_be_visible()
    server.ask("PATCH", path, {"header": {"client": "JKR"}})
    fill_header(desk, "Asset", "KL-204")
    expect(state).to_have_text("Saved")
    expect(client).to_have_value("JKR")
    assert header_of(server, path) == {"asset_id": "KL-204", "client": "JKR"}
    # Undo takes back the own field only.
    desk.locator("[data-part=undo]").click()
    expect(asset).to_have_value("")
    assert header_of(server, path) == {"client": "JKR"}

    for answer, kept in (("Keep mine", "KL-204"), ("Take theirs", "KL-9")):
        server.ask("PATCH", path, {"header": {"asset_id": "KL-9", "height_mm": 600}})
        fill_header(desk, "Asset", "KL-204")
        assert versions(question(desk)) == {"Asset": ("KL-204", "KL-9", True)}
        desk.keyboard.press("Escape")
        expect(desk.locator("#header-asset_id-fault")).not_to_be_empty()
        expect(asset).to_have_value("KL-204")
        if answer == "Keep mine":  # it outlives the page
            desk.reload()
            desk.get_by_role("tab", name="Header").click()
        else:
            desk.locator("conflict-notice").get_by_role("button", name="Compare").click()
        question(desk)
        assert header_of(server, path)["asset_id"] == "KL-9"
        decide(desk, answer)
        expect(state).to_have_text("Saved")
        expect(asset).to_have_value(kept)
        expect_settled(desk)
        assert header_of(server, path) == {"asset_id": kept, "height_mm": 600}
        # The next change is made of it.
        fill_header(desk, "Asset", "KL-205")
        expect(state).to_have_text("Saved")
        assert header_of(server, path)["asset_id"] == "KL-205"

    # What was typed offline does not undo a newer value.
    desk.context.set_offline(True)
    fill_header(desk, "Asset", "KL-1")
    expect(state).to_contain_text("cannot be reached")
    fill_header(desk, "Asset", "KL-2")
    server.ask("PATCH", path, {"header": {"asset_id": "KL-9"}})
    desk.context.set_offline(False)
    assert versions(question(desk)) == {"Asset": ("KL-2", "KL-9", True)}
    decide(desk, "Keep mine")
    expect_settled(desk)
    assert header_of(server, path) == {"asset_id": "KL-2"}


def state_zero(server: Server, path: str, offset_m: float) -> None:
    zero = {"zero": {"frame": 2, "offset_m": offset_m}}
    server.ask("PUT", f"{path}/corrections", UNSTATED | zero)


def corrections_are_asked_about_and_wait_as_a_draft(desk: Page, server: Server, path: str) -> None:
    desk.get_by_role("tab", name="Corrections").click()
    offset = desk.locator("corrections-panel").get_by_label("Camera ahead of the zero by")
    apply = desk.get_by_role("button", name="Apply")
    offset.fill("1")
    desk.keyboard.press("Enter")
    expect(apply).to_be_enabled()
    state_zero(server, path, 0.75)
    apply.click()
    found = versions(question(desk))
    assert found["Zero"] == ("frame 2, 1.00 m", "frame 2, 0.75 m", True)
    assert not any(is_other for name, (_, _, is_other) in found.items() if name != "Zero")
    desk.keyboard.press("Escape")
    expect(offset).to_have_value("1")
    expect(desk.locator("conflict-notice")).to_be_visible()
    apply.click()
    decide(desk, "Take theirs")
    expect_settled(desk)
    expect(offset).to_have_value("0.75")
    expect(apply).to_be_hidden()
    assert read(server, f"{path}/corrections")["stated"]["zero"]["offset_m"] == 0.75

    # A zero that is set by a key waits as a draft, too, and outlives the page.
    desk.keyboard.press("Escape")
    desk.locator(".transport__frame").click()
    desk.keyboard.press("End")
    expect_frame(desk, FRAMES - 1)
    state_zero(server, path, 0.9)
    desk.keyboard.press("z")
    assert versions(question(desk))["Zero"][1] == "frame 2, 0.90 m"
    desk.keyboard.press("Escape")
    expect(apply).to_be_enabled()
    desk.reload()
    question(desk)
    expect(desk.locator(".save")).to_have_text("Undecided (1)")
    desk.keyboard.press("Escape")
    desk.locator("conflict-notice").get_by_role("button", name="Compare").click()
    decide(desk, "Keep mine")
    expect_settled(desk)
    assert read(server, f"{path}/corrections")["stated"]["zero"]["frame"] == FRAMES - 1
    desk.get_by_role("status").get_by_role("button", name="Undo").click()
    expect(desk.get_by_role("status").filter(has_text="Undone")).to_be_visible()
    assert read(server, f"{path}/corrections")["stated"]["zero"]["offset_m"] == 0.9
