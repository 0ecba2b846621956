"""The overall condition follows from the worst defect."""

import pytest
from reports import LENGTH_M, report

from app.reports.content.condition import Overall, condition_of, worst_first


def rated(*severities, code="BAC"):
    return report(
        observations=[
            {"distance_m": float(n), "code": code, "severity": severity}
            for n, severity in enumerate(severities)
        ]
    )


@pytest.mark.parametrize(
    ("severities", "overall"),
    [
        ((), Overall.UNKNOWN),
        ((None, None), Overall.UNKNOWN),
        ((0, 1), Overall.EXCELLENT),
        ((1, 3, 2), Overall.FAIR),
        ((4, 1), Overall.POOR),
        ((2, 5, 5), Overall.SEVERE),
    ],
)
def test_the_worst_decides(severities, overall):
    assert condition_of(rated(*severities)).overall is overall


def test_deposits_do_not_count_since_cleaning_removes_them():
    assert condition_of(rated(5, code="BBC")).overall is Overall.UNKNOWN


def test_entries_are_counted_by_severity():
    found = condition_of(rated(5, 3, 3, None))

    assert dict(found.counts) == {0: 0, 1: 0, 2: 0, 3: 2, 4: 0, 5: 1}
    assert found.unrated == 1


def test_the_worst_comes_first_and_those_alike_along_the_pipe():
    assert [one.seq for one in worst_first(rated(3, 5, None, 5, 4))] == [2, 4, 5, 1]


def test_overlapping_stretches_cover_their_length_once():
    roles = ((1, "start", 2.0), (2, "start", 4.0), (1, "finish", 6.0), (2, "finish", 8.0))
    made = report(
        observations=[
            {"distance_m": at, "code": "BAB", "cont_id": number, "cont_role": role}
            for number, role, at in roles
        ]
    )

    assert condition_of(made).stretch_percent == pytest.approx(100 * 6 / LENGTH_M)


def test_a_stretch_is_one_defect_and_as_severe_as_its_worst_part():
    parts = [("start", 2), ("change", 4), ("finish", 3)]
    made = report(
        observations=[
            {"distance_m": float(n), "code": "BAB", "cont_id": 1, "cont_role": role, "severity": s}
            for n, (role, s) in enumerate(parts)
        ]
        + [{"distance_m": 9.0, "code": "BAC", "severity": 4}]
    )
    assert dict(condition_of(made).counts) == {0: 0, 1: 0, 2: 0, 3: 0, 4: 2, 5: 0}
    assert [entry.seq for entry in worst_first(made)] == [2, 4]
    assert [entry.seq for entry in made.defects] == [2, 4]
