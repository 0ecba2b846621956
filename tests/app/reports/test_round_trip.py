"""Export, import, export: the same file, but for when it was made."""

from __future__ import annotations

import json
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from builders import Client, serving, wait_until
from hypothesis import given, settings
from hypothesis import strategies as st
from reports import report
from surveys import Survey, another

from app.imports import any_file
from app.inspections.brought_in.file_reader import FileReader
from app.reports.formats import FORMATS
from app.storage.database.backup import back_up
from app.tracking.pictures.videos import NO_FILM


@pytest.fixture(scope="module", autouse=True)
def read_in_this_process() -> Iterator[None]:
    """Files are read without a child, whose bounds are tested elsewhere."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(FileReader, "read", lambda self, content: any_file.read(content))
        yield


def exported(client: Client, inspection_id: str) -> Any:
    return client.get(f"/api/inspections/{inspection_id}/exports/json").json()


def imported(client: Client, content: bytes) -> str:
    answer = client.post("/api/imports", params={"filename": "report.json"}, content=content)
    assert answer.status_code == 201, answer.text
    (inspection,) = answer.json()["inspections"]
    return str(inspection["id"])


def but_for_ids(content: Any) -> Any:
    """Without what another export, and another inspection of the same server, cannot share."""
    kept = json.loads(json.dumps(content))
    del kept["exported_at"], kept["inspection"]["id"]
    for row in kept["observations"]:
        del row["report_id"]
    return kept


@pytest.fixture(scope="module")
def run(shared: Client, survey: Survey) -> str:
    """With stretches, a deleted tag, an edit, a correction that moves distances, and photos."""
    inspection_id = another(survey, shared)
    header = {
        "asset_id": "CUL-7", "known_length_m": 0.13, "cleaned": True, "of_another": "=1+1",
        "start_lat": 3.139, "start_lon": 101.6869, "end_lat": 3.14, "end_lon": 101.6869,
    }  # fmt: skip
    stated = {"name": "Jalan Besar – 涵洞", "header": header}
    shared.patch(f"/api/inspections/{inspection_id}", json=stated).raise_for_status()
    tag = str(uuid.uuid4())
    shared.tag(inspection_id, frame=35, pixel=[200.25, 100.5], code="BAB", continuous="B1")
    shared.tag(inspection_id, tag, frame=5, code="BAB", char1="B", char2="A", continuous="A1")
    shared.tag(inspection_id, tag, frame=6, code="BAB", char1="B", quant1=2.5, continuous="A1",
               clock_from=11, clock_to=2, severity=4, remark="a\nb")  # fmt: skip
    gone = shared.tag(inspection_id, frame=9).json()["id"]
    path = f"/api/inspections/{inspection_id}"
    shared.delete(f"{path}/observations/{gone}")
    answer = shared.put(
        f"{path}/corrections",
        json={
            "zero": {"frame": 2, "offset_m": 0.05},
            "lengths": [{"first_frame": 0, "last_frame": 39, "length_m": 0.0624, "sigma_mm": 1.0}],
            "joints": {"use": False, "marked": [{"frame": 7, "pixel": [10.0, 20.0]}]},
            "remark": "taped",
        },
    )
    assert answer.status_code == 200, answer.text
    listed = f"{path}/observations"
    wait_until(lambda: all(o["photo"] for o in shared.get(listed).json()["observations"]))
    return inspection_id


def test_another_server_exports_the_same_file(shared: Client, run: str, tmp_path: Path) -> None:
    """Every byte but the moment of the export: id, times, film, photos and history included."""
    first = shared.get(f"/api/inspections/{run}/exports/json")
    with serving(tmp_path) as other:
        back = imported(other, first.content)
        again = other.get(f"/api/inspections/{back}/exports/json")
        for kind in ("en13508", "isybau", "m150", "ribx", "geojson", "csv"):
            path = f"/api/inspections/{run}/exports/{kind}"
            assert other.get(path).content == shared.get(path).content, kind
        history = other.get(f"/api/inspections/{back}/events").json()["events"]
        photo = other.get(f"/api/inspections/{back}/observations").json()["observations"][0]
    at = [line for line in first.text.splitlines() if line.startswith('"exported_at"')]
    lines = [line for line in first.text.splitlines() if line not in at]
    assert [line for line in again.text.splitlines() if "exported_at" not in line] == lines
    assert len(first.json()["observations"]) == 2
    assert first.json()["observations"][0]["photo_sha256"]
    assert first.json()["inspection"]["source"]["kind"] == "upload"
    said = [event["remark"] for event in history if event["action"] == "imported"]
    assert said == ["Imported from report.json."]
    assert (photo["photo"], photo["photo_error"]) == (None, NO_FILM)


def test_an_exchange_file_comes_back_as_it_was(shared: Client, run: str) -> None:
    """Over the API: a survey with a film, then the same one without; formats are tried below it."""
    first = shared.get(f"/api/inspections/{run}/exports/isybau").content
    back = imported(shared, first)
    assert shared.get(f"/api/inspections/{back}/exports/isybau").content == first
    rows = {each: exported(shared, each)["observations"] for each in (run, back)}
    for name in ("code", "char1", "quant1", "clock_from", "clock_to", "cont_id", "severity"):
        assert [row[name] for row in rows[back]] == [row[name] for row in rows[run]], name


def test_places_follow_the_line_of_the_register_in_every_table(shared: Client, run: str) -> None:
    line = [[101.6869, 3.139], [101.6875, 3.1395], [101.6869, 3.14]]
    header = {"known_length_m": 0.13}
    asset = {"header": header, "line": line}
    path = "/api/register/assets/CUL-7"
    answer = shared.put(path, json=asset)
    assert answer.status_code in (200, 201), answer.text
    try:
        features = shared.get(f"/api/inspections/{run}/exports/geojson").json()["features"]
        assert features[0]["geometry"]["coordinates"] == line
        points = [it["geometry"]["coordinates"] for it in features if it["id"][:3] == "obs"]
        assert [[row["lon"], row["lat"]] for row in exported(shared, run)["observations"]] == points
    finally:
        shared.delete(path, headers={"If-Match": shared.get(path).headers["ETag"]})


def test_beside_the_original_it_gets_another_id_only(
    shared: Client, run: str, tmp_path: Path
) -> None:
    first = exported(shared, run)
    assert first["observations"][0]["distance_m"] != first["observations"][0]["distance_raw_m"]
    second = imported(shared, json.dumps(first).encode())
    content = json.dumps(exported(shared, second)).encode()
    third = imported(shared, content)
    assert len({run, second, third}) == 3
    for back in (second, third):
        assert but_for_ids(exported(shared, back)) == but_for_ids(first)
    assert shared.inspection(second)["video"]["playable"] is False
    for kind in ("csv", "xlsx", "html", "pdf", "zip"):
        answer = shared.get(f"/api/inspections/{second}/exports/{kind}")
        assert answer.status_code == 200, answer.text
        assert len(answer.content) > 500, kind
    summary = back_up(shared.data, tmp_path / "all.zip", lambda done, total: None)
    assert summary.missing == (), "what is elsewhere is not missed"
    shared.delete(f"/api/inspections/{second}")
    assert imported(shared, content) != second, "an id that was deleted is not given again"
    tag = exported(shared, third)["tags"][-1]
    assert tag["photo_sha256"]
    for frame in (tag["fields"]["frame"] + 1, tag["fields"]["frame"]):
        shared.tag(third, tag["id"], **{**tag["fields"], "frame": frame})
        assert exported(shared, third)["tags"][-1]["photo_sha256"] is None, "its tag has moved"


def test_a_survey_of_another_program_comes_back_too(shared: Client) -> None:
    survey = imported(shared, FORMATS["en13508"].write(report()).content)
    first = exported(shared, survey)
    again = exported(shared, imported(shared, json.dumps(first).encode()))
    assert but_for_ids(again) == but_for_ids(first)


TEXTS = st.sampled_from(
    ["", " blank ", "Größe ±5 mm", "钢筋 ظاهر – 涵洞 🕳", "=1+1", 'a "b"; c, d', "<b>&amp;</b>",
     "two\nlines\tand more", "ж" * 2000]
)  # fmt: skip
NAMES = TEXTS.filter(str.isprintable).map(lambda text: text[:200])
PIXELS = st.tuples(st.floats(0, 255), st.floats(0, 159)).map(list)
POINTS = st.fixed_dictionaries({"frame": st.integers(0, 30), "pixel": PIXELS})
LETTERS = st.sampled_from(["A", "B", "Z", "XP"])
MEASURES = st.fixed_dictionaries(
    {"kind": st.sampled_from(["length", "area"]),
     "points": st.lists(POINTS, min_size=3, max_size=5)}
)  # fmt: skip
FIELDS = st.fixed_dictionaries(
    {"frame": st.integers(0, 30)},
    optional={
        "pixel": PIXELS,
        "code": st.sampled_from(["BAB", "BCD", "BDC", "XYZ9"]), "char1": LETTERS, "char2": LETTERS,
        "quant1": st.floats(-1e6, 1e6), "quant2": st.integers(0, 100),
        "clock_from": st.integers(1, 12), "clock_to": st.integers(1, 12),
        "severity": st.integers(0, 5), "continuous": st.sampled_from(["A1", "C1", "B1", "A999"]),
        "remark": TEXTS, "at_joint": st.booleans(), "photo_name": NAMES,
        "measures": st.lists(MEASURES, min_size=1, max_size=3),
    },
)  # fmt: skip
HEADERS = st.fixed_dictionaries(
    {},
    optional={
        "asset_id": TEXTS, "start_node": TEXTS, "remarks": TEXTS, "of_another": TEXTS,
        "end_condition": st.just("abandoned"), "abandon_reason": TEXTS,
        "shape": st.just("rectangular"), "width_mm": st.integers(1, 9000),
        "known_length_m": st.floats(0.001, 1000), "cleaned": st.booleans(),
    },
)  # fmt: skip


INITIAL_POSES = st.fixed_dictionaries(
    {name: st.integers(-9000, 9000).map(lambda n: n / 100)
     for name in ("y_mm", "yaw_deg", "z_mm", "pitch_deg", "roll_deg")}
)  # fmt: skip


@settings(max_examples=max(1, settings().max_examples // 4))
@given(data=st.data())
def test_anything_that_was_stated_comes_back(
    shared: Client, whole: Any, data: st.DataObject
) -> None:
    content = json.loads(json.dumps(whole))
    fields = data.draw(st.lists(FIELDS, max_size=5))
    content["inspection"] |= {
        "id": uuid.uuid4().hex,
        "name": data.draw(NAMES.filter(bool)),
        "header": data.draw(HEADERS),
        "status": data.draw(st.sampled_from(["done", "failed", "cancelled"])),
        "revision": data.draw(st.integers(0, 9)),
        "warning": data.draw(TEXTS),
        "error": data.draw(TEXTS),
    }
    content["tags"] = [
        {
            "id": str(uuid.UUID(int=n)), "seq": 2 * n + 1, "fields": one,
            "photo_sha256": data.draw(st.sampled_from([None, "ab" * 32])),
            "created_by": "Ali", "created_at": "2026-09-14T09:42:00+00:00",
            "edited_by": None, "edited_at": None,
        }
        for n, one in enumerate(fields)
    ]  # fmt: skip
    content["stance"] = data.draw(INITIAL_POSES)
    first = exported(shared, imported(shared, json.dumps(content).encode()))
    for tag, one in zip(content["tags"], fields, strict=True):
        if one.get("photo_name"):  # another program's photo, which nobody has seen
            tag["photo_sha256"] = None
    assert [{n: v for n, v in tag.items() if n != "photo"} for tag in first["tags"]] == content[
        "tags"
    ]
    for part in ("inspection", "events", "track", "health", "sightings", "mount_tilt", "stance"):
        assert first[part] == content[part], part
    again = exported(shared, imported(shared, json.dumps(first).encode()))
    assert but_for_ids(again) == but_for_ids(first)


@pytest.fixture(scope="module")
def whole(shared: Client, run: str) -> Any:
    """The export to vary."""
    return exported(shared, run)
