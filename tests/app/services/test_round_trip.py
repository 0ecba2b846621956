"""Export, import, export: the same but for what belongs to the import itself."""

from __future__ import annotations

import json
import uuid
from pathlib import Path
from typing import Any

import pytest
from builders import Client, wait_until
from reports import report

from app.reports.exchange import en13508


def exported(client: Client, inspection_id: str) -> Any:
    return client.get(f"/api/inspections/{inspection_id}/exports/json").json()


def imported(client: Client, content: bytes) -> str:
    answer = client.post("/api/imports", params={"filename": "report.json"}, content=content)
    assert answer.status_code == 201, answer.text
    (inspection,) = answer.json()["inspections"]
    return str(inspection["id"])


def of_the_import(content: Any, *, photos: bool) -> Any:
    """Without its own id, times and record; and without photos, which are not in the file."""
    kept = json.loads(json.dumps(content))
    del kept["exported_at"]
    for name in ("id", "created_at", "finished_at"):
        del kept["inspection"][name]
    del kept["inspection"]["source"]["kind"]
    del kept["inspection"]["video"]["playable"]
    for row in kept["observations"]:
        del row["report_id"]
        if not photos:
            del row["photo_file"], row["photo_sha256"]
    while kept["events"] and kept["events"][-1]["remark"] == "Imported from report.json.":
        kept["events"].pop()
    return kept


@pytest.fixture(scope="module")
def run(shared: Client, clip: Path) -> str:
    """With stretches, a deleted tag, an edit, a correction that moves distances, and photos."""
    inspection_id = shared.inspect(
        clip,
        name="Jalan Besar – 涵洞",
        header={
            "asset_id": "CUL-7", "known_length_m": 0.13, "cleaned": True, "of_another": "=1+1",
            "start_lat": 3.139, "start_lon": 101.6869, "end_lat": 3.14, "end_lon": 101.6869,
        },
    )  # fmt: skip
    shared.wait(inspection_id)
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


def test_an_inspection_comes_back_as_it_was(shared: Client, run: str) -> None:
    first = exported(shared, run)
    again = exported(shared, imported(shared, json.dumps(first).encode()))
    assert len(first["observations"]) == 2
    assert first["observations"][0]["distance_m"] != first["observations"][0]["distance_raw_m"]
    assert again["inspection"]["id"] != run
    assert of_the_import(again, photos=False) == of_the_import(first, photos=False)


def test_what_was_imported_goes_on_unchanged(shared: Client, run: str) -> None:
    second = exported(shared, imported(shared, json.dumps(exported(shared, run)).encode()))
    third = exported(shared, imported(shared, json.dumps(second).encode()))
    assert of_the_import(third, photos=True) == of_the_import(second, photos=True)


def test_a_survey_of_another_program_comes_back_too(shared: Client) -> None:
    survey = imported(shared, en13508.write(report()).content)
    first = exported(shared, survey)
    again = exported(shared, imported(shared, json.dumps(first).encode()))
    assert of_the_import(again, photos=True) == of_the_import(first, photos=True)


@pytest.mark.parametrize("kind", ["csv", "xlsx", "html", "pdf", "zip"])
def test_what_was_imported_is_exported_in_every_form(shared: Client, run: str, kind: str) -> None:
    back = imported(shared, json.dumps(exported(shared, run)).encode())
    answer = shared.get(f"/api/inspections/{back}/exports/{kind}")
    assert answer.status_code == 200, answer.text
    assert len(answer.content) > 500
