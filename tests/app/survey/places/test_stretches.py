"""Which stretches there are and which of them are open."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.survey.observations.records import Observation
from app.survey.observations.tag import StatedTag
from app.survey.places.stretches import next_stretch_number, open_stretches, stretches


def rows(*marks: str | None) -> list[Observation]:
    return [
        Observation(
            inspection_id="i",
            id=str(n),
            seq=n + 1,
            tag=StatedTag(frame=n, continuous=mark),
            created_at=datetime(2026, 9, 14, tzinfo=UTC),
            created_by="Ali",
        )
        for n, mark in enumerate(marks)
    ]


@pytest.mark.parametrize(
    ("marks", "expected"),
    [
        ((), []),
        ((None, None), []),
        (("A1", "B1"), []),
        (("B1", "A1"), []),  # the outbox of a browser may send the finish first
        (("A2", "C2", "A1", "B1"), ["A2"]),
        (("A10", "A9"), ["A9", "A10"]),
        (("B3", "C3"), []),
    ],
)
def test_a_start_without_a_finish_is_open(marks: tuple[str, ...], expected: list[str]) -> None:
    assert open_stretches(rows(*marks)) == expected


MARKS = st.lists(st.none() | st.from_regex(r"[ABC][1-9][0-9]?", fullmatch=True))


@given(MARKS)
def test_the_next_number_is_above_every_used_one(marks: list[str | None]) -> None:
    number = next_stretch_number([mark for mark in marks if mark is not None])
    assert number >= 1
    assert all(mark is None or int(mark[1:]) < number for mark in marks)


@given(MARKS)
def test_every_marked_observation_is_in_one_stretch(marks: list[str | None]) -> None:
    found = stretches(rows(*marks))
    assert [stretch.number for stretch in found] == sorted({int(m[1:]) for m in marks if m})
    members = [row for s in found for row in (*s.starts, *s.changes, *s.finishes)]
    assert sorted(row.id for row in members) == sorted(
        str(n) for n, mark in enumerate(marks) if mark
    )
