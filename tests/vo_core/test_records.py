"""What is kept of each frame beside a state that is saved again and again."""

from __future__ import annotations

import pickle

import pytest

from vo_core import records
from vo_core.records import Records


def with_rows(count: int) -> Records:
    found = Records([("frame", "i8"), ("x_mm", "f4")])
    for n in range(count):
        found.append((n, n / 2))
    return found


def kept_of(content: bytes, news: tuple[int, bytes]) -> bytes:
    return content[: news[0]] + news[1]


def test_a_saved_state_grows_no_more_and_gets_back_what_is_kept_elsewhere() -> None:
    found = with_rows(3)
    kept = kept_of(b"", found.drained())
    found.append((3, 1.5))
    kept = kept_of(kept, found.drained())
    state = pickle.dumps(found)
    assert len(state) < len(pickle.dumps(with_rows(0))) + 12, "shorter than a row more"
    loaded = pickle.loads(state)  # noqa: S301
    loaded.restore(kept)
    for each in (found, loaded):
        each.append((4, 2.0))
        assert each.rows["x_mm"].tolist() == [0, 0.5, 1, 1.5, 2]
        assert each.drained()[0] == len(kept), "only what is new"


def test_rows_that_were_changed_are_kept_anew() -> None:
    found = with_rows(3)
    kept = kept_of(b"", found.drained())
    found.rows["x_mm"] += 1
    found.changed()
    kept = kept_of(kept, found.drained())
    loaded = with_rows(0)
    loaded.restore(kept)
    assert loaded.rows["x_mm"].tolist() == [1, 1.5, 2]


def test_a_run_that_is_too_long_keeps_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(records, "MOST_BYTES", 30)
    found = with_rows(3)
    assert len(found) == 3
    found.drained()
    found.append((3, 1.5))
    assert (len(found), found.drained()) == (0, (0, b""))
    loaded = pickle.loads(pickle.dumps(found))  # noqa: S301
    loaded.restore(b"what was kept before")
    assert len(loaded) == 0
