"""Two people change the same thing: nobody loses anything, and who was second decides."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import pytest
from clip_surveys import FRAMES
from desks import expect_read
from looks import expect_no_fault
from playwright.sync_api import Browser, Locator, Page, Route, expect
from steps import TOKEN, Server, log_in
from surveys import Survey

ID = "0123abcd-0000-4000-8000-00000000cafe"
TAG = {"frame": 4, "pixel": [159.5, 119.5], "code": "BAB", "severity": 2}
UNSTATED = {"zero": None, "lengths": [], "rig_sigma": None, "forced": None, "remark": None} | {
    "joints": {"use": None, "marked": [], "left_out": []}
}
SCREENS = [(1440, 900), (1366, 768), (1024, 768), (390, 844)]


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def tracked(narrow: Survey) -> str:
    return f"/api/inspections/{narrow.id}"


@pytest.fixture
def path(server: Server, tracked: str) -> str:
    """The address of an inspection in the API, with one tag and an empty header, nothing stated."""
    for item in read(server, f"{tracked}/observations")["observations"]:
        server.ask("DELETE", f"{tracked}/observations/{item['id']}")
    server.ask("PUT", f"{tracked}/observations/{ID}", TAG)
    server.ask("PUT", f"{tracked}/corrections", UNSTATED)
    server.ask("PATCH", tracked, {"header": {}})
    return tracked


@pytest.fixture
def desk(page: Page, server: Server, path: str) -> Page:
    return opened(page, server, path)


def opened(page: Page, server: Server, path: str, token: str = TOKEN, *, defects: int = 1) -> Page:
    """The page with the list of defects; it hears of no change, as when its line is silent."""
    page.route_web_socket(re.compile("/live"), lambda line: None)
    log_in(page, server, path.removeprefix("/api"), token)
    expect_listed(page, defects)
    return page


def reload(page: Page) -> None:
    page.reload()
    expect_listed(page, 1)


def expect_listed(page: Page, defects: int) -> None:
    expect(page.locator(".defect")).to_have_count(defects)
    expect_read(page)


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


def write_remark(page: Page, text: str) -> None:
    page.locator(".defect__main").click()
    page.keyboard.press("e")
    page.get_by_label("Remark").fill(text)
    page.keyboard.press("Escape")


def question(page: Page) -> Locator:
    found = page.get_by_role("dialog", name=re.compile("^Two versions of"))
    expect(found).to_be_visible()
    return found


def versions(asked: Locator) -> dict[str, tuple[str, str, bool]]:
    """By field: mine, theirs, and whether they are marked as different."""
    rows = {}
    for row in asked.locator("tbody tr").all():
        label = row.locator("th").inner_text().split("\n")[0]
        mine, theirs = row.locator("td").all_inner_texts()
        rows[label] = (mine, theirs, row.get_by_text("differs").count() == 1)
    return rows


def decide(page: Page, answer: str) -> None:
    question(page).get_by_role("button", name=answer, exact=True).click()
    expect(page.get_by_role("dialog")).to_have_count(0)


def expect_settled(page: Page) -> None:
    expect(page.locator(".save")).to_have_text("Saved")
    expect(page.locator("conflict-notice")).to_be_hidden()


def test_both_versions_are_shown_and_mine_is_kept(desk: Page, server: Server, path: str) -> None:
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
    assert tag_of(server, path)["severity"] == 4
    decide(desk, "Keep mine")
    expect_settled(desk)
    assert tag_of(server, path) == TAG | {"severity": 3, "remark": None}


def test_theirs_is_taken(desk: Page, server: Server, path: str) -> None:
    change_as_another(server, path, severity=4, remark="roots")
    rate(desk, 3)
    question(desk)
    decide(desk, "Take theirs")
    expect(desk.locator(".defect__more")).to_contain_text("roots")
    expect_settled(desk)
    assert tag_of(server, path) == TAG | {"severity": 4, "remark": "roots"}
    # What follows is made of theirs.
    rate(desk, 5)
    expect_settled(desk)
    assert tag_of(server, path) == TAG | {"severity": 5, "remark": "roots"}


def hold_list(page: Page) -> list[Route]:
    """Leaves the questions for the list of defects unanswered and returns them."""
    held: list[Route] = []
    page.route("**/observations", lambda route: held.append(route))
    return held


def test_what_follows_at_once_is_made_of_theirs(desk: Page, server: Server, path: str) -> None:
    change_as_another(server, path, severity=4, remark="roots")
    rate(desk, 3)
    question(desk)
    hold_list(desk)
    with desk.expect_request("**/observations"):
        decide(desk, "Take theirs")
    expect(desk.locator(".defect__more")).to_contain_text("roots")
    rate(desk, 5)
    expect_settled(desk)
    assert tag_of(server, path) == TAG | {"severity": 5, "remark": "roots"}


def test_nothing_is_asked_before_the_list_is_read(desk: Page, server: Server, path: str) -> None:
    change_as_another(server, path, severity=5, remark="roots")
    delete(desk)
    question(desk)
    held = hold_list(desk)
    with desk.expect_request("**/observations"):
        desk.reload()
    expect(desk.locator(".save")).to_have_text("Undecided (1)")
    expect(desk.get_by_role("dialog")).to_have_count(0)
    held[-1].continue_()
    desk.unroute("**/observations")
    decide(desk, "Delete it nevertheless")
    expect_settled(desk)
    desk.keyboard.press("u")
    expect(desk.locator(".defect")).to_have_count(1)
    expect_settled(desk)
    assert tag_of(server, path) == TAG | {"severity": 5, "remark": "roots"}


def test_what_was_deleted_comes_back_only_when_it_is_wanted(
    desk: Page, server: Server, path: str
) -> None:
    for answer, grade, left in (
        ("Bring it back with my change", 3, [3]),
        ("Leave it deleted", 4, []),
    ):
        server.ask("DELETE", f"{path}/observations/{ID}")
        rate(desk, grade)
        expect(question(desk)).to_contain_text("it was deleted")
        assert read(server, f"{path}/observations")["observations"] == []
        decide(desk, answer)
        expect(desk.locator(".defect")).to_have_count(len(left))
        expect_settled(desk)
        kept = read(server, f"{path}/observations")["observations"]
        assert [item["severity"] for item in kept] == left


def delete(page: Page) -> None:
    page.locator(".defect__main").click()
    page.keyboard.press("Delete")


@pytest.mark.parametrize(("answer", "left"), [("Keep theirs", 1), ("Delete it nevertheless", 0)])
def test_what_somebody_else_has_changed_is_deleted_only_when_it_is_wanted(
    desk: Page, server: Server, path: str, answer: str, left: int
) -> None:
    rate(desk, 3)
    expect_settled(desk)
    change_as_another(server, path, severity=5, remark="roots")
    delete(desk)
    asked = question(desk)
    expect(asked.get_by_role("heading")).to_have_text("Two versions of BAB at 0.01 m")
    expect(asked).to_contain_text("You deleted it, and somebody else changed it")
    expect(asked.locator("thead")).to_contain_text("Theirs, saved")
    expect(asked.locator("tbody")).to_contain_text("severity 5, act now")
    expect(asked.locator("td")).to_have_count(asked.locator("tbody tr").count())
    assert tag_of(server, path)["severity"] == 5
    desk.keyboard.press("Escape")
    # It is in the list again, and outlives the page, which asks again.
    expect(desk.locator(".defect__save--refused")).to_be_visible()
    expect(desk.locator(".defect__more")).to_contain_text("roots")
    desk.reload()
    decide(desk, answer)
    expect(desk.locator(".defect")).to_have_count(left)
    expect_settled(desk)
    assert len(read(server, f"{path}/observations")["observations"]) == left
    if left == 0:
        desk.keyboard.press("u")
        expect(desk.locator(".defect")).to_have_count(1)
        expect_settled(desk)
    # What was deleted as they had changed it comes back so.
    assert tag_of(server, path) == TAG | {"severity": 5, "remark": "roots"}


def test_a_list_that_was_read_before_a_deletion_does_not_bring_it_back(
    desk: Page, server: Server, path: str
) -> None:
    older = read(server, f"{path}/observations")
    sent: list[Route] = []
    held: list[Route] = []
    desk.route(f"**/observations/{ID}", lambda route: sent.append(route))
    desk.route("**/observations", lambda route: held.append(route))
    with desk.expect_request(f"**/observations/{ID}"):
        delete(desk)
    with desk.expect_request("**/observations"):
        desk.evaluate(
            """() => {
              const { desk } = document.querySelector('inspection-page');
              window.reading = desk.observations.load();
            }"""
        )
    sent[0].continue_()
    expect_settled(desk)
    desk.unroute("**/observations")
    held[0].fulfill(json=older)
    desk.evaluate("() => window.reading")
    expect(desk.locator(".defect")).to_have_count(0)


def test_a_deletion_is_decided_in_any_tab(desk: Page, server: Server, path: str) -> None:
    other = desk.context.new_page()
    other.goto(desk.url.split("?")[0])
    expect_listed(other, 1)
    change_as_another(server, path, severity=5)
    delete(desk)
    for page in (desk, other):
        expect(question(page)).to_contain_text("You deleted it")
    decide(other, "Delete it nevertheless")
    for page in (desk, other):
        expect(page.get_by_role("dialog")).to_have_count(0)
        expect(page.locator(".defect")).to_have_count(0)
        expect_settled(page)
    assert read(server, f"{path}/observations")["observations"] == []


def test_a_refused_deletion_that_is_undone_is_no_question_any_more(
    desk: Page, server: Server, path: str
) -> None:
    desk.context.set_offline(True)
    rate(desk, 3)
    delete(desk)
    change_as_another(server, path, severity=5)
    desk.context.set_offline(False)
    expect(question(desk)).to_contain_text("You deleted it")
    desk.keyboard.press("Escape")
    desk.keyboard.press("u")
    # The grade before it is still a question, until it is undone too.
    found = versions(question(desk))
    assert found["Severity"] == ("severity 3, watch", "severity 5, act now", True)
    desk.keyboard.press("Escape")
    desk.keyboard.press("u")
    expect_settled(desk)
    expect(desk.locator(".defect .severity")).to_have_attribute("aria-label", "severity 5, act now")
    assert tag_of(server, path)["severity"] == 5


def test_a_deletion_that_was_undone_offline_changes_nothing(
    desk: Page, server: Server, path: str
) -> None:
    desk.context.set_offline(True)
    delete(desk)
    desk.keyboard.press("u")
    expect(desk.locator(".defect")).to_have_count(1)
    change_as_another(server, path, severity=5)
    desk.context.set_offline(False)
    expect_settled(desk)
    expect(desk.locator(".defect .severity")).to_have_attribute("aria-label", "severity 5, act now")
    assert tag_of(server, path)["severity"] == 5


def test_own_changes_and_their_deletion_are_no_question(
    desk: Page, server: Server, path: str
) -> None:
    desk.context.set_offline(True)
    rate(desk, 3)
    write_remark(desk, "wet")
    delete(desk)
    expect(desk.locator(".defect")).to_have_count(0)
    desk.context.set_offline(False)
    expect_settled(desk)
    assert read(server, f"{path}/observations")["observations"] == []
    desk.keyboard.press("u")
    expect(desk.locator(".defect")).to_have_count(1)
    expect_settled(desk)
    assert tag_of(server, path) == TAG | {"severity": 3, "remark": "wet"}
    # What is already gone is no question either.
    server.ask("DELETE", f"{path}/observations/{ID}")
    delete(desk)
    expect(desk.locator(".defect")).to_have_count(0)
    expect_settled(desk)
    expect(desk.get_by_role("dialog")).to_have_count(0)


def test_what_is_decided_later_stays_in_sight(desk: Page, server: Server, path: str) -> None:
    change_as_another(server, path, severity=4)
    write_remark(desk, "wet")
    question(desk)
    desk.keyboard.press("Escape")
    expect(desk.get_by_role("dialog")).to_have_count(0)
    expect(desk.locator(".save")).to_have_text("Undecided (1)")
    expect(desk.locator(".defect__save--refused")).to_be_visible()
    expect(desk.locator(".defect__more")).to_contain_text("wet")
    notice = desk.locator("conflict-notice")
    expect(notice).to_contain_text("1 change waits for your decision")
    notice.get_by_role("button", name="Compare").click()
    expect(question(desk)).to_contain_text("wet")
    desk.keyboard.press("Escape")
    # From the form of the defect, too.
    desk.locator(".defect__main").click()
    desk.keyboard.press("e")
    desk.locator("defect-form").get_by_role("button", name="Compare").click()
    question(desk)
    desk.keyboard.press("Escape")
    # It outlives the page, which asks again.
    desk.reload()
    expect(question(desk)).to_contain_text("wet")
    decide(desk, "Keep mine")
    expect_settled(desk)
    assert tag_of(server, path) == TAG | {"remark": "wet"}


def test_own_changes_follow_each_other(desk: Page, server: Server, path: str) -> None:
    """Typed letters, a grade and undo, while each is sent or was not answered yet."""
    rate(desk, 3)
    desk.keyboard.press("e")
    remark = desk.get_by_label("Remark")
    for word in ("wet", " and", " cracked"):
        remark.press("End")
        remark.press_sequentially(word)
        desk.locator(f"input[name=severity][value='{len(word) % 5}']").check(force=True)
    desk.keyboard.press("Escape")
    expect_settled(desk)
    assert tag_of(server, path) == TAG | {"severity": 3, "remark": "wet and cracked"}
    undo = desk.locator("[data-part=undo]")
    for _ in range(8):  # more than there are
        desk.keyboard.press("u")
    expect(undo).to_be_disabled()
    expect_settled(desk)
    expect(desk.get_by_role("dialog")).to_have_count(0)
    assert tag_of(server, path) == TAG | {"remark": None}


def test_a_change_whose_answer_was_lost_is_no_conflict(
    desk: Page, server: Server, path: str
) -> None:
    lost = 0

    def lose(route: Route) -> None:
        nonlocal lost
        lost += 1
        route.fetch()
        route.abort()

    desk.route(f"**/observations/{ID}", lose)
    rate(desk, 3)
    expect(desk.locator(".save")).to_have_text("Waiting (1)")
    desk.wait_for_function("() => document.querySelector('.save').title")
    write_remark(desk, "made of what has arrived")
    rate(desk, 5)
    assert tag_of(server, path)["severity"] == 3
    # Another page of this browser sends them.
    other = desk.context.new_page()
    desk.close()
    assert lost > 0
    other.goto(server.url + path.removeprefix("/api"))
    expect_settled(other)
    expect(other.get_by_role("dialog")).to_have_count(0)
    assert tag_of(server, path) == TAG | {"severity": 5, "remark": "made of what has arrived"}


def test_a_page_that_was_offline_finds_a_newer_version(
    desk: Page, server: Server, path: str
) -> None:
    desk.context.set_offline(True)
    rate(desk, 3)
    write_remark(desk, "offline")
    expect(desk.locator(".save")).to_contain_text("Waiting")
    change_as_another(server, path, severity=4)
    desk.context.set_offline(False)
    found = versions(question(desk))
    assert found["Severity"] == ("severity 3, watch", "severity 4, plan repair", True)
    assert found["Remark"] == ("offline", "–", True)
    assert tag_of(server, path)["severity"] == 4
    decide(desk, "Keep mine")
    expect_settled(desk)
    assert tag_of(server, path) == TAG | {"severity": 3, "remark": "offline"}
    assert "offline" not in desk.evaluate("JSON.stringify(localStorage)")


def test_a_refused_change_that_is_undone_is_no_question_any_more(
    desk: Page, server: Server, path: str
) -> None:
    change_as_another(server, path, severity=4)
    rate(desk, 3)
    question(desk)
    desk.keyboard.press("Escape")
    desk.keyboard.press("u")
    expect(desk.locator(".defect .severity")).to_have_attribute(
        "aria-label", "severity 4, plan repair"
    )
    expect_settled(desk)
    expect(desk.get_by_role("dialog")).to_have_count(0)
    assert tag_of(server, path)["severity"] == 4


def read_list_again(page: Page) -> None:
    """As the page does for a missing photo, or for distances that were corrected."""
    page.evaluate("() => document.querySelector('inspection-page').desk.observations.load()")


def enter(page: Page, label: str) -> Locator:
    """The cursor is in a field of the defect."""
    page.locator(".defect__main").click()
    page.keyboard.press("e")
    field = page.get_by_label(label, exact=True)
    field.focus()
    return field


@pytest.mark.parametrize(
    ("label", "name", "values"),
    [
        ("Remark", "remark", ("crack", "crack, roots 30 %", "cracks")),
        ("Quantity", "quant1", (3, 35, 4)),
        ("Code", "code", ("BAB", "BAC", "BAF")),
    ],
)
def test_what_is_typed_over_a_text_that_is_no_longer_stored_is_asked_about(
    desk: Page, server: Server, path: str, label: str, name: str, values: tuple[object, ...]
) -> None:
    shown, theirs, typed = values
    change_as_another(server, path, **{name: shown})
    read_list_again(desk)
    field = enter(desk, label)
    expect(field).to_have_value(str(shown))
    change_as_another(server, path, **{name: theirs}, severity=4)
    read_list_again(desk)
    expect(field).to_have_value(str(shown))
    field.fill(str(typed))
    found = versions(question(desk))
    assert [row for row, (_, _, is_other) in found.items() if is_other] == [label]
    assert tag_of(server, path)["severity"] == 4
    decide(desk, "Take theirs")
    expect(field).to_have_value(str(theirs))
    expect_settled(desk)
    [item] = read(server, f"{path}/observations")["observations"]
    assert item[name] == theirs


def test_a_field_that_is_left_saves_only_what_was_typed_into_it(
    desk: Page, server: Server, path: str
) -> None:
    remark = enter(desk, "Remark")
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


def test_several_questions_follow_each_other(page: Page, server: Server, path: str) -> None:
    second = ID[:-1] + "d"
    server.ask("PUT", f"{path}/observations/{second}", TAG | {"frame": 8, "code": "BAC"})
    desk = opened(page, server, path, defects=2)
    desk.context.set_offline(True)
    for row, grade in ((0, 3), (1, 5)):
        desk.locator(".defect__main").nth(row).click()
        desk.keyboard.press(f"Shift+Digit{grade}")
    change_as_another(server, path, severity=4)
    server.ask("PUT", f"{path}/observations/{second}", TAG | {"frame": 8, "code": "BAF"})
    desk.context.set_offline(False)
    asked = desk.get_by_role("dialog", name=re.compile("^Two versions of BAB"))
    asked.get_by_role("button", name="Keep mine").click()
    decide(desk, "Take theirs")
    expect_settled(desk)
    found = read(server, f"{path}/observations")["observations"]
    assert [(item["code"], item["severity"]) for item in found] == [("BAB", 3), ("BAF", 2)]


@pytest.fixture
def second(browser: Browser, server: Server, path: str) -> Iterator[Page]:
    """The same inspection in the browser of somebody else."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    context.set_default_timeout(20_000)
    token = server.make_token("Van 2", "operator")
    yield opened(context.new_page(), server, path, token)
    context.close()


