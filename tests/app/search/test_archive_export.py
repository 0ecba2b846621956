"""The export of everything says what the API says, in tables that other programs read."""

from __future__ import annotations

import io
import json
import sys
import zipfile
from collections.abc import Callable, Iterator
from datetime import date, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from builders import Client, assert_error, serving, wait_until
from surveys import Survey

from app.search.export import ArchiveExport
from app.search.tables import TABLES, TRACKS, Columns, Table
from vo_core.track import COLUMNS

DOCS = Path(__file__).parents[3] / "docs" / "archive_export.md"
TYPED = '#ENC=UTF-8\n#LANG=en\n#DEC=.\n#SEP=;\n#QUO="\n#B01=AAA;AAB\nP1;P2\n#C=I;A\n1.5;BAB\n#Z\n'
"""A survey in the text form of EN 13508-2."""
TAGS = [f"7d444840-9dc0-4d2a-8a6a-00000000000{n}" for n in range(3)]


@pytest.fixture(scope="module")
def archive(survey: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A server with a film, and with a survey of another program's that has none."""
    with serving(survey.copied_to(tmp_path_factory.mktemp("archive"))) as client:
        header = {"asset_id": "CUL-1", "project": "Straße 7", "date": "2024-03-02"}
        path = f"/api/inspections/{survey.id}"
        client.patch(path, json={"name": "=1+1 é", "header": header}).raise_for_status()
        client.tag(
            survey.id, TAGS[1], frame=20, pixel=[60.0, 90.0], code="BAB", char1="B", quant1=2.5,
            severity=4, clock_from=11, clock_to=1, remark="wet, “here”\nand there",
        ).raise_for_status()  # fmt: skip
        client.tag(survey.id, TAGS[2], frame=5).raise_for_status()
        path = "/api/imports"
        client.post(path, params={"filename": "a.txt"}, content=TYPED).raise_for_status()
        wait_until(lambda: client.get("/api/archive/defects").json()["pending"] == 0)
        yield client


def members(content: bytes) -> tuple[dict[str, bytes], dict[str, Any]]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.testzip() is None
        files = {name: archive.read(name) for name in archive.namelist()}
    return files, json.loads(files.pop("schema.json"))


def exported(client: Client, **query: Any) -> tuple[dict[str, bytes], dict[str, Any]]:
    answer = client.get("/api/archive/export", params=query)
    assert answer.status_code == 200, answer.text
    assert answer.headers["Content-Type"] == "application/zip"
    return members(answer.content)


def rows_of(files: dict[str, bytes], name: str) -> list[dict[str, Any]]:
    """The rows of a table in either format, with days and times as JSON has them."""
    if f"{name}.jsonl" in files:
        return [json.loads(line) for line in files[f"{name}.jsonl"].decode().splitlines()]
    rows = pq.read_table(io.BytesIO(files[f"{name}.parquet"])).to_pylist()
    return [{key: as_json(value) for key, value in row.items()} for row in rows]


def instant(text: str) -> datetime:
    return datetime.fromisoformat(text)


def as_json(value: Any) -> Any:
    return value.isoformat() if isinstance(value, date | datetime) else value


@pytest.mark.parametrize("kind", ["parquet", "json"])
def test_the_tables_say_what_the_api_says(archive: Client, kind: str) -> None:
    files, schema = exported(archive, format=kind, tracks=1)

    defects = rows_of(files, "defects")
    listed = archive.get("/api/archive/defects", params={"limit": 500}).json()["defects"]
    assert len(defects) == len(listed) == 3
    by_id = {row["observation_id"]: row for row in defects}
    for shown in listed:
        row = by_id[shown["observation_id"]]
        same = shown.keys() - {"created_at", "labels"}
        assert {name: row[name] for name in same} == {name: shown[name] for name in same}
        assert datetime.fromisoformat(row["created_at"]) == datetime.fromisoformat(
            shown["created_at"]
        )
    assert (by_id[TAGS[1]]["quant1"], by_id[TAGS[1]]["unit1"]) == (2.5, "mm")

    inspections = {row["inspection_id"]: row for row in rows_of(files, "inspections")}
    for shown in archive.get("/api/inspections").json()["inspections"]:
        row = inspections[shown["id"]]
        assert (row["name"], row["status"]) == (shown["name"], shown["status"])
        assert row["distance_m"] == shown["distance_m"]
    (film,) = rows_of(files, "quality")
    (shown,) = archive.get("/api/archive/quality").json()["films"]
    assert film["problems"].split() == shown["problems"]
    assert {name: film[name] for name in film.keys() & shown.keys() - {"problems"}} == {
        name: shown[name] for name in film.keys() & shown.keys() - {"problems"}
    }
    track = rows_of(files, "tracks")
    told = archive.get(
        f"/api/inspections/{film['inspection_id']}/track", params={"format": "json"}
    ).json()["columns"]
    assert len(track) == film["frames"] == 40
    for name in ("frame", "status", "time_s", "distance_mm", "distance_raw_mm", "yaw_deg"):
        ours, theirs = [row[name] for row in track], told[name]
        if name == "status":
            assert ours == theirs
        else:
            np.testing.assert_allclose(ours, theirs, atol=1e-4)

    assert (schema["schema"], schema["pending"]) == ("chainage-archive/1", 0)
    assert [table["name"] for table in schema["tables"]] == [table.name for table in TABLES]
    assert {table["file"]: table["rows"] for table in schema["tables"]} == {
        name: len(rows_of(files, name.partition(".")[0])) for name in files
    }


def test_columns_have_the_kinds_and_units_that_are_stated(archive: Client) -> None:
    files, schema = exported(archive, format="parquet")
    kinds = {"string": "text", "int64": "integer", "double": "number", "bool": "boolean",
             "date32[day]": "day", "timestamp[us, tz=UTC]": "time"}  # fmt: skip
    for table in schema["tables"]:
        found = pq.read_schema(io.BytesIO(files[table["file"]]))
        assert found.metadata[b"schema"] == b"chainage-archive/1"
        stated = [(c["name"], c["kind"], c["unit"] or "", c["meaning"]) for c in table["columns"]]
        assert stated == [
            (
                field.name, kinds[str(field.type)], field.metadata[b"unit"].decode(),
                field.metadata[b"meaning"].decode(),
            )
            for field in found
        ]  # fmt: skip
    assert "tracks.parquet" not in files


def test_each_column_has_a_line_in_the_docs() -> None:
    page = DOCS.read_text("utf-8")
    for table in TABLES:
        _, _, section = page.partition(f"\n## {table.name}\n")
        lines = [line for line in section.partition("\n## ")[0].splitlines() if line[:3] == "| `"]
        assert lines == [
            f"| `{column.name}` | {column.kind} | {column.unit or ''} | {column.meaning} |"
            for column in table.columns
        ]


def test_a_track_has_all_its_columns() -> None:
    assert [column.name for column in TRACKS.columns[1:-1]] == list(COLUMNS)


def test_without_pyarrow_a_sentence_names_what_to_install(
    archive: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "app.search.parquet", raising=False)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    answer = archive.get("/api/archive/export", params={"format": "parquet"})
    assert "pip install 'chainage[archive]'" in assert_error(answer, 409, "export_not_available")
    assert exported(archive, format="json")[1]["pending"] == 0


def test_it_is_sent_while_it_is_made() -> None:
    """Memory is bounded: no more waits to be sent than one step has read."""
    endless = Endless()
    blocks = ArchiveExport(endless, endless).blocks("parquet", with_tracks=False)  # type: ignore[arg-type]
    sent = sum(len(next(blocks)) for _ in range(20))
    assert endless.asked <= 22
    assert sent > 15 * Endless.ROWS * Endless.NAME


class Endless:
    """An index whose rows never end, with random names, which no method compresses."""

    ROWS, NAME = 200, 500

    def __init__(self) -> None:
        self.asked = 0

    def pending(self) -> int:
        return 0

    def of(self, table: Table) -> Iterator[Columns]:
        chance = np.random.default_rng(1)
        while True:
            self.asked += 1
            names = [chance.bytes(self.NAME).hex() for _ in range(self.ROWS)]
            yield {column.name: self.ROWS * [None] for column in table.columns} | {"name": names}


def test_the_command_indexes_what_is_not_indexed_and_writes_the_same(
    survey: Survey, tmp_path: Path, chainage: Callable[..., Any]
) -> None:
    data, out = survey.copied_to(tmp_path / "data"), tmp_path / "all.zip"
    done = chainage("archive", "export", out, "--format", "parquet", "--data", data)
    assert done.code == 0, done.err
    assert "warning" not in done.err
    files, schema = members(out.read_bytes())
    assert schema["pending"] == 0
    (inspection,) = rows_of(files, "inspections")
    assert (inspection["inspection_id"], inspection["status"]) == (survey.id, "done")
    assert rows_of(files, "defects") == []
    assert chainage("archive", "export", tmp_path, "--data", data).code == 2
