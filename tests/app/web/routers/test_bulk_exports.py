"""Reports of many inspections as one archive."""

from __future__ import annotations

import csv
import hashlib
import io
import itertools
import json
import threading
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pypdf
import pytest
from builders import PATIENCE_S, Client, assert_error, wait_until

from app.reports.bundle.verify import verify
from app.reports.formats import FORMATS
from app.reports.report import Report, Written
from app.storage.blobs.blobs import StoredBlob

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
    assert gone["not_made"] == "tiada pemeriksaan sedemikian; mungkin ia telah dipadam."
    assert here["not_made"].startswith("geojson: GeoJSON memerlukan koordinat kedua-dua hujung")
    assert found["not_made"][1]["detail"] == gone["not_made"]
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
    assert missing["detail"] == "the server could not make it; its log says why."


def test_csv_and_json_are_as_for_one_inspection(shared: Client, done: str) -> None:
    made = order(shared, [done, done[::-1]], "csv", "json", csv="german", photos="embedded")
    assert ended(shared, made)["state"] == "done"
    content = shared.get(f"/api/bulk-exports/{made}/archive").content
    archive = zipfile.ZipFile(io.BytesIO(content))
    found = {name.rpartition(".")[2]: name for name in archive.namelist() if "/" in name}
    path = f"/api/inspections/{done}/exports"
    assert archive.read(found["csv"]) == shared.get(f"{path}/csv?csv=german").content
    alone = shared.get(f"{path}/json?photos=embedded").json()
    assert json.loads(archive.read(found["json"])).keys() == alone.keys()
    body = {"inspections": [done], "formats": ["csv"], "csv": "french"}
    assert_error(shared.post("/api/bulk-exports", json=body), 422, "invalid_request")


def test_an_order_that_fails_says_why_in_its_language(shared: Client) -> None:
    found = ended(shared, order(shared, [NOBODY], "delivery", lang="de"))
    assert found["state"] == "failed"
    assert found["detail"] == "diese Inspektion gibt es nicht; vielleicht wurde sie gelöscht."


def test_an_archive_is_cancelled_while_it_waits_is_made_or_is_there(
    shared: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_writing, may_go_on = threading.Event(), threading.Event()

    def slow(_report: Report) -> Written:
        is_writing.set()
        assert may_go_on.wait(PATIENCE_S)
        return Written(b"x")

    monkeypatch.setitem(FORMATS, "json", replace(FORMATS["json"], write=slow))  # type: ignore[attr-defined]
    running, waiting = order(shared, [done, NOBODY], "json"), order(shared, [done], "csv")
    assert is_writing.wait(PATIENCE_S)
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


def test_a_document_alone_is_the_pdf_and_beside_others_is_in_the_archive(
    shared: Client, done: str
) -> None:
    alone = order(shared, [done, NOBODY], document=True, lang="ms")
    found = ended(shared, alone)
    assert (found["state"], found["done"], found["total"]) == ("done", 2, 2)
    assert found["filename"] == "chainage-report.pdf"
    assert [(one["inspection_id"], one["format"]) for one in found["not_made"]] == [
        (NOBODY, "document")
    ]
    answer = shared.get(f"/api/bulk-exports/{alone}/archive")
    assert answer.headers["Content-Type"] == "application/pdf"
    outline = pypdf.PdfReader(io.BytesIO(answer.content)).outline
    titles = [str(one["/Title"]) for one in outline if not isinstance(one, list)]
    assert titles[:4] == ["Kandungan", "Pemeriksaan dan gredannya", "Statistik", "Lakaran pelan"]
    both = order(shared, [done], "csv", document=True)
    assert ended(shared, both)["total"] == 2
    archive = zipfile.ZipFile(io.BytesIO(shared.get(f"/api/bulk-exports/{both}/archive").content))
    assert archive.read("report.pdf").startswith(b"%PDF-1.7")
    assert any(name.endswith(".csv") and "/" in name for name in archive.namelist())


def test_deliveries_of_several_are_one_signed_archive_with_films(
    shared: Client, done: str, tmp_path: Path
) -> None:
    wanted = {"exchange": "isybau", "film": True, "document": True}
    made = order(shared, [done, NOBODY], "delivery", "csv", **wanted)
    found = ended(shared, made)
    assert [(one["inspection_id"], one["format"]) for one in found["not_made"]] == [
        (NOBODY, "document"), (NOBODY, ""),
    ]  # fmt: skip
    path = tmp_path / "deliveries.zip"
    path.write_bytes(shared.get(f"/api/bulk-exports/{made}/archive").content)
    row = shared.get(f"/api/inspections/{done}").json()
    verdict = verify(path)
    assert verdict.is_right
    (inspected,) = verdict.manifest.inspections
    assert (inspected.report_id, inspected.folder[:4]) == (done, "001-")
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        assert {"index.html", "README.txt", "SHA256SUMS", "inspections.csv", "report.pdf"} <= names
        exchange = archive.read("inspections.xml").decode("iso-8859-1")
        name = row["source"]["filename"]
        assert f"<Filmname>{name}</Filmname>" in exchange
        film = archive.read(name)
        assert hashlib.sha256(film).hexdigest() == row["source"]["sha256"]
        sums = archive.read("SHA256SUMS").decode()
        assert hashlib.sha256(archive.read("report.pdf")).hexdigest() in sums


def test_an_order_with_a_large_film_is_cancelled_within_the_film(
    shared: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    has_begun, blocks = threading.Event(), itertools.count()

    def endless(_blob: StoredBlob, _first: int, _length: int) -> Iterator[bytes]:
        for _ in blocks:
            has_begun.set()
            yield b"a film" * 100

    monkeypatch.setattr(StoredBlob, "blocks", endless)
    made = order(shared, [done], "delivery", film=True)
    assert has_begun.wait(PATIENCE_S)
    assert shared.delete(f"/api/bulk-exports/{made}").status_code == 204
    assert ended(shared, made)["state"] == "cancelled"


def test_films_and_clips_are_of_a_limited_number(shared: Client) -> None:
    many = [f"{number:032x}" for number in range(101)]
    for extra in ("film", "clips"):
        body = {"inspections": many, "formats": ["zip"], extra: True}
        assert_error(shared.post("/api/bulk-exports", json=body), 422, "invalid_request")