def test_two_people_decide_about_one_defect(
    desk: Page, second: Page, server: Server, path: str
) -> None:
    write_remark(desk, "first")
    expect_settled(desk)
    write_remark(second, "second")
    assert versions(question(second))["Remark"] == ("second", "first", True)
    rate(desk, 5)  # meanwhile
    expect_settled(desk)
    question(second).get_by_role("button", name="Keep mine").click()
    expect(question(second)).to_contain_text("severity 5, act now")
    decide(second, "Take theirs")
    expect_settled(second)
    assert tag_of(server, path) == TAG | {"severity": 5, "remark": "first"}
    rate(second, 1)
    expect_settled(second)
    rate(desk, 0)
    expect(question(desk)).to_contain_text("By Van 2")


HEADER = {"asset_id": "KL-204", "client": "JKR"}


def header_of(server: Server, path: str) -> dict:
    return dict(read(server, path)["header"])


def fill_header(page: Page, label: str, text: str) -> None:
    page.get_by_role("tab", name="Header").click()
    field = page.get_by_role("textbox", name=label, exact=True)
    field.fill(text)
    field.blur()


def test_fields_of_a_header_that_two_people_fill_are_all_kept(
    desk: Page, server: Server, path: str
) -> None:
    desk.get_by_role("tab", name="Header").click()
    expect(desk.get_by_role("textbox", name="Client", exact=True)).to_be_visible()
    server.ask("PATCH", path, {"header": {"client": "JKR"}})
    fill_header(desk, "Asset", "KL-204")
    expect(desk.locator(".header-panel__state")).to_have_text("Saved")
    expect(desk.get_by_role("textbox", name="Client", exact=True)).to_have_value("JKR")
    assert header_of(server, path) == HEADER
    # Undo takes back the own field only.
    desk.locator("[data-part=undo]").click()
    expect(desk.get_by_role("textbox", name="Asset", exact=True)).to_have_value("")
    assert header_of(server, path) == {"client": "JKR"}


