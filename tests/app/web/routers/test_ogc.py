"""OGC API Features: the standard's rules, and GDAL's own reader."""

from __future__ import annotations

import base64
import json
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest
from builders import TOKEN, Client, assert_error, wait_until
from surveys import Survey, another

from app.access.access import create_token
from app.storage.folder.tokens import Role, TokenFile

TAGS = [f"7d444840-9dc0-4d2a-8a6a-00000000000{n}" for n in range(5)]
COURSE = [[101.0, 3.0], [101.001, 3.0], [101.001, 3.001]]
READ = """
import json, sys
import pyogrio


url, configured, stated, layer, bbox = sys.argv[1:]
pyogrio.set_gdal_config_options(json.loads(configured))
pages = {"PAGE_SIZE": "2", "INITIAL_REQUEST_PAGE_SIZE": "2"} | json.loads(stated)
box = json.loads(bbox)
meta, _, shapes, columns = pyogrio.raw.read(
    f"OAPIF:{url}", layer=layer, bbox=box and tuple(box), **pages
)
rows = [dict(zip(meta["fields"], map(str, row))) for row in zip(*columns)]
print(json.dumps({"crs": meta["crs"], "kind": meta["geometry_type"], "rows": rows,
                  "shapes": [None if shape is None else len(shape) for shape in shapes]}))
"""
"""Reads a layer in a process of its own: GDAL would wait for a server that waits for its thread."""


@pytest.fixture(scope="module")
def filled(shared: Client, survey: Survey) -> Client:
    """Seven assets, an inspection of one of them in March, four observations on its course."""
    for number in range(7):
        line = COURSE if number == 0 else [[101.0 + number, 3.0], [101.0 + number, 3.001]]
        body = {"project": f"Road {number % 2}", "line": line, "header": {"material": "AE"}}
        path = f"/api/register/assets/CUL/{number}"
        shared.put(path, json=body).raise_for_status()
    header = {"asset_id": "CUL/0", "project": "Road 0", "date": "2026-03-02"}
    seen = another(survey, shared, name="Seen", header=header | {"known_length_m": 0.064})
    for number in range(4):
        shared.tag(seen, TAGS[number], frame=10 * number, code="BAB", severity=3).raise_for_status()
    wait_until(lambda: shared.get("/api/archive/defects").json()["pending"] == 0)
    wait_until(lambda: of_culvert(shared)[0]["properties"]["photo"])
    return shared


def page(client: Client, kind: str, **query: Any) -> dict[str, Any]:
    answer = client.get(f"/ogc/collections/{kind}/items", params=query)
    assert answer.status_code == 200, answer.text
    assert answer.headers["Content-Type"] == "application/geo+json"
    found: dict[str, Any] = answer.json()
    assert found["numberReturned"] == len(found["features"])
    return found


