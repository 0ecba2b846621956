"""The map: where each asset is, and how bad its newest inspection found it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from builders import Client, assert_error, serving, wait_until
from mapped_assets import Inspected, Registered, fill

from app.storage.database.database import FILE, Database

TILES = "https://tiles.example:8443/roads/{z}/{x}/{y}.png?key=k"
ENDS = {"start_lat": 3.1, "start_lon": 101.6, "end_lat": 3.2, "end_lon": 101.7}

REGISTER = [
    Registered("CV-01", [[101.5, 3.0], [101.5001, 3.0002]], "North"),
    Registered("CV-02", project="North"),
    Registered("CV-03", project="South"),
    Registered("CV-04", [[-179.9999999, -16.5]]),
]
INSPECTIONS = [
    Inspected("CV-01", "2019-05-02", (5,), "Old", ENDS),
    Inspected("CV-01", "2024-05-02", (2, 3), "Other"),
    Inspected("CV-01", "2025-05-02", status="draft"),
    Inspected("cv 01", "2024-05-02", (4,)),
    Inspected("CV-02", "2020-05-02", (1,), None, ENDS),
    Inspected("CV-02", "2024-05-02"),
    Inspected("CV-05", "2024-05-02", (0,), "South", {"end_lat": 3.2, "end_lon": 101.7}),
    Inspected("CV-06", "2024-05-02", (4,), "South", {"start_lat": 95.0, "start_lon": 10.0}),
]


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A server with the assets above, and an administrator's tiles."""
    data = tmp_path_factory.mktemp("data")
    database = Database(data / FILE)
    fill(database, REGISTER, INSPECTIONS)
    database.close()
    settings = {"map_tiles": TILES, "map_attribution": "© Surveyors"}
    with serving(data, **settings) as running:
        yield running


def shown(client: Client, **wanted: Any) -> dict[str, Any]:
    """The map once everything is indexed."""

    def answer() -> dict[str, Any] | None:
        got = client.get("/api/map", params=wanted)
        assert got.status_code == 200, got.text
        body: dict[str, Any] = got.json()
        return body if body["pending"] == 0 else None

    return wait_until(answer)


def test_each_asset_has_its_place_and_the_grade_of_its_newest_inspection(client: Client) -> None:
    found = shown(client)
    assert found.pop("assets") == [
        {
            "asset": "cv 01", "project": None, "worst_severity": 4, "inspections": 1,
            "last_at": "2024-05-02", "line": [[101.5, 3.0], [101.5001, 3.0002]],
        },
        {
            "asset": "CV-01", "project": "North", "worst_severity": 3, "inspections": 3,
            "last_at": "2024-05-02", "line": [[101.5, 3.0], [101.5001, 3.0002]],
        },
        {
            "asset": "CV-05", "project": "South", "worst_severity": 0, "inspections": 1,
            "last_at": "2024-05-02", "line": [[101.7, 3.2]],
        },
        {
            "asset": "CV-02", "project": "North", "worst_severity": None, "inspections": 2,
            "last_at": "2024-05-02", "line": [[101.6, 3.1], [101.7, 3.2]],
        },
        {
            "asset": "CV-04", "project": None, "worst_severity": None, "inspections": 0,
            "last_at": None, "line": [[-180.0, -16.5]],
        },
    ]  # fmt: skip
    assert found == {
        "placed": 5, "unplaced": 2, "projects": ["North", "Old", "Other", "South"], "pending": 0,
        "tiles": TILES, "attribution": "© Surveyors",
    }  # fmt: skip


def test_assets_are_wanted_by_project_grade_or_name(client: Client) -> None:
    def names(**wanted: Any) -> tuple[list[str], int]:
        found = shown(client, **wanted)
        return [asset["asset"] for asset in found["assets"]], found["unplaced"]

    assert names(project="South") == (["CV-05"], 2)
    assert names(severity_from=1) == (["cv 01", "CV-01"], 1)
    assert names(project="North", severity_from=0) == (["CV-01"], 0)
    assert names(project="Old") == (["CV-01"], 0)
    assert names(asset="cv 01") == (["cv 01"], 0)
    assert names(asset="CV-06") == ([], 1)
    assert names(project="Nowhere") == ([], 0)
    assert_error(client.get("/api/map?severity_from=6"), 422, "invalid_request")


def test_the_page_may_show_pictures_of_the_server_of_tiles_and_of_no_other(client: Client) -> None:
    def pictures(running: Client) -> str:
        policy = running.get("/").headers["Content-Security-Policy"]
        (found,) = [part for part in policy.split("; ") if part.startswith("img-src ")]
        return found

    own = "img-src 'self' blob: data:"
    assert pictures(client) == f"{own} https://tiles.example:8443"
    with serving(client.data.parent / "without") as without:
        assert pictures(without) == own
        assert (shown(without)["tiles"], shown(without)["attribution"]) == (None, None)
