"""Old surveys become inspections: listed, tagged and exported like others, without a film."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from builders import Client, assert_error, serving
from reports import DEFECTS, OBSERVATIONS, report
from small_disk import small_disk
from wincan_files import project

from app.reports.formats import FORMATS

TEXT = FORMATS["en13508"].write(report()).content


def send(client: Client, content: bytes, filename: str = "old survey.txt") -> Any:
    return client.post("/api/imports", params={"filename": filename}, content=content)


def added(client: Client, content: bytes = TEXT) -> str:
    """Id of the only inspection of a file."""
    answer = send(client, content)
    assert answer.status_code == 201, answer.text
    (inspection,) = answer.json()["inspections"]
    return str(inspection["id"])


@pytest.fixture(scope="module")
def imported(shared: Client) -> str:
    return added(shared)


def observations(client: Client, inspection_id: str) -> list[dict[str, Any]]:
    path = f"/api/inspections/{inspection_id}/observations"
    return list(client.get(path).json()["observations"])


def test_a_survey_is_an_inspection_that_is_done(shared: Client, imported: str) -> None:
    inspection = shared.inspection(imported)
    assert (inspection["status"], inspection["source"]["kind"]) == ("done", "import")
    assert inspection["source"]["filename"] == "old survey.txt"
    assert (inspection["distance_m"], inspection["distance_u95_m"]) == (24.6, None)
    assert inspection["header"]["asset_id"] == "CUL-0041"
    assert inspection["defects"] == DEFECTS
    assert imported in [it["id"] for it in shared.get("/api/inspections").json()["inspections"]]


def test_its_observations_are_anchored_to_the_rows_of_a_track(
    shared: Client, imported: str
) -> None:
    rows = observations(shared, imported)
    assert [row["frame"] for row in rows] == list(range(len(OBSERVATIONS)))
    assert [row["distance_m"] for row in rows] == [it["distance_m"] for it in OBSERVATIONS]
    assert {row["distance_u95_m"] for row in rows} == {None}
    assert {row["distance_source"] for row in rows} == {"typed"}
    crack = rows[2]
    assert (crack["code"], crack["char1"], crack["char2"]) == ("BAB", "B", "A")
    assert (crack["continuous"], crack["clock_from"], crack["quant1"]) == ("A1", 11, 2.0)
    track = shared.get(f"/api/inspections/{imported}/track?format=json").json()["columns"]
    assert track["distance_mm"] == [1000 * it["distance_m"] for it in OBSERVATIONS]
    assert track["time_s"] == sorted(set(track["time_s"]))


def test_video_and_pictures_say_that_there_is_no_film(shared: Client, imported: str) -> None:
    for part in ("video", "frames/0.jpg"):
        answer = shared.get(f"/api/inspections/{imported}/{part}")
        assert "imported" in assert_error(answer, 409, "nothing_recorded")
    assert_error(shared.post(f"/api/inspections/{imported}/retry"), 409, "nothing_recorded")
    photo = observations(shared, imported)[0]
    assert "imported" in photo["photo_error"]


def test_it_is_exported_like_others(shared: Client, imported: str) -> None:
    kinds = (
        "csv", "json", "xlsx", "pdf", "zip", "en13508", "en13508xml", "ribx", "isybau", "m150",
    )  # fmt: skip
    made = {kind: shared.get(f"/api/inspections/{imported}/exports/{kind}") for kind in kinds}
    assert [kind for kind, answer in made.items() if answer.status_code != 200] == []
    assert b"+/-0.00" not in made["m150"].content, "it claims no interval"


def test_checks_and_corrections_work(shared: Client) -> None:
    imported = added(shared, TEXT.replace(b"Operator 1", b""))
    path = f"/api/inspections/{imported}"
    codes = {check["code"] for check in shared.get(f"{path}/checks").json()["checks"]}
    assert "header_field_empty" in codes
    assert shared.get(f"{path}/corrections").json()["result"] is None
    answer = shared.put(f"{path}/corrections", json={"zero": {"frame": 0, "offset_m": 0.5}})
    assert answer.status_code == 200
    assert observations(shared, imported)[2]["distance_m"] == 3.7
    assert shared.inspection(imported)["distance_m"] == 25.1


def test_another_tag_is_put_where_there_is_a_row_and_it_is_deleted_with_its_files(
    shared: Client,
) -> None:
    imported = added(shared)
    answer = shared.tag(imported, frame=2, code="BAC", remark="seen again")
    assert (answer.json()["distance_m"], answer.json()["distance_u95_m"]) == (3.2, None)
    refused = shared.tag(imported, frame=len(OBSERVATIONS))
    assert_error(refused, 422, "frame_outside_video")
    assert (shared.data / "inspections" / imported / "track.csv").exists()
    assert shared.delete(f"/api/inspections/{imported}").status_code == 204
    assert not (shared.data / "inspections" / imported).exists()


def test_every_inspection_of_a_project_is_imported(shared: Client, tmp_path: Path) -> None:
    answer = send(shared, project(tmp_path / "p.db3"), "p.db3").json()
    first, empty = answer["inspections"]
    assert (first["name"], first["distance_m"], first["defects"]) == ("CUL-7 2020-07-10", 24.6, 1)
    assert (empty["distance_m"], empty["defects"]) == (None, 0)
    assert any("CUL-7 2020-07-10: An observation BAC" in line for line in answer["warnings"])
    for inspection in (first, empty):
        path = f"/api/inspections/{inspection['id']}"
        for part in ("track", "checks", "corrections", "exports/json", "exports/xlsx"):
            assert shared.get(f"{path}/{part}").status_code == 200


def test_times_that_the_file_does_not_state_are_not_made_up(shared: Client) -> None:
    text = b"#B01=AAA;AAB;AAF;ABS\nC;N1;N2;film.mp4\n#C=I;A\n0;BCD\n4;BAC\n9;BCE\n#Z\n"
    imported = added(shared, text)
    assert b"<N>" not in shared.get(f"/api/inspections/{imported}/exports/ribx").content
    rows = shared.get(f"/api/inspections/{imported}/exports/json").json()["observations"]
    assert [row["video_time_s"] for row in rows] == [None, None, None]


def test_an_exported_inspection_comes_back_as_it_was(shared: Client, own: str) -> None:
    original = own
    shared.tag(original, frame=10, pixel=[127.5, 79.5], code="BAB", char1="B", char2="A")
    shared.tag(original, frame=35, code="BAC", severity=5, remark="Größe")
    shared.put(
        f"/api/inspections/{original}/corrections",
        json={"zero": {"frame": 2, "offset_m": 0.25}, "remark": "checked"},
    )
    content = shared.get(f"/api/inspections/{original}/exports/json").content
    back = added(shared, content)
    was, now = (shared.inspection(it) for it in (original, back))
    for name in ("distance_m", "distance_u95_m", "revision", "header", "rig", "corrected"):
        assert now[name] == was[name], name
    for one, other in zip(observations(shared, original), observations(shared, back), strict=True):
        for name in ("frame", "pixel", "code", "distance_m", "distance_u95_m", "clock", "remark"):
            assert one[name] == other[name], name
    again = shared.get(f"/api/inspections/{back}/exports/json").json()
    first = json.loads(content)
    for part in ("tags", "track", "sightings", "corrections", "events"):
        assert again[part] == first[part], part
    (newest, *_) = shared.get(f"/api/inspections/{back}/events").json()["events"]
    assert (newest["action"], newest["remark"]) == ("imported", "Imported from old survey.txt.")


def test_a_code_pack_that_is_not_here_is_reported_and_left_out(
    shared: Client, imported: str
) -> None:
    content = json.loads(shared.get(f"/api/inspections/{imported}/exports/json").content)
    content["inspection"]["header"]["code_pack"] = "f" * 32
    answer = send(shared, json.dumps(content).encode()).json()
    assert "code_pack" not in answer["inspections"][0]["header"]
    assert any("no code pack" in line for line in answer["warnings"])


def test_a_file_of_which_one_survey_cannot_be_stored_leaves_none(tmp_path: Path) -> None:
    text = b"#B01=AAA;AAB;AAF\nC;N1;N2\n#C=I;A\n0;BCD\n9;BCE\n#Z\n" * 60
    with small_disk(tmp_path / "disk") as disk, serving(disk.place / "data") as client:
        disk.fill(leaving=2**19)
        there = added(client)  # so there is room for some
        assert_error(send(client, text), 507, "disk_full")
        assert [path.name for path in (client.data / "inspections").iterdir()] == [there]
        listed = client.get("/api/inspections").json()["inspections"]
        assert [inspection["id"] for inspection in listed] == [there]
        disk.make_room()
        assert len(send(client, text).json()["inspections"]) == 60


def test_other_files_are_refused_with_a_sentence(shared: Client, is_long: bool) -> None:
    before = len(shared.get("/api/inspections").json()["inspections"])
    assert send(shared, b"").status_code == 422
    others = (b"hello", b"<?xml version='1.0'?><DATA/>", b"SQLite format 3\0", b"#B01=A")
    for content in others if is_long else others[:1]:
        assert_error(send(shared, content), 422, "invalid_import")
    assert len(shared.get("/api/inspections").json()["inspections"]) == before


def test_warnings_and_what_could_not_be_read_are_in_the_language_that_is_asked_for(
    shared: Client,
) -> None:
    def sent(text: bytes) -> Any:
        query = {"filename": "alt.txt", "lang": "de"}
        return shared.post("/api/imports", params=query, content=text)

    odd = TEXT.replace(b"#Z\r\n", b"nowhere;;BAC;A;;;;;;;;;\r\n#Z\r\n")
    (warning,) = sent(odd).json()["warnings"]
    assert warning == (
        "Zeile 22: Aus 'nowhere' ist keine Station zu lesen; die Feststellung entfällt."
    )
    refused = assert_error(sent(b"#B01=AAA\n"), 422, "invalid_import")
    assert "Zeile 1:" in refused
    unknown = shared.post("/api/imports", params={"filename": "a", "lang": "xx"}, content=TEXT)
    assert_error(unknown, 422, "invalid_request")


def test_a_file_may_be_larger_than_other_bodies_but_not_endless(shared: Client) -> None:
    padding = b"\n" * (2 * 2**20)
    assert send(shared, TEXT + padding).status_code == 201
    assert_error(send(shared, bytes(65 * 2**20)), 413, "body_too_large")
