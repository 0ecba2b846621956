"""Every field of an observation is in the file, or among its losses, and never both untruly."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import openpyxl
import pytest
from exchange_readers import read_en13508, read_isybau, read_m150, read_ribx
from reports import HEADER, codes, report

from app.reports.formats import FORMATS
from app.reports.report import Photo, Report

Row = Mapping[str, Any]
SHA256 = "cd" * 32

FULL: Mapping[str, Any] = {
    "distance_m": 7.318, "u95_m": 0.037, "raw_m": 7.402, "source": "closure", "to_go_m": 17.282,
    "joint_no": 6, "at_joint": True, "code": "BAB", "char1": "B", "char2": "A", "quant1": 18.25,
    "quant2": 4.5, "clock_from": 9, "clock_to": 11, "cont_id": 7, "cont_role": "start",
    "severity": 4, "remark": "at the mill", "time_s": 61.37, "frame": 1841, "x_m": 7.311,
    "y_m": 0.121, "z_m": 0.434, "lon": 9.0001054, "lat": 51.4525321, "tagged_by": "Olga",
    "photo": Photo("CUL-0041-001.jpg", None, SHA256),
}  # fmt: skip
"""An observation with a value of its own in each field."""


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
    "en13508": lambda content: list(read_en13508(content).rows),
    "ribx": lambda content: list(read_ribx(content).rows),
    "isybau": lambda content: list(read_isybau(content).rows),
    "m150": lambda content: list(read_m150(content).rows),
}  # fmt: skip
TABLES = ("csv", "xlsx", "json", "geojson")
EXCHANGE = tuple(kind for kind in READERS if kind not in TABLES)
each = pytest.mark.parametrize("kind", EXCHANGE)

SHOWN: Mapping[str, tuple[str, ...]] = {
    "distance_m": ("7.32",), "u95_m": ("+/-0.04 m",), "joint_no": ("joint 6",),
    "at_joint": ("A", "1"), "quant1": ("18.25", "quantity 1 18.25"), "quant2": ("4.5", "4.50"),
    "clock_from": ("9", "09"), "cont_id": ("A7", "7"), "cont_role": ("A7", "A"),
    "severity": ("severity 4",), "time_s": ("00:01:01", "00010100"),
    "photo": ("CUL-0041-001.jpg",),
}  # fmt: skip
"""How exchange formats write a field, if not as it is."""
LOST: Mapping[str, str] = {
    "raw_m": "part.raw", "source": "part.basis", "to_go_m": "part.to_go", "frame": "part.numbers",
    "x_m": "part.wall_points", "y_m": "part.wall_points", "z_m": "part.wall_points",
    "lon": "part.places", "lat": "part.places", "tagged_by": "part.numbers",
}  # fmt: skip
"""What the losses of exchange formats call a field."""
COARSE = {
    "part.photo_checksums", "part.rounded_distances", "part.rounded_intervals",
    "part.rounded_times",
}  # fmt: skip


def written(kind: str, made: Report) -> tuple[list[Row], set[str]]:
    """The rows, and the codes of all losses."""
    found = FORMATS[kind].write(made)
    return READERS[kind](b"".join(found.blocks())), codes(found.losses)


def holds(row: Row, name: str, value: Any) -> bool:
    """Whether a row of an exchange format has it, alone or within a remark."""
    shown = SHOWN.get(name, (str(value),))
    texts = [text for text in map(str, row.values()) if text]
    return any(text == one or (len(one) > 2 and one in text) for one in shown for text in texts)


@each
def test_a_field_is_in_an_exchange_file_or_among_its_losses(kind: str) -> None:
    (row,), losses = written(kind, report(None, [FULL]))
    both_or_neither = [
        field for field in FULL if holds(row, field, FULL[field]) == (LOST.get(field) in losses)
    ]
    assert not both_or_neither
    assert losses >= COARSE


@each
def test_what_is_not_there_is_not_said_to_be_lost(kind: str) -> None:
    bare = {
        **dict.fromkeys(FULL), "distance_m": 7.3, "u95_m": 0.04, "time_s": 61.0, "frame": 1830,
        "at_joint": False, "code": "BAB", "tagged_by": "Olga",
    }  # fmt: skip
    empty = replace(report(None, [bare]), name=HEADER["asset_id"])
    _, losses = written(kind, empty)
    never = {"ascii", "one_line", "part.name", "part.corrections", "part.history", "part.joints"}
    never |= COARSE | {*LOST.values()} - {"part.numbers"}
    assert not losses & never
    _, losses = written(kind, replace(empty, entries=()))
    assert "part.numbers" not in losses


@pytest.mark.parametrize("kind", TABLES)
def test_tables_and_maps_have_every_field_as_it_is(kind: str) -> None:
    (row,), _ = written(kind, report(None, [FULL]))
    names = {
        "u95_m": "distance_u95_m", "raw_m": "distance_raw_m", "source": "distance_source",
        "to_go_m": "distance_to_go_m", "time_s": "video_time_s", "photo": "photo_file",
    }  # fmt: skip
    wanted = {**FULL, "photo": FULL["photo"].name}
    if kind == "geojson":
        del wanted["lon"], wanted["lat"]
        assert row["place"]["type"] == "Point"
    found = {field: row[names.get(field, field)] for field in wanted}
    assert {field: type(value)(found[field]) for field, value in wanted.items()} == wanted
    assert row["photo_sha256"] == SHA256


def test_a_text_that_is_changed_is_said_so_only_then() -> None:
    said = {
        "csv": {"apostrophe", "illegible"}, "xlsx": {"illegible", "line_ends"},
        "geojson": {"one_line"}, "en13508": {"one_line"}, "m150": {"one_line"},
    }  # fmt: skip
    for kind, changes in said.items():
        _, odd = written(kind, report(None, [{**FULL, "remark": "=1\r\n\x07"}]))
        _, plain = written(kind, report(None, [{**FULL, "remark": "plain – 涵洞"}]))
        assert (changes <= odd, changes & plain) == (True, set()), kind


@pytest.mark.parametrize("kind", READERS)
def test_quantities_of_a_remark_are_not_lost(kind: str) -> None:
    made = report(None, [{**FULL, "code": "BDB", "char1": None, "char2": None}])
    (row,), _ = written(kind, made)
    assert holds(row, "quant1", 18.25)
    assert holds(row, "quant2", 4.5)


@each
def test_half_a_sector_and_a_time_without_a_film_are_reported(kind: str) -> None:
    half = {**FULL, "clock_from": None, "clock_to": 3}
    source = replace(report().source, kind="live", sha256="")
    (row,), losses = written(kind, replace(report(None, [half]), source=source))
    assert {"half_sector 1", "no_time 1"} <= losses
    assert not re.search(r"00:01:01|00010100", str(row))


def test_a_row_without_a_time_is_reported_where_one_must_stand() -> None:
    (row,), losses = written("isybau", report(None, [{**FULL, "time_s": None}]))
    assert row["Timecode"] == "00000000"
    assert "time_is_zero 1" in losses


def test_a_photo_that_is_elsewhere_is_named_and_no_page_is_left_for_it(tmp_path: Path) -> None:
    made = report(None, [FULL])
    assert "CUL-0041-001.jpg" not in FORMATS["html"].write(made).content.decode()
    assert FORMATS["pdf"].write(made).content.startswith(b"%PDF")


def test_a_header_field_of_another_program_does_not_hide_on_the_map() -> None:
    header = {**HEADER, "kind": "brick egg", "length_m": 3.0}
    content = json.loads(FORMATS["geojson"].write(report(header=header)).content)
    run = content["features"][0]["properties"]
    assert (run["kind"], run["header_kind"]) == ("run", "brick egg")
    assert (run["length_m"], run["header_length_m"]) == (24.6, 3.0)
    assert run["asset_id"] == HEADER["asset_id"]


@each
def test_another_name_of_the_film_is_reported(kind: str) -> None:
    source = replace(report().source, filename="Bach 7 (left).mp4")
    losses = FORMATS[kind].write(replace(report(), source=source)).losses
    (renamed,) = [loss.values for loss in losses if loss.key == "film_renamed"]
    assert renamed == {"name": "Bach 7 (left).mp4", "written": "Bach_7_left_.mp4"}
    assert "film_renamed" not in written(kind, report())[1]
