"""Reports of many inspections as one archive."""

from __future__ import annotations

import csv
import io
import zipfile
from typing import Any

from builders import Client, assert_error, wait_until

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


def test_a_cancelled_archive_is_gone(shared: Client, done: str) -> None:
    made = order(shared, [done], "csv")
    ended(shared, made)
    assert shared.delete(f"/api/bulk-exports/{made}").status_code == 204
    assert shared.get(f"/api/bulk-exports/{made}").json()["state"] == "cancelled"
    assert_error(shared.get(f"/api/bulk-exports/{made}/archive"), 404, "bulk_export_not_found")


def test_the_oldest_archives_make_room(shared: Client, done: str) -> None:
    first, *others = [order(shared, [done], "csv") for _ in range(8)]
    for each in (first, *others):
        assert ended(shared, each)["state"] == "done"
    newest = order(shared, [done], "csv")
    assert_error(shared.get(f"/api/bulk-exports/{first}"), 404, "bulk_export_not_found")
    assert ended(shared, newest)["state"] == "done"
    assert shared.get(f"/api/bulk-exports/{others[-1]}/archive").status_code == 200


def test_an_order_without_inspections_or_formats_is_refused(shared: Client, done: str) -> None:
    for inspections, formats in (([], ["csv"]), ([done], []), ([done], ["docx"]), (["x"], ["csv"])):
        body = {"inspections": inspections, "formats": formats}
        assert_error(shared.post("/api/bulk-exports", json=body), 422, "invalid_request")
