"""Code packs over HTTP: imported, used by an inspection, deleted."""

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import openpyxl
import pytest
from builders import Client, assert_error

TABLE = (
    "code,char1,char2,label,group,needs_clock,needs_q1,unit_q1,needs_q2,unit_q2,"
    "continuous_allowed,grade_s\n"
    "SCR,,,Scour at the outlet,S,no,opt,mm,no,,no,3\n"
    "BAB,,,Our crack,S,yes,no,,no,,yes,2\n"
)


def add(client: Client, name: str, table: str = TABLE, **more: str) -> httpx.Response:
    headers = {"Content-Type": "text/csv"}
    return client.post("/api/packs", params={"name": name, **more}, content=table, headers=headers)


@pytest.fixture
def pack(shared: Client) -> Iterator[dict[str, Any]]:
    """An imported pack, the only one."""
    added = add(shared, "Road agency")
    assert added.status_code == 201, added.text
    yield dict(added.json())
    shared.delete(f"/api/packs/{added.json()['id']}")


def test_a_pack_is_listed_and_its_codes_are_returned(shared: Client, pack: dict[str, Any]) -> None:
    assert shared.get("/api/packs").json() == {"packs": [pack]}
    assert (pack["name"], pack["codes"], pack["created_by"]) == ("Road agency", 2, "server")
    scour, crack = shared.get("/api/codes", params={"pack": pack["id"]}).json()
    assert (scour["code"], scour["label"], scour["unit_q1"]) == ("SCR", "Scour at the outlet", "mm")
    assert (crack["label_ms"], crack["grade_s"], crack["hotkey"]) == ("Our crack", 2.0, None)


def test_without_a_pack_the_codes_are_those_of_the_standard(shared: Client) -> None:
    codes = shared.get("/api/codes").json()
    assert len(codes) == 519
    assert codes[3]["label_ms"] == "Retak: retak rambut pada permukaan, memanjang paip"


def test_faults_are_reported_and_nothing_is_kept(shared: Client) -> None:
    answer = add(shared, "Faulty", TABLE.replace("opt", "perhaps").replace("BAB", "bab"))
    detail = assert_error(answer, 422, "invalid_pack")
    assert "line 2: needs_q1 must be yes, no or opt (found 'perhaps')" in detail
    assert "line 3: code must be" in detail
    assert shared.get("/api/packs").json() == {"packs": []}


@pytest.mark.usefixtures("pack")
def test_a_name_is_within_bounds_and_a_table_can_be_had_once(shared: Client) -> None:
    for name in ("", "  ", "a\nb", "x" * 101):
        assert_error(add(shared, name), 422, "invalid_request")
    assert_error(add(shared, " Road agency "), 409, "pack_name_taken")


def test_an_inspection_is_coded_with_its_pack_in_exports(
    shared: Client, pack: dict[str, Any], own: str
) -> None:
    path, header = f"/api/inspections/{own}", {"code_pack": pack["id"]}
    shared.patch(path, json={"header": header}).raise_for_status()
    shared.tag(own, code="BAB", char1="C")
    content = shared.get(f"{path}/exports/csv").content
    (row,) = csv.DictReader(io.StringIO(content.decode("utf-8-sig")))
    assert (row["label"], row["code_pack"]) == ("Our crack", "Road agency")
    shared.delete(path)


def test_a_pack_in_use_stays_until_nobody_uses_it(
    shared: Client, pack: dict[str, Any], own: str
) -> None:
    path, header = f"/api/inspections/{own}", {"code_pack": pack["id"]}
    assert shared.patch(path, json={"header": header}).json()["header"] == header
    answer = shared.delete(f"/api/packs/{pack['id']}")
    assert "'Road agency'" in assert_error(answer, 409, "pack_in_use")
    shared.patch(path, json={"header": {}})
    assert shared.delete(f"/api/packs/{pack['id']}").status_code == 204
    assert_error(shared.delete(f"/api/packs/{pack['id']}"), 404, "pack_not_found")
    assert_error(shared.get("/api/codes", params={"pack": pack["id"]}), 404, "pack_not_found")


def test_a_chosen_pack_that_was_deleted_is_the_built_in_one_again(
    shared: Client, pack: dict[str, Any]
) -> None:
    chosen = shared.get("/api/me").json()["preferences"] | {"pack": pack["id"]}
    assert shared.put("/api/me/preferences", json=chosen).json()["pack"] == pack["id"]
    shared.delete(f"/api/packs/{pack['id']}")
    assert shared.get("/api/me").json()["preferences"]["pack"] is None


