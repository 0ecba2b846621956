"""How many actions it takes to code a film: keys, clicks, and short numbers that are typed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from desks import click_at, expect_frame, expect_read, expect_saved, observations
from hands import Hands
from playwright.sync_api import Page, expect
from steps import Server, log_in
from surveys import Survey

QUICK = "123456789"
ANSWERS = {
    "BAB": ("b", "a", "2.5"), "BAC": ("a",), "BAF": ("c", "a"),
    "BAJ": ("a", "20"), "BBA": ("b", "10"), "BBB": ("a", "5"),
    "BBC": ("c", "15"), "BBF": ("b",), "BDD": ("a", "10"),
}  # fmt: skip
"""By the codes of the digit keys: characters and quantity."""
MOST_OF_NINE = 40
MOST_OF_ONE = 6
MOST_OF_ALL = 60
HEADER = {
    "asset_id": "CUL-0041", "start_node": "HW1", "end_node": "HW2", "direction": "with_flow",
    "asset_type": "culvert", "material": "Concrete", "operator": "A. Rahman", "client": "JKR",
    "reference_point": "Inner face of the headwall", "known_length_m": 2.0,
    "known_length_source": "tape",
}  # fmt: skip


@pytest.fixture
def server(wide: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(wide.copied_to(tmp_path_factory.mktemp("data"))) as running:
        running.ask("PATCH", f"/api/inspections/{wide.id}", {"header": HEADER})
        yield running


def lacking(page: Page) -> int:
    found: int = page.evaluate(
        "() => document.querySelector('inspection-page').desk.incomplete.length"
    )
    return found


def stated(item: dict[str, Any]) -> tuple[Any, ...]:
    return item["code"], item["char1"], item["char2"], item["quant1"]


def test_a_film_with_ten_full_codes_becomes_a_report(
    page: Page, server: Server, wide: Survey
) -> None:
    log_in(page, server, f"/inspections/{wide.id}")
    expect_read(page)
    expect_frame(page, 0)
    hands = Hands(page)

    # Nine tags while the film plays, then what each of them lacks.
    hands.press(" ")
    for digit in QUICK:
        hands.press(digit)
    expect(page.locator(".defect")).to_have_count(9)
    hands.press("v")
    for _ in QUICK:
        code = page.locator("#defect-code").input_value()
        hands.answer(*ANSWERS[code])
        if code != "BDD":  # the level of the water is no defect
            hands.press("Shift+Digit3")
        else:
            hands.press("Enter")
        page.wait_for_function(
            "(code) => document.querySelector('#defect-code')?.value !== code", arg=code
        )
    assert lacking(page) == 0
    assert hands.actions <= MOST_OF_NINE
    expect_saved(page)
    found = {stated(item) for item in observations(server, wide.id)}
    assert ("BAB", "B", "A", 2.5) in found
    assert ("BBF", "B", None, None) in found
    assert all(item["clock"] for item in observations(server, wide.id))
    assert sum(item["severity"] == 3 for item in observations(server, wide.id)) == 8

    # One more where it is seen, in full at once.
    hands.press("End")
    expect(page.locator(".readout__distance")).to_contain_text(re.compile(r"2\.0[2-4]"))
    before = hands.actions
    click_at(page.locator(".stage__overlay"), 0.4, 0.7)
    hands.actions += 1
    hands.press("1")
    hands.answer("c", "b", "4")
    hands.press("Shift+Digit5")
    assert hands.actions - before <= MOST_OF_ONE
    expect(page.locator("defect-form")).to_have_count(0)
    expect_saved(page)
    newest = max(observations(server, wide.id), key=lambda item: int(item["seq"]))
    assert stated(newest) == ("BAB", "C", "B", 4)
    assert (newest["severity"], newest["pixel"] is not None) == (5, True)

    # The report, with its start and end.
    hands.finish()
    expect(page.locator(".defect")).to_have_count(12)
    expect_saved(page)
    assert hands.export("PDF").startswith(b"%PDF")
    assert hands.actions <= MOST_OF_ALL


def test_what_a_code_needs_is_in_sight_beside_the_film(
    page: Page, server: Server, wide: Survey
) -> None:
    page.set_viewport_size({"width": 1366, "height": 768})
    log_in(page, server, f"/inspections/{wide.id}")
    expect_read(page)
    expect_frame(page, 0)
    film, view = page.locator(".stage__picture"), page.locator(".viewer__stage")
    for element, name, least in ((film, "width", 560), (view, "height", 220)):
        box = element.bounding_box()
        assert box is not None
        assert box[name] >= least
    form = page.locator(".form__body")
    for digit in QUICK:
        page.keyboard.press(digit)
        expect(page.locator("#question-asked")).to_have_text("Kind")
        for chip in page.locator(".question, .question__choice").all():
            expect(chip).to_be_in_viewport(ratio=1)
        code = page.locator("#defect-code").input_value()
        for answer in ANSWERS[code][:-1]:
            page.keyboard.press(answer)
            for chip in page.locator(".question, .question__choice").all():
                expect(chip).to_be_in_viewport(ratio=1)
        assert form.evaluate("form => form.scrollTop") == 0
        page.keyboard.press("Escape")
    page.set_viewport_size({"width": 1920, "height": 1080})
    strips = page.locator(".desk__strip")
    assert strips.evaluate("strips => strips.scrollHeight - strips.clientHeight") <= 0


def test_an_incomplete_defect_is_completed_by_the_keyboard_alone_and_the_next_one_follows(
    page: Page, server: Server, wide: Survey
) -> None:
    log_in(page, server, f"/inspections/{wide.id}")
    expect_read(page)
    expect_frame(page, 0)
    asked = page.locator("#question-asked")
    page.keyboard.press("5")
    page.keyboard.press("a")
    expect(asked).to_have_text("Quantity")
    # Keys of the film are the film's while a tag is asked about; after half a metre all of them.
    page.keyboard.press("ArrowRight")
    expect_frame(page, 1)
    expect(asked).to_have_text("Quantity")
    page.keyboard.press("End")
    expect(page.locator("defect-form")).to_have_count(0)
    page.keyboard.press("t")
    page.get_by_role("button", name="Complete 2 defects").press("Enter")
    expect(page.get_by_label("Quantity", exact=True)).to_be_focused()
    page.keyboard.type("12")
    page.keyboard.press("Enter")
    expect(asked).to_have_text("Severity")
    page.keyboard.press("2")
    expect(page.get_by_label("Code", exact=True)).to_be_focused()
    page.keyboard.type("bbb")
    page.keyboard.press("Enter")
    for answer in ("z", "5", "Enter", "4"):
        page.keyboard.press(answer)
    expect(page.get_by_label("Remark", exact=True)).to_be_focused()  # what else it is
    page.keyboard.type("wax at 3")
    page.keyboard.press("Enter")
    expect(page.locator("defect-form")).to_have_count(0)
    expect_saved(page)
    assert observations(server, wide.id)[-1]["remark"] == "wax at 3"
    assert [stated(item)[:2] for item in observations(server, wide.id)] == [
        ("BBA", "A"), ("BBB", "Z"),
    ]  # fmt: skip
    assert [item["severity"] for item in observations(server, wide.id)] == [2, 4]