@pytest.mark.parametrize(("answer", "asset"), [("Keep mine", "KL-204"), ("Take theirs", "KL-9")])
def test_a_field_of_the_header_is_asked_about(
    desk: Page, server: Server, path: str, answer: str, asset: str
) -> None:
    desk.get_by_role("tab", name="Header").click()
    field = desk.get_by_role("textbox", name="Asset", exact=True)
    expect(field).to_be_visible()
    server.ask("PATCH", path, {"header": {"asset_id": "KL-9", "height_mm": 600}})
    fill_header(desk, "Asset", "KL-204")
    assert versions(question(desk)) == {"Asset": ("KL-204", "KL-9", True)}
    desk.keyboard.press("Escape")
    expect(desk.locator("#header-asset_id-fault")).to_contain_text("Somebody else changed this")
    expect(field).to_have_value("KL-204")
    # It outlives the page.
    desk.reload()
    desk.get_by_role("tab", name="Header").click()
    question(desk)
    assert header_of(server, path)["asset_id"] == "KL-9"
    decide(desk, answer)
    expect(desk.locator(".header-panel__state")).to_have_text("Saved")
    expect(field).to_have_value(asset)
    expect_settled(desk)
    assert header_of(server, path) == {"asset_id": asset, "height_mm": 600}
    # The next change is made of it.
    fill_header(desk, "Asset", "KL-205")
    expect(desk.locator(".header-panel__state")).to_have_text("Saved")
    assert header_of(server, path)["asset_id"] == "KL-205"


