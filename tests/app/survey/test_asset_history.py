"""A defect is followed through the surveys of its asset by code, distance and clock position."""

from datetime import date
from itertools import count

import pytest

from app.survey.asset_history import Seen, Survey, traces_of

NUMBERS = count()


def seen(distance_m, severity=None, *, code="BAB", u95_m=0.1, clock=12):
    return Seen("i", f"o{next(NUMBERS)}", code, distance_m, u95_m, clock, severity)


def surveys(*found, directions=None):
    """One survey each year, with these defects."""
    directions = directions or len(found) * ["with_flow"]
    return [
        Survey(date(2019 + year, 5, 1), direction, defects)
        for year, (direction, defects) in enumerate(zip(directions, found, strict=True))
    ]


def test_a_defect_that_grew_is_one_trace_with_its_first_and_last_severity():
    (trace,) = traces_of(surveys([seen(3.0, 2)], [seen(3.15)], [seen(3.05, 4)]))
    assert (trace.first_severity, trace.last_severity, trace.has_grown) == (2, 4, True)
    assert trace.days == [date(2019, 5, 1), date(2020, 5, 1), date(2021, 5, 1)]


@pytest.mark.parametrize(
    ("later", "is_same"),
    [
        (seen(3.2), True),  # the intervals touch
        (seen(3.21), False),
        (seen(3.25, u95_m=0.2), True),
        (seen(3.39, u95_m=None), True),  # another program's distance has no interval
        (seen(3.41, u95_m=None), False),
        (seen(3.0, code="BAC"), False),
        (seen(3.0, clock=1), True),  # across 12
        (seen(3.0, clock=2), False),
        (seen(3.0, clock=None), True),
    ],
)
def test_the_same_defect_has_the_same_code_near_the_same_place(later, is_same):
    assert len(traces_of(surveys([seen(3.0)], [later]))) == (1 if is_same else 2)


def test_of_several_candidates_the_nearest_pairs_match():
    before, after = [seen(3.0), seen(3.1)], [seen(3.02), seen(3.12)]
    first, second = traces_of(surveys(before, after))
    assert first.seen == [before[0], after[0]]
    assert second.seen == [before[1], after[1]]


def test_a_survey_that_missed_a_defect_does_not_end_its_trace():
    (trace,) = traces_of(surveys([seen(3.0, 1)], [], [seen(3.0, 1)]))
    assert len(trace.seen) == 2
    assert not trace.has_grown


def test_two_defects_of_one_survey_are_never_one():
    assert len(traces_of(surveys([seen(3.0), seen(3.0)]))) == 2


def test_surveys_from_the_other_end_are_not_compared():
    directions = ["with_flow", "against_flow", "with_flow"]
    traces = traces_of(surveys([seen(3.0)], [seen(3.0)], [seen(3.0)], directions=directions))
    assert sorted(len(trace.seen) for trace in traces) == [1, 2]


def test_every_defect_is_in_exactly_one_trace_in_the_order_of_distances():
    found = [[seen(0.3 * k + 0.02 * year, k % 5) for k in range(40)] for year in range(5)]
    traces = traces_of(surveys(*found))
    ids = [one.observation_id for trace in traces for one in trace.seen]
    assert sorted(ids) == sorted(one.observation_id for year in found for one in year)
    ends = [trace.seen[-1].distance_m for trace in traces]
    assert ends == sorted(ends)
    assert {len(trace.seen) for trace in traces} == {5}
