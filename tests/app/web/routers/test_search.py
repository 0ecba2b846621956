"""Defects, assets and films are found across all inspections, as each of them shows them."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path
from typing import Any

import pytest
from builders import TOKEN, Client, assert_error, serving, wait_until
from surveys import Survey

TAGS = [f"7d444840-9dc0-4d2a-8a6a-00000000000{n}" for n in range(10)]
STEP_M = 0.0016


def found(client: Client, what: str = "defects", **query: Any) -> dict[str, Any]:
    """The answer once everything is indexed."""

    def answer() -> dict[str, Any] | None:
        got = client.get(f"/api/archive/{what}", params=query)
        assert got.status_code == 200, got.text
        body: dict[str, Any] = got.json()
        return body if body["pending"] == 0 else None

    return wait_until(answer)


def photographed(client: Client, **query: Any) -> dict[str, Any]:
    """The answer once each defect has its photo too, which is made in another process."""

    def answer() -> dict[str, Any] | None:
        body = found(client, **query)
        return body if all(one["photo"] for one in body["defects"]) else None

    return wait_until(answer)


def tag(client: Client, inspection_id: str, number: int, **fields: Any) -> str:
    client.tag(inspection_id, TAGS[number], **fields).raise_for_status()
    return TAGS[number]


def state(client: Client, inspection_id: str, **changes: Any) -> None:
    header = client.inspection(inspection_id)["header"] | changes
    client.patch(f"/api/inspections/{inspection_id}", json={"header": header}).raise_for_status()


def again(client: Client, inspection_id: str, **changes: Any) -> str:
    """The same survey once more, as another inspection with another header."""
    content = client.get(f"/api/inspections/{inspection_id}/exports/json").content
    made = client.post("/api/imports", params={"filename": "again.json"}, content=content)
    assert made.status_code == 201, made.text
    (inspection,) = made.json()["inspections"]
    state(client, inspection["id"], **changes)
    return str(inspection["id"])


@pytest.mark.parametrize(
    "database_kind",
    ["sqlite", pytest.param("postgresql", marks=pytest.mark.long)],
    indirect=True,
    scope="module",
)
def test_a_defect_is_found_as_its_inspection_shows_it(server: Client, done: str) -> None:
    state(server, done, asset_id="CUL-0041", project="Road 7", date="2024-03-02")
    one = tag(
        server, done, 1, frame=20, pixel=[60.0, 90.0], code="BAB", char1="B", char2="A",
        clock_from=11, clock_to=2, severity=4, remark="Résidus 100 %",
    )  # fmt: skip
    tag(server, done, 2, frame=5, code="BBF", severity=1)

    answer = photographed(server, code="BAB")

    (defect,) = answer["defects"]
    shown = server.get(f"/api/inspections/{done}/observations/{one}").json()
    assert answer["total"] == 1
    same = ("frame", "seq", "code", "severity", "clock", "clock_to", "remark", "created_at",
            "distance_m", "distance_u95_m", "char1", "continuous")  # fmt: skip
    assert {name: defect[name] for name in same} == {name: shown[name] for name in same}
    assert defect["distance_m"] != pytest.approx(20 * STEP_M)  # of the wall under the pixel
    assert (defect["inspection_id"], defect["observation_id"]) == (done, one)
    assert (defect["project"], defect["asset"]) == ("Road 7", "CUL-0041")
    assert (defect["surveyed_on"], defect["photo"]) == ("2024-03-02", True)
    assert defect["label"].startswith("Crack")
    assert {name: label.split(":")[0] for name, label in defect["labels"].items()} == {
        "de": "Riss", "ms": "Retak",
    }  # fmt: skip
    for fits in (
        {"text": "RESIDUS 100 % cul-0041"}, {"severity_from": 4}, {"clock": "12"},
        {"clock": "1-5"},
        {"from_m": defect["distance_m"], "to_m": defect["distance_m"], "severity_from": 2},
        {"asset": "CUL-0041", "project": "Road 7", "sort": "severity", "limit": 1},
        {"after": "2024-03-02", "before": "2024-03-02", "text": "crack"},
        {"text": "riss längs"}, {"text": "retak"},
    ):  # fmt: skip
        assert found(server, **fits)["defects"][:1] == [defect], fits
    for misses in (
        {"text": "res_dus"}, {"severity_from": 5}, {"clock": "3-10"}, {"from_m": 100.0},
        {"asset": "CUL"}, {"after": "2024-03-03"}, {"code": "C"},
    ):  # fmt: skip
        assert found(server, **misses)["total"] == 0, misses


def test_distances_follow_a_correction_and_what_is_deleted_is_gone(
    server: Client, done: str
) -> None:
    tag(server, done, 1, frame=20, code="BAB")
    tag(server, done, 2, frame=30, code="BAB")
    before = found(server, sort="distance_m", descending=False)["defects"]
    zero = {"zero": {"frame": 0, "offset_m": 5.0}}
    server.put(f"/api/inspections/{done}/corrections", json=zero).raise_for_status()
    after = found(server, sort="distance_m", descending=False)["defects"]
    moved = [b["distance_m"] - a["distance_m"] for a, b in zip(before, after, strict=True)]
    assert moved == pytest.approx([5.0, 5.0], abs=0.002)
    assert (
        after[0]["revision"] == server.inspection(done).get("revision", 1) > before[0]["revision"]
    )

    tag(server, done, 0, frame=0, code="BCD")  # is no defect, but who wants it finds it
    assert TAGS[0] not in [one["observation_id"] for one in found(server)["defects"]]
    (start,) = found(server, code="BCD")["defects"]
    assert start["observation_id"] == TAGS[0]
    server.delete(f"/api/inspections/{done}/observations/{TAGS[1]}").raise_for_status()
    assert [one["observation_id"] for one in found(server)["defects"]] == [TAGS[2]]
    server.delete(f"/api/inspections/{done}").raise_for_status()
    assert found(server) == {"total": 0, "pending": 0, "defects": []}
    assert found(server, "assets")["assets"] == []
    assert found(server, "quality")["films"] == []


def test_a_page_is_a_part_of_the_sorted_list(server: Client, done: str) -> None:
    for number in range(7):
        tag(server, done, number, frame=3 * number, severity=number % 3)
    listed = found(server, sort="severity", limit=7)["defects"]
    assert [one["severity"] for one in listed] == [2, 2, 1, 1, 0, 0, 0]
    pages = [found(server, sort="severity", limit=3, offset=3 * page) for page in range(4)]
    assert [one for page in pages for one in page["defects"]] == listed
    assert {page["total"] for page in pages} == {7}


def test_an_index_that_was_dropped_is_made_again_though_one_inspection_is_damaged(
    survey: Survey, tmp_path: Path
) -> None:
    data = survey.copied_to(tmp_path / "data")
    with serving(data) as client:
        tag(client, survey.id, 1, frame=20, code="BAB", remark="kept")
        whole = photographed(client)
        other = again(client, survey.id)
    (data / "inspections" / other / "track.csv").write_bytes(b"\xff\xfe")
    with sqlite3.connect(data / "chainage.db") as database:
        database.execute("DELETE FROM indexed_defects")
        database.execute("DELETE FROM indexed_inspections")
    with serving(data) as client:
        wait_until(lambda: client.get("/api/archive/defects").json()["pending"] == 1)
        assert client.get("/api/archive/defects").json() == whole | {"pending": 1}


def test_the_history_of_an_asset_shows_what_grew(server: Client, done: str) -> None:
    state(server, done, asset_id="A/1 é", date="2019-05-01", job_ref="J1")
    tag(server, done, 1, frame=20, code="BAB", char1="A", severity=2, clock_from=12)
    tag(server, done, 2, frame=38, code="BBA", severity=3)
    later = again(server, done, date="2024-05-01", job_ref="J2")
    tag(server, later, 1, frame=21, code="BAB", char1="C", severity=4, clock_from=1)
    server.delete(f"/api/inspections/{later}/observations/{TAGS[2]}").raise_for_status()
    tag(server, later, 3, frame=30, code="BAF", severity=1)

    (asset,) = found(server, "assets", search="a/1 E")["assets"]
    assert asset == {
        "asset": "A/1 é", "project": "J2", "inspections": 2, "last_at": "2024-05-01",
        "worst_severity": 4, "filmed_id": None, "is_registered": False, "also_written": [],
    }  # fmt: skip
    history = found(server, "assets/A%2F1%20%C3%A9")
    assert history["asset"] == "A/1 é"
    first, second = history["inspections"]
    assert (first["id"], second["id"]) == (done, later)
    assert (first["at"], first["status"], first["worst_severity"]) == ("2019-05-01", "done", 3)
    assert first["length_m"] == server.inspection(done)["distance_m"]
    assert [one["code"] for one in second["defects"]] == ["BAB", "BAF"]
    traces = {one["code"]: one for one in history["traces"]}
    grown = traces["BAB"]
    assert (grown["first_severity"], grown["last_severity"], grown["has_grown"]) == (2, 4, True)
    assert (grown["change"], grown["changes"]) == ("grown", ["first", "grown"])
    growth = {"quantity": "severity", "before": 2, "after": 4, "unit": None}
    assert grown["growth"] == growth
    assert second["changes"]["grown"] == sum(first["changes"].values()) - 1 == 1
    assert (grown["first_at"], grown["last_at"]) == ("2019-05-01", "2024-05-01")
    assert [(one["inspection_id"], one["observation_id"]) for one in grown["seen"]] == [
        (done, TAGS[1]), (later, TAGS[1]),
    ]  # fmt: skip
    assert grown["distance_m"] == second["defects"][0]["distance_m"]
    assert (len(traces["BBA"]["seen"]), len(traces["BAF"]["seen"])) == (1, 1)
    assert found(server, "assets/nobody")["inspections"] == []


def imported(client: Client, day: str, *rows: str) -> None:
    """A survey of another program, with rows of distance and code."""
    listed = "\n".join(rows)
    text = f"#B01=AAD;ABF\nCV-77;{day}\n#C=I;A\n{listed}\n#Z\n"
    made = client.post("/api/imports", params={"filename": "old.txt"}, content=text.encode())
    (inspection,) = made.raise_for_status().json()["inspections"]
    header = {"asset_id": "CV-77", "date": day, "direction": "with_flow"}
    state(client, inspection["id"], **header)


def test_a_survey_shows_a_defect_as_gone_only_where_it_went(server: Client, done: str) -> None:
    imported(server, "2015-05-01", "0;BCD", "3;BAB", "30;BAF", "40;BCE")
    imported(server, "2019-05-01", "0;BCD", "12;BBA", "15;BDC")
    imported(server, "2024-05-01", "0;BCD", "12;BBA", "40;BCE")
    state(server, done, asset_id="CV-77", date="2025-05-01", direction="with_flow")  # not tagged
    history = found(server, "assets/CV-77")
    assert {one["code"]: one["changes"] for one in history["traces"]} == {
        "BAB": ["first", "gone", None, None],
        "BAF": ["first", None, "gone", None],
        "BBA": [None, "new", "unchanged", None],
    }
    assert [one["has_film"] for one in history["inspections"]] == [False, False, False, True]
    counts = history["inspections"][2]["changes"]
    assert counts == {"first": 0, "new": 0, "grown": 0, "unchanged": 1, "gone": 1}


def test_what_cannot_be_asked_is_refused(shared: Client) -> None:
    for query in (
        "clock=13", "clock=0-3", "severity_from=6", "sort=folded", "from_m=nan", "to_m=1e999",
        "limit=0", "limit=100000", "offset=-1", "after=yesterday", "text=%00", "code=bab%25",
    ):  # fmt: skip
        assert_error(shared.get(f"/api/archive/defects?{query}"), 422, "invalid_request")


def test_the_quality_of_a_film_is_listed(server: Client, done: str) -> None:
    (film,) = found(server, "quality")["films"]
    assert (film["inspection_id"], film["frames"], film["lost_share"]) == (done, 40, 0.0)
    assert json.dumps(film).count("null") <= 1  # the project
    for problem in film["problems"]:
        assert found(server, "quality", problem=problem)["total"] == 1
    assert found(server, "quality", problem="lost")["films"] == []


def test_who_may_only_look_may_search(shared: Client) -> None:
    with shared.anonymous() as nobody:
        for path in ("defects", "projects", "assets", "assets/a", "quality"):
            assert_error(nobody.get(f"/api/archive/{path}"), 401, "unauthenticated")
    assert shared.headers["Authorization"] == f"Bearer {TOKEN}"