def test_an_inspection_with_a_pack_that_is_not_there_is_refused_and_the_upload_stays(
    shared: Client, clip: Path, own: str
) -> None:
    header = {"code_pack": "0" * 32}
    assert_error(shared.create(clip, header=header), 404, "pack_not_found")
    assert list((shared.data / "uploads").glob("*.bin"))
    answer = shared.patch(f"/api/inspections/{own}", json={"header": header})
    assert_error(answer, 404, "pack_not_found")


def test_the_template_is_a_workbook_that_can_be_imported(shared: Client) -> None:
    template = shared.get("/api/packs/template.xlsx").content
    found = shared.post("/api/packs/preview", params={"name": "Invented"}, content=template).json()
    assert (found["faults"], found["count"], len(found["ratings"])) == ([], 26, 5)
    assert found["codes"][1]["labels"]["ms"] == "Belahan: halus, memanjang"
    assert shared.get("/api/packs").json() == {"packs": []}, "a preview keeps nothing"


def test_a_preview_names_all_faults_of_a_workbook_with_sheet_and_row(shared: Client) -> None:
    book = openpyxl.load_workbook(io.BytesIO(shared.get("/api/packs/template.xlsx").content))
    book["codes"]["A3"], book["ratings"]["F2"] = "x", "guess"
    out = io.BytesIO()
    book.save(out)
    asked = {"params": {"name": "Faulty"}, "content": out.getvalue()}
    faults = shared.post("/api/packs/preview", **asked).json()["faults"]
    assert [fault[:22] for fault in faults] == [
        "sheet codes, row 3: co", "sheet ratings, row 2: ",
    ]  # fmt: skip
    assert "sheet codes, row 3" in assert_error(
        shared.post("/api/packs", **asked), 422, "invalid_pack"
    )


def test_an_inspection_keeps_its_version_until_a_person_moves_it(
    shared: Client, pack: dict[str, Any], own: str
) -> None:
    path = f"/api/inspections/{own}"
    shared.patch(path, json={"header": {"code_pack": pack["id"]}}).raise_for_status()
    scour = shared.tag(own, code="SCR", quant1=3.0).json()
    newer = add(shared, "Road agency", TABLE.replace("SCR", "SCO")).json()
    assert (newer["name"], newer["title"], newer["version"]) == ("Road agency v2", "Road agency", 2)
    listed = shared.get("/api/packs").json()["packs"]
    assert [(one["version"], one["inspections"]) for one in listed] == [(2, 0), (1, 1)]
    lost = shared.get(f"{path}/checks/with-pack", params={"pack": newer["id"]}).json()["checks"]
    assert [(one["code"], one["observation_id"]) for one in lost] == [("unknown_code", scour["id"])]
    assert shared.get(path).json()["header"]["code_pack"] == pack["id"]
    assert_error(shared.delete(f"/api/packs/{pack['id']}"), 409, "pack_in_use")
    shared.patch(path, json={"header": {"code_pack": newer["id"]}}).raise_for_status()
    assert [one["inspections"] for one in shared.get("/api/packs").json()["packs"]] == [1, 0]
    shared.delete(path)
    shared.delete(f"/api/packs/{newer['id']}").raise_for_status()


def test_a_pack_of_a_project_is_for_its_inspections_alone(shared: Client, own: str) -> None:
    made = add(shared, "Licensed", project="Hill roads").json()
    path, pack = f"/api/inspections/{own}", {"code_pack": made["id"]}
    answer = shared.patch(path, json={"header": pack})
    assert "belongs to the project 'Hill roads'" in assert_error(answer, 404, "pack_not_found")
    asked = shared.get(f"{path}/checks/with-pack", params={"pack": made["id"]})
    assert_error(asked, 404, "pack_not_found")
    header = {**pack, "project": "Hill roads"}
    assert shared.patch(path, json={"header": header}).json()["header"] == header
    answer = add(shared, "Licensed", TABLE.replace("SCR", "SCO"))
    assert "for the project 'Hill roads'" in assert_error(answer, 409, "pack_name_taken")
    shared.delete(path)
    shared.delete(f"/api/packs/{made['id']}").raise_for_status()
