"""Every field of an observation in tables and maps."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping
from typing import Any

import openpyxl
import pytest
from exchange_files import FULL_OBSERVATION
from reports import HEADER, codes, report

from app.reports.formats import FORMATS

Row = Mapping[str, Any]


def in_csv(content: bytes) -> list[Row]:
    return list(csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline="")))


def in_xlsx(content: bytes) -> list[Row]:
    head, *rows = openpyxl.load_workbook(io.BytesIO(content))["observations"].values
    return [dict(zip(map(str, head), row, strict=True)) for row in rows]


def in_json(content: bytes) -> list[Row]:
    return list(json.loads(content)["observations"])


def in_geojson(content: bytes) -> list[Row]:
    points = [it for it in json.loads(content)["features"] if it["id"].startswith("obs")]
    return [it["properties"] | {"place": it["geometry"]} for it in points]


READERS: Mapping[str, Callable[[bytes], list[Row]]] = {
    "csv": in_csv, "xlsx": in_xlsx, "json": in_json, "geojson": in_geojson,
}  # fmt: skip


def written(kind: str, observation: Row) -> tuple[Row, set[str]]:
    """The row, and the codes of all losses."""
    found = FORMATS[kind].write(report(None, [observation]))
    (row,) = READERS[kind](b"".join(found.blocks()))
    return row, codes(found.losses)


@pytest.mark.parametrize("kind", READERS)
def test_tables_and_maps_have_every_field_as_it_is(kind: str) -> None:
    row, losses = written(kind, FULL_OBSERVATION)
    names = {
        "u95_m": "distance_u95_m", "raw_m": "distance_raw_m", "source": "distance_source",
        "to_go_m": "distance_to_go_m", "time_s": "video_time_s", "photo": "photo_file",
    }  # fmt: skip
    photo = FULL_OBSERVATION["photo"]
    wanted = {**FULL_OBSERVATION, "photo": photo.name}
    if kind == "geojson":
        del wanted["lon"], wanted["lat"]
        assert row["place"]["type"] == "Point"
    found = {field: row[names.get(field, field)] for field in wanted}
    assert {field: type(value)(found[field]) for field, value in wanted.items()} == wanted
    assert row["photo_sha256"] == photo.sha256
    left_out = {"csv": {"table_only"}, "geojson": {"only_observations"}}
    assert losses >= left_out.get(kind, set())


def test_a_text_that_is_changed_is_said_so_only_then() -> None:
    said = {
        "csv": {"apostrophe", "illegible"}, "xlsx": {"illegible", "line_ends"},
        "geojson": {"one_line"},
    }  # fmt: skip
    for kind, changes in said.items():
        _, odd = written(kind, {**FULL_OBSERVATION, "remark": "=1\r\n\x07"})
        _, plain = written(kind, {**FULL_OBSERVATION, "remark": "plain – 涵洞"})
        assert (changes <= odd, changes & plain) == (True, set()), kind


def test_a_photo_that_is_elsewhere_is_named_and_no_page_is_left_for_it() -> None:
    made = report(None, [FULL_OBSERVATION])
    assert "CUL-0041-001.jpg" not in FORMATS["html"].write(made).content.decode()
    assert FORMATS["pdf"].write(made).content.startswith(b"%PDF")


def test_a_header_field_of_another_program_does_not_hide_on_the_map() -> None:
    header = {**HEADER, "kind": "brick egg", "length_m": 3.0}
    content = json.loads(FORMATS["geojson"].write(report(header=header)).content)
    run = content["features"][0]["properties"]
    assert (run["kind"], run["header_kind"]) == ("run", "brick egg")
    assert (run["length_m"], run["header_length_m"]) == (24.6, 3.0)
    assert run["asset_id"] == HEADER["asset_id"]
