"""Distances are brought to scale in front of a person, who then closes the survey."""

from __future__ import annotations

import csv
import json
import uuid
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from builders import half_size
from looks import expect_no_fault
from playwright.sync_api import APIResponse, Page, Response, Route, expect
from steps import Server, log_in

from app.lab.simulation import SCENARIOS, SimulatedRun, simulate
from vo_core.rig import Rig

LENGTH_M = 0.9
WRONG_HEIGHT = 0.99
TOLERANCE_M = 0.0035
"""The scale comes from the length alone; what is left is the unevenness of the wall, and what an
answer in whole millimetres rounds: up to 2 mm were seen."""
JOINTS = 4


@pytest.fixture(scope="module")
def culvert(tmp_path_factory: pytest.TempPathFactory) -> SimulatedRun:
    """Of units of 225 mm, 0.9 m driven, and a rig file whose camera is 1 % too low."""
    nominal = SCENARIOS["nominal"]
    fields = half_size(nominal.rig)
    fields["pipe"]["segment_length_mm"] = 225.0
    scenario = replace(
        nominal, rig=Rig.parse(fields), length_mm=1000 * LENGTH_M, first_joint_mm=100.0
    )
    run = simulate(scenario, tmp_path_factory.mktemp("culvert"))
    fields["mount"]["height_mm"] *= WRONG_HEIGHT
    run.rig.write_text(json.dumps(fields))
    return run


@pytest.fixture(scope="module")
def tracked(server: Server, culvert: SimulatedRun) -> str:
    return server.track(culvert.video, culvert.rig)


@pytest.fixture
def inspection(server: Server, tracked: str) -> str:
    """As it was tracked: nothing stated, nothing tagged, not finished."""
    unstated = {"zero": None, "lengths": [], "rig_sigma": None, "forced": None, "remark": None}
    _put(server, tracked, "corrections", unstated | {"joints": {"use": False}})
    for item in _get(server, tracked, "observations")["observations"]:
        server.ask("DELETE", f"/api/inspections/{tracked}/observations/{item['id']}")
    server.ask("PATCH", f"/api/inspections/{tracked}", {"header": {}})
    return tracked


def test_a_known_length_moves_every_distance_and_needs_a_reason_where_it_does_not_fit(
    page: Page, server: Server, inspection: str, culvert: SimulatedRun
) -> None:
    true_m = _true_distances_m(culvert.truth)
    frame = len(true_m) // 2
    _tag(server, inspection, {"frame": frame, "code": "BAB"})
    measured_m = _distance_m(server, inspection)
    assert abs(measured_m - true_m[frame]) > TOLERANCE_M / 2
    _open(page, server, inspection, "Corrections")

    page.get_by_label("Length", exact=True).fill(str(LENGTH_M))
    # Leaving the field shows the bar to apply it, where the pressed button was.
    tape = page.get_by_role("button", name="Tape ± 5")
    tape.evaluate("(button) => button.scrollIntoView({ block: 'end' })")
    tape.hover()
    page.mouse.down()
    expect(page.get_by_role("button", name="Apply")).to_be_visible()
    page.mouse.up()
    expect(page.get_by_label("Uncertainty (1 σ)").first).to_have_value("5")
    expect(page.get_by_text("It fits")).to_be_visible()
    expect(page.locator(".closure__residual")).to_contain_text("mm")
    assert _distance_m(server, inspection) == measured_m  # shown, not used yet
    page.get_by_label("Why (for the history)").fill("Taped from headwall to headwall")
    page.get_by_label("Uncertainty (1 σ)").first.fill("6")  # the press on Apply ends the typing
    # The page may also say so of what the test stated before it was opened.
    with page.expect_response(_is_correction):
        page.get_by_role("button", name="Apply").click()

    expect(page.get_by_text("Distances corrected").first).to_be_visible()
    assert _distance_m(server, inspection) == pytest.approx(true_m[frame], abs=TOLERANCE_M)
    page.get_by_role("tab", name="Defects").click()
    shown_m = _distance_m(server, inspection)
    expect(page.locator(".defect__where")).to_have_text(f"{shown_m:.2f} m")
    page.keyboard.press("End")
    expect(page.locator(".readout__distance")).to_contain_text(f"{LENGTH_M:.2f}")
    page.get_by_role("tab", name="History").click()
    expect(page.locator(".event").first).to_contain_text("Taped from headwall to headwall")

    page.keyboard.press("u")  # the offer may have left by now
    expect(page.locator(".event").first).to_contain_text("Taken back")
    assert _distance_m(server, inspection) == measured_m

    # One that does not fit needs a reason.
    page.get_by_role("tab", name="Corrections").click()
    page.get_by_label("Length", exact=True).fill("1.3")
    page.keyboard.press("Enter")
    expect(page.locator(".fix__bar")).to_contain_text("does not fit")
    apply = page.get_by_role("button", name="Apply")
    expect(apply).to_be_disabled()
    page.get_by_label("Use it nevertheless, because").fill("Both headwalls were surveyed")
    expect(apply).to_be_enabled()
    apply.click()

    expect(page.locator(".fix__bar")).to_be_hidden()
    page.keyboard.press("End")
    expect(page.locator(".readout__distance")).to_contain_text("1.30")
    stated = _get(server, inspection, "corrections")["stated"]
    assert stated["forced"] == "Both headwalls were surveyed"
    page.get_by_role("tab", name="Checks").click()
    expect(page.locator("checks-panel")).to_contain_text("The known length was forced")


