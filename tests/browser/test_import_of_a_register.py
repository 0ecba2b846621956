"""The register of an owner: 200 sections under other names of columns, imported in few actions."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hands import Hands
from looks import expect_no_fault
from playwright.sync_api import Page, expect
from steps import Server, log_in

SECTIONS = 200
MOST_ACTIONS = 4
"""Import, the file, the button, and the list of what was left out closed again."""


@pytest.fixture
def empty(server: Server) -> Iterator[Server]:
    yield server
    page = json.load(server.ask("GET", f"/api/register/assets?limit={SECTIONS}"))
    for asset in page["assets"]:
        server.ask("DELETE", f"/api/register/assets/{asset['asset_id']}")


def german(number: int) -> str:
    size = "300/450?" if number == 57 else 300 + 50 * (number % 5)
    name = "" if number == 111 else f"H{number:03d}"
    length = f"{20 + number / 7:.2f}".replace(".", ",")
    return f"{name};S{number:03d};S{number + 1:03d};{size};Steinzeug;{length};Müllerstraße"


def american(number: int) -> str:
    size = "?" if number in (57, 111) else 8 + 2 * (number % 5)
    length = f"{60 + number / 7:.1f}"
    return f"P{number:03d},M{number:03d},M{number + 1:03d},{size},VCP,{length},Main St"


@pytest.mark.parametrize(
    ("head", "row", "encoding", "asset"),
    [
        (
            "Haltung;Von Schacht;Bis Schacht;DN;Material;Länge;Straße", german, "cp1252",
            ["H011", "S011", "S012", "350 mm", "Steinzeug", "21.57 m", "Müllerstraße"],
        ),
        (
            "Pipe ID,US MH,DS MH,Dia (in),Matl,Length (ft),Street", american, "utf-8-sig",
            ["P011", "M011", "M012", "254 mm", "VCP", "18.7757 m", "Main St"],
        ),
    ],
)  # fmt: skip
def test_a_register_with_other_names_and_units_is_imported_in_few_actions(
    page: Page,
    empty: Server,
    tmp_path: Path,
    head: str,
    row: Callable[[int], str],
    encoding: str,
    asset: list[str],
) -> None:
    table = tmp_path / "sections.csv"
    table.write_text("\n".join([head, *map(row, range(SECTIONS))]), encoding)
    log_in(page, empty, "/assets/register")
    hands = Hands(page)
    hands.choose(page.get_by_role("button", name="Import CSV").first, table)
    shown = page.get_by_role("region", name="What the table does")
    expect(shown.get_by_role("row", name=asset[0]).get_by_role("cell")).to_contain_text(
        ["13", *asset, "is added"]
    )
    left_out = page.get_by_role("region", name="Faults")
    expect(left_out.get_by_role("row")).to_have_count(3)  # the head and two rows
    expect_no_fault(page)
    hands.click(page.get_by_role("button", name="Import 198 assets"))
    expect(page.get_by_text("Imported: 198 new, 0 changed")).to_be_visible()
    expect(left_out).to_contain_text("59")
    expect(left_out).to_contain_text("113")
    hands.click(page.get_by_role("button", name="Close"))
    expect(page.get_by_text("198 assets")).to_be_visible()
    assert hands.actions <= MOST_ACTIONS
