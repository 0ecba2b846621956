"""The register: a table is repaired and imported, and a new inspection begins with what it says."""

from __future__ import annotations

import json
from pathlib import Path

from clips import numbered_clip, rig_for_clip
from looks import expect_no_fault
from playwright.sync_api import Page, expect
from steps import Server, log_in

from app.survey.fields.header import ASSET_FIELDS

HEAD = "asset_id;project;shape;height_mm;known_length_m;start_lat;start_lon;owner"
GOOD = "CV-01;North;circular;600;12,5;3,139;101,6869;x"


def test_from_a_table_of_the_owner_to_the_header_of_an_inspection(
    page: Page, server: Server, tmp_path: Path
) -> None:
    table = tmp_path / "gis.csv"
    table.write_text(f"{HEAD}\n{GOOD}\nCV-02;North;circular;6OO;;;;\ncv 01;;;;;;;\n", "cp1252")
    log_in(page, server, "/assets/register")
    expect(page.get_by_text("The register is empty")).to_be_visible()
    choose = page.locator("register-page input[type=file]")
    choose.set_input_files(table)
    expect(page.get_by_role("region", name="Faults")).to_contain_text("3CV-02height_mm")
    expect_no_fault(page)
    expect(page.get_by_label("What owner holds")).to_have_value("client")
    page.get_by_label("What owner holds").select_option("not used")
    expect(page.get_by_role("region", name="What the table does")).not_to_contain_text("Client")
    page.get_by_role("button", name="Cancel").click()
    table.write_text(f"{HEAD}\n{GOOD}\nCV-02;North;circular;600;;;;\n", "utf-8-sig")
    choose.set_input_files(table)
    page.get_by_role("button", name="Import 2 assets").click()
    expect(page.get_by_text("Imported: 2 new, 0 changed")).to_be_visible()
    expect(page.get_by_role("row", name="CV-01")).to_contain_text("Circular 600 mm")

    # One asset: another spelling is noticed, a deleted one comes back, a line is its text.
    page.get_by_role("button", name="Add asset").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Asset", exact=True).press_sequentially("cv.02")
    names = dialog.locator("[data-field]").evaluate_all("all => all.map((f) => f.dataset.field)")
    assert set(names) == set(ASSET_FIELDS)
    dialog.get_by_role("button", name="Use CV-02").click()
    expect(dialog.get_by_text("CV-02 is in the register already")).to_be_visible()
    expect_no_fault(page, within="dialog[open]")
    page.mouse.click(5, 5)  # outside: what is typed stays
    page.keyboard.press("Escape")
    question = page.get_by_role("dialog", name="Close without saving?")
    expect(question.get_by_role("button", name="Cancel")).to_be_focused()
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    question.get_by_role("button", name="Close without saving").click()
    expect(dialog).to_have_count(0)
    page.get_by_role("button", name="Take CV-02 off the register").click()
    expect(page.get_by_role("row", name="CV-02")).to_have_count(0)
    page.get_by_role("button", name="Undo").click()
    page.get_by_role("link", name="CV-02").click()
    page.get_by_role("button", name="Edit in the register").click()
    dialog.get_by_label("Position").fill("3.2, 101.4\n3.2, 1010")
    dialog.get_by_role("button", name="Save").click()
    expect(dialog.get_by_text("“3.2, 1010” is not latitude")).to_be_visible()
    dialog.get_by_label("Position").fill("3.2, 101.4\n3.21, 101.41")
    dialog.get_by_role("textbox", name="Material", exact=True).fill("clay")
    dialog.get_by_label("Year built").fill("1998")
    dialog.get_by_role("button", name="Save").click()
    expect(page.locator(".asset__facts")).to_contain_text("clay")
    kept = json.load(server.ask("GET", "/api/register/assets/CV-02"))
    assert kept["line"] == [[101.4, 3.2], [101.41, 3.21]]

    # A new inspection: a suggestion of the rig gives way, what a person entered stays.
    page.goto(server.url + "/new")
    field = {name: page.locator(f"#header-{name}") for name in ("asset_id", "height_mm", "shape")}
    page.get_by_label("Camera and mount").select_option("preset 0")
    expect(field["height_mm"]).to_have_value("300")
    field["asset_id"].press_sequentially("CV 01")
    page.get_by_role("button", name="Use CV-01").click()
    filled = page.get_by_text("Filled in from the register")
    expect(filled).to_contain_text("Height")
    expect_no_fault(page, within="header-form")
    expect(field["height_mm"]).to_have_value("600")
    page.get_by_role("button", name="Undo").click()
    expect(filled).to_have_count(0)
    expect(field["height_mm"]).to_have_value("300")
    field["asset_id"].fill("CV-02")
    field["asset_id"].blur()
    expect(filled).to_be_visible()
    field["height_mm"].fill("650")
    field["asset_id"].fill("CV-01")
    field["asset_id"].blur()
    expect(filled).to_contain_text("Known length")
    clip = numbered_clip(tmp_path / "clip.mp4", "libx264", frames=5)
    page.locator("input[type=file]").first.set_input_files(clip)
    page.locator("rig-form input[type=file]").set_input_files(rig_for_clip(tmp_path / "rig.json"))
    page.get_by_role("button", name="Start tracking").click()
    page.wait_for_url("**/inspections/*")
    made = page.url.rsplit("/", 1)[1]
    server.state_no_counter(made)
    header = json.load(server.ask("GET", f"/api/inspections/{made}"))["header"]
    assert {name: header.get(name) for name in ("asset_id", "project", "height_mm")} == {
        "asset_id": "CV-01", "project": "North", "height_mm": 650,
    }  # fmt: skip
    assert (header["known_length_m"], header["start_lat"], "end_lat" in header) == (
        12.5, 3.139, False,
    )  # fmt: skip

    # The header of an inspection: all that is filled in is one step of the history.
    page.get_by_role("tab", name="Header").click()
    field["asset_id"].fill("CV-02")
    field["asset_id"].blur()
    expect(filled).to_have_text("Filled in from the register: Material, Year built.")
    expect(page.locator(".header-panel__state")).to_have_text("Saved")
    stored = json.load(server.ask("GET", f"/api/inspections/{made}"))["header"]
    assert stored == header | {"asset_id": "CV-02", "material": "clay", "year": 1998}
    events = json.load(server.ask("GET", f"/api/inspections/{made}/events"))["events"]
    assert [event["after"]["header"] for event in events if event["action"] == "changed"] == [
        stored,
        header | {"asset_id": "CV-02"},
    ]