def _is_correction(answer: Response) -> bool:
    return answer.request.method == "PUT" and answer.url.endswith("/corrections")


def test_a_draft_outlives_what_else_is_stated(page: Page, server: Server, inspection: str) -> None:
    unstated = {"zero": None, "lengths": [], "rig_sigma": None, "forced": None, "remark": None}
    _put(server, inspection, "corrections", unstated | {"joints": {"use": True}})
    _open(page, server, inspection, "Corrections")
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    expect(page.locator(".transport__clock")).to_contain_text("frame 3")
    page.keyboard.press("z")
    expect(page.get_by_text("Zero set at frame 3")).to_be_visible()
    expect(page.locator(".zero__evidence img")).to_have_attribute(
        "src", f"/api/inspections/{inspection}/frames/3.jpg"
    )
    offset = page.get_by_label("Camera ahead of the zero by")
    offset.fill("0.35")
    page.keyboard.press("Enter")
    offset.blur()
    apply = page.get_by_role("button", name="Apply")
    expect(apply).to_be_enabled()
    # The undo of the earlier zero.
    page.keyboard.press("u")
    expect(page.get_by_role("status").filter(has_text="Undone")).to_be_visible()
    expect(offset).to_have_value("0.35")
    # And the button that stops the joints, which joins the draft.
    page.get_by_role("button", name="Take back").click()
    expect(apply).to_be_enabled()
    expect(offset).to_have_value("0.35")
    stated = _get(server, inspection, "corrections")["stated"]
    assert (stated["zero"], stated["joints"]["use"]) == (None, True)
    # It was made of the zero that was undone, so the person is asked.
    apply.click()
    page.get_by_role("button", name="Keep mine").click()
    expect(apply).to_be_hidden()
    stated = _get(server, inspection, "corrections")["stated"]
    assert (stated["zero"], stated["joints"]["use"]) == ({"frame": 3, "offset_m": 0.35}, False)
    expect(page.locator(".readout__distance")).to_contain_text("0.35")


def test_zero_is_set_before_the_page_has_read_what_is_stated(
    page: Page, server: Server, inspection: str
) -> None:
    late: list[tuple[Route, APIResponse]] = []
    is_pressed = False

    def hold(route: Route) -> None:
        if is_pressed:
            route.continue_()
        else:
            late.append((route, route.fetch()))

    page.route(f"**/api/inspections/{inspection}/corrections", hold)
    _open(page, server, inspection, "Corrections")
    expect(page.locator(".readout__distance")).to_contain_text("0.00")
    is_pressed = True
    page.keyboard.press("z")
    expect(page.get_by_text("Zero set at frame 0")).to_be_visible()
    expect(page.get_by_text("has no distance yet")).to_be_hidden()
    assert _get(server, inspection, "corrections")["stated"]["zero"]["frame"] == 0

    # What was asked for before says that there is no zero.
    for route, answer in late:
        with page.expect_event("requestfinished"):
            route.fulfill(response=answer)
    page.evaluate("() => new Promise((done) => setTimeout(done))")
    expect(page.locator(".zero__evidence img")).to_be_visible()


