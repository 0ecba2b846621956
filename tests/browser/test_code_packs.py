"""A code pack from its template to the exchange file: imported, chosen, coded with, moved."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import openpyxl
import pytest
from desks import delete_observations, expect_frame, expect_read, expect_saved, observations
from looks import expect_no_fault
from playwright.sync_api import Locator, Page, expect
from steps import Server, log_in
from surveys import Survey


@pytest.fixture(scope="module")
def server(narrow: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(narrow.copied_to(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture(scope="module")
def inspection(narrow: Survey) -> str:
    return narrow.id


@pytest.fixture
def template(server: Server) -> bytes:
    return server.ask("GET", "/api/packs/template.xlsx").read()


def changed(template: bytes, path: Path, cells: dict[str, Any]) -> Path:
    book = openpyxl.load_workbook(io.BytesIO(template))
    for cell, value in cells.items():
        book["codes"][cell] = value
    book.save(path)
    return path


def import_pack(page: Page, file: Path, title: str) -> Locator:
    """Choose the file in the dialog, whose preview is returned."""
    dialog = page.get_by_role("dialog", name="Import a pack")
    if not dialog.is_visible():
        page.get_by_role("button", name="Import a pack").click()
    dialog.get_by_label("Title").fill(title)
    dialog.get_by_label("File").set_input_files(file)
    return dialog


def field_of_the_pack(page: Page) -> Locator:
    """In the header, beside what the program fills in."""
    page.get_by_role("tab", name="Header").click()
    page.locator("header-panel summary", has_text="Filled in").click()
    return page.get_by_label("Code pack")


def test_a_pack_is_imported_coded_with_and_moved_to_its_next_version(
    page: Page, server: Server, inspection: str, template: bytes, tmp_path: Path
) -> None:
    right, newer = tmp_path / "right.xlsx", {"A5": "SPX"}
    right.write_bytes(template)
    log_in(page, server, "/settings")
    dialog = import_pack(page, changed(template, tmp_path / "w.xlsx", {"G3": "X"}), "Invented")
    expect(dialog.get_by_role("status")).to_contain_text("One fault prevents the import")
    expect(dialog.get_by_role("listitem")).to_contain_text("sheet codes, row 3: group must be")
    expect(dialog.get_by_role("button", name="Import a pack")).to_be_disabled()
    import_pack(page, right, "Invented")
    expect(dialog.get_by_role("status")).to_contain_text("26 codes and 5 ratings")
    expect_no_fault(page, within="dialog[open]")
    dialog.get_by_role("button", name="Import a pack").click()
    expect(page.locator(".settings__message")).to_have_text("Imported Invented")
    packs = page.get_by_role("list", name="Code pack")
    expect(packs).to_contain_text("26 codes, 5 ratings · For all projects · Not used")
    with page.expect_response("**/api/me/preferences"):
        page.get_by_label("Pack of new inspections").select_option("Invented")
    (first,) = json.load(server.ask("GET", "/api/packs"))["packs"]
    dialog = import_pack(page, changed(template, tmp_path / "v2.xlsx", newer), "Invented")
    expect(dialog.get_by_role("status")).to_contain_text("It becomes Invented v2.")
    dialog.get_by_role("button", name="Import a pack").click()
    expect(page.locator(".settings__message")).to_have_text("Imported Invented v2")
    expect_no_fault(page)
    second = json.load(server.ask("GET", "/api/packs"))["packs"][0]["id"]
    page.goto(f"{server.url}/new")
    expect(page.locator("[data-field=code_pack]")).to_have_value(second)

    # An inspection is moved after what would no longer fit was listed.
    tag = f"/api/inspections/{inspection}/observations/7d444840-9dc0-4d2a-8a6a-00000000000d"
    server.ask("PUT", tag, {"frame": 0, "code": "BAB", "char1": "C", "char2": "A"})
    header = json.load(server.ask("GET", f"/api/inspections/{inspection}"))["header"]
    header |= {"code_pack": first["id"]}
    page.goto(f"{server.url}/inspections/{inspection}")
    expect_read(page)
    server.ask("PATCH", f"/api/inspections/{inspection}", {"header": header})
    button = page.locator(".quick__code", has_text="Split")
    expect(button).to_be_visible()  # the page has read itself anew
    expect_read(page)
    delete_observations(server, inspection)
    expect(page.locator(".defect")).to_have_count(0)
    expect_frame(page, 0)
    for key in ("b", "s", "p"):  # the only code that begins so
        page.keyboard.press(key)
    expect(page.locator("#question-asked")).to_have_text("Kind")
    for key in ("w", "l", "1", "2", "Enter"):
        page.keyboard.press(key)
    expect(page.locator("defect-form [data-part=grade]")).to_have_text("Grade 4 by the code pack")
    page.keyboard.press("4")
    expect_saved(page)
    (tagged,) = observations(server, inspection)
    assert [tagged[name] for name in ("code", "char1", "char2", "quant1")] == ["SPL", "W", "L", 12]

    exports = f"/api/inspections/{inspection}/exports"
    assert ";BAB;C;A;" in server.ask("GET", f"{exports}/en13508").read().decode()
    report = server.ask("GET", f"{exports}/html").read().decode()
    assert "Shell, quick (two highest grades with their number): 4×1 → grade 4" in report
    pack = field_of_the_pack(page)
    pack.select_option("Invented v2")
    asked = page.get_by_role("dialog", name="Code it with Invented v2?")
    expect(asked).to_contain_text("1 thing would no longer fit")
    expect(asked.get_by_role("listitem")).to_contain_text("the code has no Detail L")
    expect_no_fault(page, within="dialog[open]")
    asked.get_by_role("button", name="Cancel").click()
    expect(pack).to_have_value(first["id"])