def of_culvert(client: Client, **query: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = page(client, "observations", asset="CUL/0", **query)["features"]
    return found


def linked(document: dict[str, Any]) -> dict[str, str]:
    assert all({"href", "rel", "type"} <= link.keys() for link in document["links"])
    return {link["rel"]: link["href"] for link in document["links"]}


def pages(client: Client, kind: str, **query: Any) -> Iterator[dict[str, Any]]:
    found = page(client, kind, **query)
    yield found
    while following := linked(found).get("next"):
        found = client.get(following).json()
        yield found


def test_the_documents_lead_from_one_to_the_next(filled: Client) -> None:
    landing = filled.get("/ogc").json()
    links = linked(landing)
    assert {"self", "service-desc", "conformance", "data"} <= links.keys()
    assert filled.get(links["service-desc"]).json()["openapi"].startswith("3.1")
    classes = filled.get(links["conformance"]).json()["conformsTo"]
    assert [name.rsplit("/", 1)[1] for name in classes] == ["core", "geojson"]
    listed = filled.get(links["data"]).json()["collections"]
    assert [each["id"] for each in listed] == ["assets", "inspections", "observations"]
    for each in listed:
        assert filled.get(linked(each)["self"]).json() == each
        features = filled.get(linked(each)["items"]).json()
        (first, *_) = features["features"]
        alone = filled.get(f"{linked(each)['items']}/{first['id']}").json()
        assert {"self", "collection", "alternate"} <= linked(alone).keys()
        assert {name: alone[name] for name in first} == first
        assert filled.get(linked(alone)["self"]).json()["id"] == first["id"]
    assert_error(filled.get("/ogc/collections/pipes"), 404, "feature_not_found")
    for unknown in ("x", "x.y", "%00", "a/b"):
        refused = filled.get(f"/ogc/collections/observations/items/{unknown}")
        assert_error(refused, 404, "feature_not_found")


def test_pages_hold_every_feature_once_while_others_come_and_go(filled: Client) -> None:
    seen: list[str] = []
    for number, found in enumerate(pages(filled, "assets", limit=2)):
        if number == 0:  # before and behind the page that was read
            for name in ("AAA", "CUL/35"):
                filled.put(f"/api/register/assets/{name}", json={}).raise_for_status()
        seen += [feature["id"] for feature in found["features"]]
    assert seen == sorted(["CUL/35", *(f"CUL/{n}" for n in range(7))])
    for name in ("AAA", "CUL/35"):
        filled.delete(f"/api/register/assets/{name}").raise_for_status()
    assert page(filled, "assets", limit=2)["numberMatched"] == 7


def test_an_observation_lies_on_the_course_of_its_asset(filled: Client) -> None:
    (inspection,) = page(filled, "inspections", asset="CUL/0")["features"]
    assert inspection["geometry"] == {"type": "LineString", "coordinates": COURSE}
    found = of_culvert(filled)
    lons = [feature["geometry"]["coordinates"][0] for feature in found]
    assert lons == sorted(lons)
    assert lons[0] == 101.0
    assert len(set(lons)) > 1
    facts = found[0]["properties"]
    assert facts["page"].endswith(f"/inspections/{facts['inspection_id']}?defect={TAGS[0]}")
    assert filled.get(facts["photo"]).headers["Content-Type"] == "image/jpeg"

    # The line of the register has changed: the index follows.
    moved = [[lon + 1, lat] for lon, lat in COURSE]
    path = "/api/register/assets/CUL/0"
    body = {"project": "Road 0", "header": {"material": "AE"}}
    filled.put(path, json=body | {"line": moved}).raise_for_status()
    filled.tag(facts["inspection_id"], TAGS[0], frame=0, code="BAB", severity=4)  # wakes it
    wait_until(lambda: of_culvert(filled, bbox="102,2,102.1,4"))
    filled.put(path, json=body | {"line": COURSE}).raise_for_status()
    filled.tag(facts["inspection_id"], TAGS[0], frame=0, code="BAB", severity=3)
    wait_until(lambda: of_culvert(filled, bbox="101,2,101.1,4"))


@pytest.mark.parametrize(
    ("query", "number"),
    [
        ({"bbox": "102.5,2,104.5,4"}, 2),
        ({"bbox": "102.5,2,-9000000,104.5,4,9000000"}, 2),
        ({"bbox": "106.5,-90,101.5,90"}, 2),  # over 180 degrees
        ({"bbox": "179,2,-179,4"}, 0),
        ({"project": "Road 1"}, 3),
        ({"project": "road 1"}, 0),
        ({"asset": "CUL/3", "project": "Road 1"}, 1),
        ({"datetime": "1999-01-01/.."}, 7),  # assets have no time
    ],
)
def test_assets_are_filtered(filled: Client, query: dict[str, str], number: int) -> None:
    assert page(filled, "assets", **query)["numberMatched"] == number


@pytest.mark.parametrize(
    ("when", "number"),
    [
        ("2026-03-02", 4),
        ("2026-03-02T23:59:59Z", 4),
        ("2026-03-03T01:00:00+02:00", 4),
        ("2026-03-01", 0),
        ("../2026-03-01", 0),
        ("2026-03-02/..", 4),
        ("/2026-03-02T00:00:00Z", 4),
        ("2026-01-01T00:00:00Z/2026-12-31T00:00:00Z", 4),
    ],
)
def test_observations_are_of_the_day_of_their_survey(
    filled: Client, when: str, number: int
) -> None:
    found = page(filled, "observations", datetime=when, asset="CUL/0", code="BAB")
    assert found["numberMatched"] == number


@pytest.mark.parametrize(
    "query",
    [
        "colour=red", "limit=0", "limit=-1", "limit=x", "limit=1&limit=2", "bbox=1,2,3",
        "bbox=NaN,0,1,1",
        "bbox=0,0,inf,1", "bbox=0,2,1,1", "bbox=0,0,181,1", "bbox=1,2,3,4,5", "datetime=2026-13-01",
        "datetime=../..", "datetime=2026-02-01/2026-01-01", "datetime=2026-W09", "datetime=';--",
        "datetime=2026-01-01/2026-02-01/2026-03-01", "datetime=0001-01-01T00:00:00%2B14:00",
        "after=x",
        "project=a%00b", "bbox-crs=x", "limit=%D9%A3",
    ],
)  # fmt: skip
def test_what_is_not_understood_is_refused(filled: Client, query: str) -> None:
    refused = filled.get(f"/ogc/collections/observations/items?{query}")
    assert_error(refused, 400, "invalid_query")


def test_a_page_has_a_largest_size(filled: Client) -> None:
    assert page(filled, "assets", limit="9" * 30)["numberReturned"] == 7


def test_a_program_may_send_its_token_as_a_password(filled: Client) -> None:
    def credentials(text: str) -> dict[str, str]:
        return {"Authorization": f"Basic {base64.b64encode(text.encode()).decode()}"}

    stranger = filled.anonymous()
    assert stranger.get("/ogc", headers=credentials(f"qgis:{TOKEN}")).status_code == 200
    for wrong in (credentials("qgis:wrong"), credentials(TOKEN), {"Authorization": "Basic ="}):
        refused = stranger.get("/ogc/collections", headers=wrong)
        assert_error(refused, 401, "unauthenticated")
        assert refused.headers["WWW-Authenticate"].startswith("Basic ")
    # Nowhere else: a browser may send a password by itself.
    other = stranger.get("/api/me", headers=credentials(f"qgis:{TOKEN}"))
    assert_error(other, 401, "unauthenticated")


@pytest.mark.parametrize(
    ("layer", "bbox", "number"),
    [("assets", None, 7), ("assets", [102.5, 2, 104.5, 4], 2), ("observations", None, 4)],
)
def test_gdal_reads_a_layer_in_pages(
    filled: Client, layer: str, bbox: list[float] | None, number: int
) -> None:
    found = read_by_gdal(filled, TOKEN, layer, bbox)
    assert len(found["rows"]) >= number if layer == "observations" else len(found["rows"]) == number
    assert found["crs"] in ("OGC:CRS84", "EPSG:4326")
    assert all({"project", "asset", "page"} <= row.keys() for row in found["rows"])


def test_gdal_sees_the_projects_of_a_limited_token(filled: Client) -> None:
    token = create_token(TokenFile(filled.data), "gis", Role.VIEWER, frozenset({"Road 1"}))
    found = read_by_gdal(filled, token, "assets", None)
    assert {row["project"] for row in found["rows"]} == {"Road 1"}
    assert len(found["rows"]) == 3


def read_by_gdal(
    client: Client, token: str, layer: str, bbox: list[float] | None
) -> dict[str, Any]:
    bearer = {"GDAL_HTTP_AUTH": "BEARER", "GDAL_HTTP_BEARER": token}
    basic = {"USERPWD": f"gdal:{token}"}
    ways = (bearer, {}) if bbox is None else ({}, basic)
    arguments = (f"{client.server.url}/ogc", *map(json.dumps, ways), layer, json.dumps(bbox))
    command = [sys.executable, "-c", READ, *arguments]
    ran = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert ran.returncode == 0, ran.stderr
    found: dict[str, Any] = json.loads(ran.stdout)
    return found