def test_what_was_typed_into_the_header_offline_does_not_undo_a_newer_value(
    desk: Page, server: Server, path: str
) -> None:
    desk.get_by_role("tab", name="Header").click()
    asset = desk.get_by_role("textbox", name="Asset", exact=True)
    expect(asset).to_be_visible()
    desk.context.set_offline(True)
    fill_header(desk, "Asset", "KL-1")
    expect(desk.locator(".header-panel__state")).to_contain_text("cannot be reached")
    fill_header(desk, "Asset", "KL-2")
    server.ask("PATCH", path, {"header": {"asset_id": "KL-9"}})
    desk.context.set_offline(False)
    assert versions(question(desk)) == {"Asset": ("KL-2", "KL-9", True)}
    decide(desk, "Keep mine")
    expect_settled(desk)
    assert header_of(server, path) == {"asset_id": "KL-2"}


def state_zero(server: Server, path: str, offset_m: float) -> None:
    server.ask(
        "PUT", f"{path}/corrections", UNSTATED | {"zero": {"frame": 2, "offset_m": offset_m}}
    )


@pytest.mark.parametrize(("answer", "offset_m"), [("Keep mine", 0.5), ("Take theirs", 0.25)])
def test_corrections_are_asked_about(
    page: Page, server: Server, path: str, answer: str, offset_m: float
) -> None:
    state_zero(server, path, 0.0)
    desk = opened(page, server, path)
    desk.get_by_role("tab", name="Corrections").click()
    desk.get_by_label("Camera ahead of the zero by").fill("0.5")
    desk.keyboard.press("Enter")
    apply = desk.get_by_role("button", name="Apply")
    expect(apply).to_be_enabled()
    # The page learns of it before it sends its own, and keeps what its draft was made of.
    state_zero(server, path, 0.25)
    desk.evaluate("() => document.querySelector('inspection-page').desk.corrections.load()")
    expect(apply).to_be_enabled()
    apply.click()
    found = versions(question(desk))
    assert found["Zero"] == ("frame 2, 0.50 m", "frame 2, 0.25 m", True)
    assert not any(is_other for name, (_, _, is_other) in found.items() if name != "Zero")
    desk.keyboard.press("Escape")
    expect(desk.get_by_label("Camera ahead of the zero by")).to_have_value("0.5")
    expect(desk.locator("conflict-notice")).to_be_visible()
    apply.click()
    question(desk)
    decide(desk, answer)
    expect_settled(desk)
    expect(desk.get_by_label("Camera ahead of the zero by")).to_have_value(str(offset_m))
    expect(apply).to_be_hidden()
    assert read(server, f"{path}/corrections")["stated"]["zero"]["offset_m"] == offset_m


