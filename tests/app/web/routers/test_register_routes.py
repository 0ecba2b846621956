"""The register of assets through its routes, and what new inspections take from it."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from builders import Client, assert_error, serving, wait_until

from app.storage.database.backup import back_up, restore
from app.storage.database.database import Database
from app.storage.records.assets import AssetStore
from app.survey.assets.register import registered

API = "/api/register"
PIPE = {"shape": "circular", "height_mm": 600}
LINE = [[101.6869, 3.139], [101.687, 3.1391]]


def path_of(asset_id: str) -> str:
    return f"{API}/assets/{quote(asset_id, safe='')}"


def take(client: Client, table: str, *, dry_run: bool = False) -> Any:
    query = {"dry_run": str(dry_run).lower()}
    answer = client.post(f"{API}/import", content=table.encode(), params=query)
    assert answer.status_code == 200, answer.text
    return answer.json()


def ids(client: Client, **query: Any) -> list[str]:
    return [each["asset_id"] for each in client.get(f"{API}/assets", params=query).json()["assets"]]


def like(client: Client, asset_id: str) -> Any:
    return client.get(f"{API}/like", params={"asset_id": asset_id}).json()


def test_an_asset_is_kept_found_changed_and_deleted(
    server: Client, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "app.inspections.register")
    kept = {"project": "North", "header": PIPE, "line": LINE}
    name = "A/1 ü?# b"
    made = server.put(path_of(name), json=kept)
    spaced = path_of(" A/1  ü?# b ")
    assert made.json() == server.get(path_of(name)).json() == server.get(spaced).json()
    assert {key: made.json()[key] for key in kept} == kept
    other = {"project": None, "header": {"year": 1998}, "line": []}
    version = {"If-Match": made.headers["ETag"]}
    assert server.put(path_of(name), json=other, headers=version).status_code == 200
    late = server.put(path_of(name), json=kept, headers=version)
    assert (late.status_code, late.json()["code"]) == (412, "changed_meanwhile")
    late = server.delete(spaced, headers=version)
    assert (late.status_code, late.json()["code"]) == (412, "changed_meanwhile")
    for wrong in ({"header": {"operator": "Ali"}}, {"header": {"year": "old"}}):
        assert_error(server.put(path_of("B"), json=wrong), 422, "invalid_request")
    for line in ([[500_000, 400_000]], [[1, 2, 3]], [[1, 91]]):
        assert_error(server.put(path_of("B"), json={"line": line}), 422, "invalid_request")
    assert_error(server.put(path_of("--"), json={}), 422, "invalid_request")
    server.put(path_of("B 2"), json={"header": {"road": "Jalan Ümpang"}})
    assert ids(server) == [name, "B 2"]
    assert (ids(server, search="umpang"), ids(server, search="b2")) == (["B 2"], ["B 2"])
    assert ids(server, offset=1, limit=1) == ["B 2"]
    version = {"If-Match": f'"{server.get(f"{API}/assets").json()["assets"][0]["version"]}"'}
    assert server.delete(spaced, headers=version).status_code == 204
    assert "server put asset 'A/1 ü?# b' into the register." in caplog.messages
    assert "server took asset 'A/1 ü?# b' off the register." in caplog.messages
    assert_error(server.delete(path_of(name)), 404, "asset_not_found")
    assert_error(server.get(path_of(name)), 404, "asset_not_found")


def test_a_table_is_tried_its_good_rows_imported_and_exported(server: Client) -> None:
    server.put(path_of("CV-01"), json={"header": PIPE})
    broken = "asset_id,height_mm,colour\nCV-01,700,red\nCV-02,wide,blue\nCV-03,,\n"
    for dry_run in (True, False):
        found = take(server, broken, dry_run=dry_run)
        assert (found["added"], found["changed"], found["same"], found["faulty"]) == (
            1, 1, 0, 1,
        )  # fmt: skip
        (fault,) = found["faults"]
        assert (fault["row"], fault["column"], "wide" in fault["detail"]) == (
            3, "height_mm", True,
        )  # fmt: skip
        assert [row["action"] for row in found["rows"]] == ["change", "fault", "add"]
        assert [row["header"].get("height_mm") for row in found["rows"]] == [700, None, None]
        assert [column["field"] for column in found["columns"]] == ["asset_id", "height_mm", None]
        assert ids(server) == (["CV-01"] if dry_run else ["CV-01", "CV-03"])
    assert server.get(path_of("CV-01")).json()["header"] == PIPE | {"height_mm": 700}
    server.delete(path_of("CV-03"))
    server.put(path_of("CV-01"), json={"header": PIPE})
    table = "asset_id;project;known_length_m\ncv 01;North;12,5\nCV_01;North;\nCV-01;South;\n"
    tried = take(server, table, dry_run=True)
    assert [(each["row"], each["same"]) for each in tried["warnings"]] == [
        (2, ["CV-01", "CV_01"]),
        (3, ["CV-01", "cv 01"]),
    ]
    assert ids(server) == ["CV-01"]
    assert take(server, table)["added"] == 2
    assert sorted(ids(server)) == ["CV-01", "CV_01", "cv 01"]
    assert server.get(path_of("CV-01")).json()["header"] == PIPE
    export = server.get(f"{API}/assets.csv")
    assert export.headers["Content-Type"] == "text/csv; charset=utf-8"
    assert "attachment" in export.headers["Content-Disposition"]
    again = take(server, export.text)
    assert (again["same"], again["added"], again["changed"]) == (3, 0, 0)
    template = server.get(f"{API}/template.csv").text
    assert [row["action"] for row in take(server, template)["rows"]] == ["fault"]


def test_what_the_columns_of_a_table_hold_is_guessed_or_stated(server: Client) -> None:
    table = "Haltung;DN;Ort\nH 1;12;Au\n"
    guessed = take(server, table, dry_run=True)["columns"]
    assert guessed == [
        {"name": "Haltung", "examples": ["H 1"], "field": "asset_id", "unit": None},
        {"name": "DN", "examples": ["12"], "field": "diameter_mm", "unit": "in"},
        {"name": "Ort", "examples": ["Au"], "field": "location_text", "unit": None},
    ]
    stated = {"columns": ["asset_id", "width_mm:cm", ""]}
    answer = server.post(f"{API}/import", content=table.encode(), params=stated)
    assert answer.json()["rows"] == [
        {"row": 2, "asset_id": "H 1", "action": "add", "header": {"width_mm": 120}}
    ]
    assert server.get(path_of("H 1")).json()["header"] == {"width_mm": 120}
    fields = {field["name"]: field["units"] for field in answer.json()["fields"]}
    assert (fields["year"], "in" in fields["height_mm"]) == ([], True)
    for columns in (["asset_id"], ["asset_id", "depth", ""], ["year", "year", ""]):
        wrong = server.post(f"{API}/import", content=table.encode(), params={"columns": columns})
        assert_error(wrong, 422, "invalid_table")


@pytest.fixture
def idle(tmp_path: Path) -> Iterator[Client]:
    """A server that tracks nothing."""
    with serving(tmp_path / "data", max_jobs=0) as client:
        yield client


def test_a_new_inspection_takes_what_the_register_knows(
    idle: Client, clip: Path, tmp_path: Path
) -> None:
    kept = {"project": "North", "header": PIPE | {"material": "clay"}, "line": LINE}
    idle.put(path_of("CV-01"), json=kept)
    known = like(idle, "CV-01")["fields"]
    assert known == PIPE | {
        "material": "clay", "project": "North", "start_lon": 101.6869, "start_lat": 3.139,
        "end_lon": 101.687, "end_lat": 3.1391,
    }  # fmt: skip
    header = {"asset_id": " CV-01 ", "material": "steel", "height_mm": None}
    made = idle.create(clip, header=header).json()
    wanted = {key: known[key] for key in known.keys() - {"shape", "height_mm"}}
    assert made["header"] == wanted | {"asset_id": "CV-01", "material": "steel"}
    event = idle.get(f"/api/inspections/{made['id']}/events").json()["events"][0]
    assert event["after"]["header"] == made["header"]

    other = idle.create(clip, header={"asset_id": "cv.01"}).json()
    assert other["header"] == {"asset_id": "cv.01"}
    wait_until(lambda: "cv.01" in like(idle, "CV 01")["same"])
    assert like(idle, "CV 01") == {"same": ["CV-01", "cv.01"], "fields": None}
    assert like(idle, " CV-01 ")["same"] == ["cv.01"]
    assert like(idle, "CV-02") == {"same": [], "fields": None}

    back_up(idle.data, tmp_path / "backup.zip", lambda *_: None)
    restore(tmp_path / "backup.zip", tmp_path / "restored", lambda *_: None)
    restored = Database(tmp_path / "restored" / "chainage.db")
    assert list(AssetStore(restored).every()) == [
        registered("CV-01", "North", kept["header"], tuple(map(tuple, LINE)))
    ]
    restored.close()
