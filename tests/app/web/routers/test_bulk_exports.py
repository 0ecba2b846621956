"""Reports of many inspections as one archive."""

from __future__ import annotations

import csv
import io
import threading
import zipfile
from dataclasses import replace
from typing import Any

import pytest
from builders import Client, assert_error, wait_until

from app.reports.formats import FORMATS
from app.reports.report import Report, Written

NOBODY = 32 * "0"


def ended(client: Client, order: str) -> dict[str, Any]:
    def look() -> dict[str, Any] | None:
        found = dict(client.get(f"/api/bulk-exports/{order}").json())
        return found if found["state"] not in ("waiting", "running") else None

    return wait_until(look)


def order(client: Client, inspections: list[str], *formats: str, **wanted: Any) -> str:
    body = {"inspections": inspections, "formats": formats, **wanted}
    answer = client.post("/api/bulk-exports", json=body)
    assert answer.status_code == 202, answer.text
    return str(answer.json()["id"])


def test_every_inspection_has_a_folder_and_what_is_missing_is_named(
    shared: Client, done: str
) -> None:
    made = order(shared, [done, NOBODY, done], "pdf", "geojson", "csv", lang="ms")
    found = ended(shared, made)
    assert (found["state"], found["done"], found["total"]) == ("done", 2, 2)
    assert [(one["inspection_id"], one["format"]) for one in found["not_made"]] == [
        (done, "geojson"),
        (NOBODY, ""),
    ]
    answer = shared.get(f"/api/bulk-exports/{made}/archive")
    assert len(answer.content) == found["size"] == int(answer.headers["Content-Length"])
    archive = zipfile.ZipFile(io.BytesIO(answer.content))
    assert archive.testzip() is None
    here, gone = csv.DictReader(io.StringIO(archive.read("inspections.csv").decode("utf-8-sig")))
    assert here["inspection_id"] == done
    assert gone["not_made"] == "There is no such inspection."
    assert here["not_made"].startswith("geojson: ")
    files = {f"{here['folder']}/{name}" for name in here["files"].split(" ")}
    assert files == set(archive.namelist()) - {"inspections.csv"}
    report = next(name for name in files if name.endswith(".pdf"))
    assert archive.read(report).startswith(b"%PDF-")
    (table,) = files - {report}
    assert archive.read(table) == shared.get(f"/api/inspections/{done}/exports/csv").content


def test_one_file_that_cannot_be_made_costs_no_other(
    shared: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_report: Report) -> Written:
        raise ValueError("a fault of the program")

    monkeypatch.setitem(FORMATS, "m150", replace(FORMATS["m150"], write=broken))  # type: ignore[attr-defined]
    found = ended(shared, order(shared, [done], "m150", "csv"))
    assert found["state"] == "done"
    (missing,) = found["not_made"]
    assert missing["format"] == "m150"
    assert missing["detail"] == "The server could not make this file; its log says why."


def test_an_archive_is_cancelled_while_it_waits_is_made_or_is_there(
    shared: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_writing, may_go_on = threading.Event(), threading.Event()

    def slow(_report: Report) -> Written:
        is_writing.set()
        assert may_go_on.wait(60)
        return Written(b"x")

    monkeypatch.setitem(FORMATS, "json", replace(FORMATS["json"], write=slow))  # type: ignore[attr-defined]
    running, waiting = order(shared, [done, NOBODY], "json"), order(shared, [done], "csv")
    assert is_writing.wait(60)
    body = {"inspections": [done], "formats": ["csv"]}
    assert_error(shared.post("/api/bulk-exports", json=body), 503, "busy")
    for each in (waiting, running):
        assert shared.delete(f"/api/bulk-exports/{each}").status_code == 204
    assert shared.get(f"/api/bulk-exports/{waiting}").json()["state"] == "cancelled"
    may_go_on.set()
    assert ended(shared, running)["state"] == "cancelled"
    made = order(shared, [done], "csv")
    assert ended(shared, made)["state"] == "done"
    assert shared.delete(f"/api/bulk-exports/{made}").status_code == 204
    for each in (running, made):
        answer = shared.get(f"/api/bulk-exports/{each}/archive")
        assert_error(answer, 404, "bulk_export_not_found")


def test_the_next_archive_of_a_person_replaces_the_last(shared: Client, done: str) -> None:
    first = order(shared, [done], "csv")
    assert ended(shared, first)["state"] == "done"
    newest = order(shared, [done], "csv")
    assert_error(shared.get(f"/api/bulk-exports/{first}"), 404, "bulk_export_not_found")
    assert ended(shared, newest)["state"] == "done"
    assert shared.get(f"/api/bulk-exports/{newest}/archive").status_code == 200


def test_an_order_without_inspections_or_formats_is_refused(shared: Client, done: str) -> None:
    for inspections, formats in (([], ["csv"]), ([done], []), ([done], ["docx"]), (["x"], ["csv"])):
        body = {"inspections": inspections, "formats": formats}
        assert_error(shared.post("/api/bulk-exports", json=body), 422, "invalid_request")