@pytest.mark.parametrize(("answer", "offset_m"), [("Keep mine", 0.75), ("Take theirs", 0.25)])
def test_corrections_are_asked_about_again_after_a_reload(
    page: Page, server: Server, path: str, answer: str, offset_m: float
) -> None:
    state_zero(server, path, 0.0)
    desk = opened(page, server, path)
    desk.get_by_role("tab", name="Corrections").click()
    offset = desk.get_by_label("Camera ahead of the zero by")
    offset.fill("0.5")
    desk.keyboard.press("Enter")
    desk.get_by_label("Why (for the history)").fill("Measured by hand")
    state_zero(server, path, 0.25)
    desk.get_by_role("button", name="Apply").click()
    question(desk)
    desk.keyboard.press("Escape")
    # It may be edited until it is decided.
    offset.fill("0.75")
    desk.keyboard.press("Enter")
    desk.reload()
    assert versions(question(desk))["Zero"] == ("frame 2, 0.75 m", "frame 2, 0.25 m", True)
    expect(desk.locator(".save")).to_have_text("Undecided (1)")
    decide(desk, answer)
    expect_settled(desk)
    assert read(server, f"{path}/corrections")["stated"]["zero"]["offset_m"] == offset_m
    remarks = [event["remark"] for event in read(server, f"{path}/events")["events"]]
    assert (remarks[0] == "Measured by hand") == (answer == "Keep mine")
    # It is decided for good.
    reload(desk)
    expect_settled(desk)
    assert "unsent" not in desk.evaluate("JSON.stringify(localStorage)")


