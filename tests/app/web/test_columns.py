"""Columns of numbers as bytes: what a page reads of every frame."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from builders import Client
from hypothesis import given
from hypothesis import strategies as st

from app.survey.adjustment.adjusted_track import SOURCES
from app.web.columns import MEDIA_TYPE, packed
from vo_core.image.health import Health, complained

_COMPLAINTS = tuple(complained(dict.fromkeys(Health.__dataclass_fields__, np.float32(0))))


def head_of(content: bytes) -> dict[str, Any]:
    """The line that describes the columns."""
    return dict(json.loads(content.partition(b"\n")[0]))


def unpacked(content: bytes) -> dict[str, np.ndarray]:
    """Read the bytes as a page does."""
    head, begin = head_of(content), content.index(b"\n") + 1
    assert begin % 8 == 0
    found = {}
    for name, kind in head["columns"]:
        dtype = np.dtype(kind).newbyteorder("<")
        assert begin % dtype.itemsize == 0, "a page could not look at it in place"
        found[name] = np.frombuffer(content, dtype, head["rows"], begin)
        begin += found[name].nbytes
    assert begin == len(content)
    return found


@given(st.lists(st.sampled_from(["float64", "float32", "uint8"]), min_size=1, max_size=6),
       st.integers(0, 9))  # fmt: skip
def test_columns_come_back_as_they_were(kinds: list[str], rows: int) -> None:
    columns = {f"c{n}": np.arange(n, n + rows).astype(kind) for n, kind in enumerate(kinds)}
    content = packed(columns, run="a", total=12)
    assert {"run": "a", "total": 12, "rows": rows}.items() <= head_of(content).items()
    found = unpacked(content)
    assert found.keys() == columns.keys()
    for name, column in columns.items():
        assert found[name].dtype == column.dtype
        assert found[name].tolist() == column.tolist()


def test_columns_of_different_lengths_are_refused() -> None:
    with pytest.raises(ValueError, match="one length"):
        packed({"a": np.zeros(2), "b": np.zeros(3)}, run="a", total=3)


def test_the_track_as_columns_is_the_track_as_json(shared: Client, done: str) -> None:
    path = f"/api/inspections/{done}/track"
    for raw in (False, True):
        answer = shared.get(path, params={"format": "columns", "since": 10, "raw": raw})
        assert answer.headers["content-type"] == MEDIA_TYPE
        found = unpacked(answer.content)
        same = shared.get(path, params={"format": "json", "since": 10, "raw": raw}).json()
        sources = found.pop("source", None)
        assert raw if sources is None else set(sources) == {SOURCES.index("odometry")}
        for name, column in found.items():
            if name == "status":
                assert [("ok", "weak", "lost")[rank] for rank in column] == same["columns"][name]
            else:
                assert column.tolist() == pytest.approx(same["columns"][name], abs=1e-3)
        assert found["time_s"].dtype == np.float64
        unknown = f"/api/inspections/{'0' * 32}/track"
        missing = shared.get(unknown, params={"format": "columns", "raw": raw})
        assert missing.status_code == 404
        assert missing.json()["code"] == "inspection_not_found"


def test_the_health_as_columns_is_the_health_as_json(shared: Client, done: str) -> None:
    path = f"/api/inspections/{done}/health"
    found = unpacked(shared.get(path, params={"format": "columns", "since": 5}).content)
    same = shared.get(path, params={"since": 5}).json()["columns"]
    said = [
        " ".join(name for n, name in enumerate(_COMPLAINTS) if bits >> n & 1)
        for bits in found.pop("complaints")
    ]
    assert said == same["complaints"]
    for name, column in found.items():
        assert column.tolist() == pytest.approx(same[name], abs=1e-3)


def test_columns_name_their_run_and_all_of_its_rows(shared: Client, done: str) -> None:
    frames = shared.inspection(done)["progress"]["frames_done"]
    for name in ("track", "health"):
        heads = [
            head_of(
                shared.get(
                    f"/api/inspections/{done}/{name}", params={"format": "columns", "since": since}
                ).content
            )
            for since in (0, frames - 3, frames + 5)
        ]
        assert [head["rows"] for head in heads] == [frames, 3, 0]
        assert {head["total"] for head in heads} == {frames}
        assert len({head["run"] for head in heads}) == 1