def test_a_check_leads_to_what_it_is_about_and_a_survey_is_finished_or_abandoned(
    page: Page, server: Server, inspection: str
) -> None:
    _tag(server, inspection, {"frame": 5, "code": "BBB", "char1": "A", "continuous": "A1"})
    _open(page, server, inspection, "Defects")
    page.keyboard.press("t")
    tab = page.get_by_role("tab", name="Checks")
    tab.click()
    check = page.locator(".check", has_text="has no code yet")
    check.get_by_role("button", name="Complete it").click()
    expect(page.get_by_role("tab", name="Defects")).to_have_attribute("aria-selected", "true")
    page.get_by_label("Code", exact=True).fill("BAB")
    page.keyboard.press("Enter")
    page.keyboard.press("Escape")
    tab.click()
    expect(check).to_have_count(0)
    page.locator(".check", has_text="Operator is empty").get_by_role("button").click()
    expect(page.get_by_role("textbox", name="Operator", exact=True)).to_be_focused()

    # It is not finished over an open stretch.
    page.locator(".transport__frame").click()  # the next key is meant for the film
    page.keyboard.press("End")
    expect(page.locator(".readout__distance")).to_contain_text("0.8")
    page.get_by_role("button", name="Finish", exact=True).click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("The end was reached").check()
    submit = dialog.get_by_role("button", name="Finish", exact=True)
    submit.click()
    expect(dialog.get_by_role("alert").last).to_contain_text("A1")
    assert "end_condition" not in _inspection(server, inspection)["header"]

    dialog.get_by_role("button", name="Finish A1").click()
    expect(dialog.get_by_text("Open stretches")).to_be_hidden()
    submit.click()
    expect(dialog).to_be_hidden()
    assert _inspection(server, inspection)["header"]["end_condition"] == "complete"
    stretch = {
        item["continuous"]: item
        for item in _get(server, inspection, "observations")["observations"]
        if item["continuous"]
    }
    assert stretch["B1"]["code"] == stretch["A1"]["code"]
    assert stretch["B1"]["distance_m"] > stretch["A1"]["distance_m"]

    page.get_by_role("button", name="Finished").click()
    dialog.get_by_role("button", name="Reopen").click()
    expect(page.get_by_text("The survey is open again")).to_be_visible()
    assert "end_condition" not in _inspection(server, inspection)["header"]

    # Abandoned, it needs a reason.
    page.get_by_role("button", name="Finish", exact=True).click()
    dialog.get_by_label("Abandoned", exact=True).check()
    expect_no_fault(page, within="dialog[open]")
    dialog.get_by_role("button", name="Finish", exact=True).click()
    expect(dialog).to_contain_text("Say why")
    dialog.get_by_role("button", name="Obstruction").click()
    dialog.get_by_role("button", name="Finish", exact=True).click()
    expect(dialog).to_be_hidden()
    header = _inspection(server, inspection)["header"]
    assert (header["end_condition"], header["abandon_reason"]) == ("abandoned", "Obstruction")


def test_a_joint_is_left_out_and_put_back_and_no_panel_has_a_fault_of_accessibility(
    page: Page, server: Server, inspection: str
) -> None:
    _tag(server, inspection, {"frame": 5, "code": "BBB", "char1": "A", "continuous": "A1"})
    _open(page, server, inspection, "Corrections")
    page.get_by_label("Use the joints").check()
    rows = page.locator(".joints tbody tr")
    expect(rows).to_have_count(JOINTS)
    rows.nth(1).get_by_role("button", name="Leave out").click()
    expect(rows.nth(1)).to_contain_text("left out")
    rows.nth(1).get_by_role("button", name="Put back").click()
    expect(rows.nth(1)).to_contain_text("mm")
    page.get_by_label("Length", exact=True).fill("1.3")
    page.get_by_role("button", name="Add a taped length").click()
    expect(page.locator(".fix__bar")).to_contain_text("does not fit")
    expect_no_fault(page, within="corrections-panel")
    page.get_by_role("button", name="Discard").click()
    for tab, shown in (("Checks", ".check"), ("History", ".event")):
        page.get_by_role("tab", name=tab).click()
        expect(page.locator(shown).first).to_be_visible()
        expect_no_fault(page, ("light",), within=f"{tab.lower()}-panel")


def _open(page: Page, server: Server, inspection: str, tab: str) -> None:
    log_in(page, server, f"/inspections/{inspection}")
    page.get_by_role("tab", name=tab).click()
    expect(page.locator(".transport__clock")).to_contain_text("frame 0")


def _inspection(server: Server, inspection: str) -> dict:
    return json.load(server.ask("GET", f"/api/inspections/{inspection}"))


def _get(server: Server, inspection: str, what: str) -> dict:
    return json.load(server.ask("GET", f"/api/inspections/{inspection}/{what}"))


def _put(server: Server, inspection: str, what: str, body: Mapping[str, object]) -> None:
    server.ask("PUT", f"/api/inspections/{inspection}/{what}", body)


def _tag(server: Server, inspection: str, fields: Mapping[str, object]) -> None:
    _put(server, inspection, f"observations/{uuid.uuid4()}", fields)


def _distance_m(server: Server, inspection: str) -> float:
    (item,) = _get(server, inspection, "observations")["observations"]
    return float(item["distance_m"])


def _true_distances_m(path: Path) -> list[float]:
    with path.open(newline="") as file:
        return [float(row["distance_mm"]) / 1000 for row in csv.DictReader(file)]