def test_a_zero_that_was_overtaken_waits_as_a_draft(desk: Page, server: Server, path: str) -> None:
    desk.keyboard.press("End")
    expect(desk.locator(".transport__frame")).to_have_text(re.compile(f"frame {FRAMES - 1}$"))
    state_zero(server, path, 0.25)
    desk.keyboard.press("z")
    found = versions(question(desk))
    assert found["Zero"][1] == "frame 2, 0.25 m"
    desk.keyboard.press("Escape")
    desk.get_by_role("tab", name="Corrections").click()
    expect(desk.get_by_role("button", name="Apply")).to_be_enabled()
    desk.locator("conflict-notice").get_by_role("button", name="Compare").click()
    decide(desk, "Keep mine")
    expect_settled(desk)
    assert read(server, f"{path}/corrections")["stated"]["zero"]["frame"] == FRAMES - 1
    desk.get_by_role("status").get_by_role("button", name="Undo").click()
    expect(desk.get_by_role("status").filter(has_text="Undone")).to_be_visible()
    assert read(server, f"{path}/corrections")["stated"]["zero"]["offset_m"] == 0.25


def test_the_question_is_for_keyboards_and_screen_readers(
    desk: Page, server: Server, path: str
) -> None:
    change_as_another(server, path, severity=4, remark="roots at the joint")
    rate(desk, 3)
    asked = question(desk)
    # A key that was meant for the film decides nothing.
    expect(asked.get_by_role("button", name="Close")).to_be_focused()
    for name in ("Decide later", "Take theirs", "Keep mine"):
        desk.keyboard.press("Tab")
        expect(asked.get_by_role("button", name=name)).to_be_focused()
    expect_no_fault(desk)
    desk.keyboard.press("Escape")
    expect_no_fault(desk, ("light",))


def test_the_question_fits_every_screen(desk: Page, server: Server, path: str) -> None:
    long = {"remark": "Roots through the joint, from the crown down to the bench. " * 4}
    change_as_another(server, path, severity=4, quant1=35, clock_from=10, clock_to=2, **long)
    rate(desk, 3)
    asked = question(desk)
    for width, height in SCREENS:
        desk.set_viewport_size({"width": width, "height": height})
        for name in ("Keep mine", "Take theirs", "Decide later"):
            expect(asked.get_by_role("button", name=name)).to_be_in_viewport(ratio=1)
        assert asked.evaluate("(dialog) => dialog.scrollWidth <= dialog.clientWidth")
