"""A defect is followed through the surveys of its asset by code, distance and clock position."""

from datetime import date
from itertools import count

import numpy as np
import pytest

from app.survey.assets.aligned import AlignedSurveys, Tie
from app.survey.assets.asset_history import Growth, Seen, Survey, changes_of, counted, traces_of

NUMBERS = count()


def seen(distance_m, severity=None, *, code="BAB", u95_m=0.1, clock=12, **more):
    return Seen("i", f"o{next(NUMBERS)}", code, distance_m, u95_m, clock, severity, **more)


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
        (seen(3.24), True),  # the interval of a difference, and the tolerance of a click
        (seen(3.25), False),
        (seen(3.3, u95_m=0.2), True),
        (seen(3.41, u95_m=None), True),  # another program's distance has no interval
        (seen(3.42, u95_m=None), False),
        (seen(3.0, code="BAC"), False),
        (seen(3.0, clock=1), True),  # across 12
        (seen(3.0, clock=2), False),
        (seen(3.0, clock=None), True),
        (seen(3.0, clock=8, clock_to=11), True),
        (seen(3.0, clock=8, clock_to=10), False),
        (seen(3.0, clock=6), False),
        (seen(3.0, role="A"), False),
    ],
)
def test_the_same_defect_has_the_same_code_near_the_same_place(later, is_same):
    assert len(traces_of(surveys([seen(3.0)], [later]))) == (1 if is_same else 2)


def test_from_12_to_12_is_all_round():
    all_round = seen(3.0, clock=12, clock_to=12)
    for clock in range(1, 13):
        assert len(traces_of(surveys([all_round], [seen(3.0, clock=clock)]))) == 1
    assert len(traces_of(surveys([seen(3.0, clock=6)], [all_round]))) == 1


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


def reaching(ends_m, *found, directions=None):
    """Surveys that ended at these distances; None: nobody has looked for defects yet."""
    made = surveys(*found, directions=directions)
    return [
        Survey(one.on, one.direction, one.defects, end_m)
        for one, end_m in zip(made, ends_m, strict=True)
    ]


def only_changes(made):
    (trace,) = traces_of(made)
    return changes_of(trace, made)


@pytest.mark.parametrize(
    ("ends_m", "found", "expected"),
    [
        ([9, 9, 9], [[seen(3.0, 2)], [seen(3.0, 2)], [seen(3.0, 4)]], "first unchanged grown"),
        ([9, 9, 9], [[], [seen(3.0, 2)], [seen(3.0, 1)]], "- new unchanged"),
        ([2, 9, 9], [[], [seen(3.0)], [seen(3.0)]], "- first unchanged"),
        ([9, 9, 9], [[seen(3.0)], [], []], "first gone -"),
        ([9, 9, 9], [[seen(3.0, 2)], [], [seen(3.0, 3)]], "first gone grown"),
        ([9, 2, 9], [[seen(3.0)], [], []], "first - gone"),
        ([9, 3.05, 3.1], [[seen(3.0)], [], []], "first - gone"),  # 3.05 is within its interval
        ([9, None, 9], [[seen(3.0)], [], [seen(3.0)]], "first - unchanged"),
        ([9, 9, 9], [[seen(3.0)], [seen(3.0, 2)], [seen(3.0, 3)]], "first unchanged grown"),
    ],
)
def test_a_survey_shows_a_change_only_of_what_it_covered(ends_m, found, expected):
    changes = only_changes(reaching(ends_m, *found))
    assert " ".join(change or "-" for change in changes) == expected


def test_a_survey_from_the_other_end_shows_nothing_about_a_defect():
    directions = ["with_flow", "against_flow", "with_flow"]
    made = reaching([9, 9, 9], [seen(3.0)], [], [], directions=directions)
    assert only_changes(made) == ["first", None, "gone"]


def test_growth_names_what_has_grown_since_it_was_last_stated():
    width = {"severity": 2, "quant1": 1.5}
    found = [Seen("i", "o", "BAB", 3.0, 0.1, 12, **width | more) for more in (
        {}, {"quant1": None}, {"quant1": 4.0, "severity": None},
    )]  # fmt: skip
    (trace,) = traces_of(surveys(*([one] for one in found)))
    assert trace.growth == Growth("quant1", 1.5, 4.0)


def test_the_changes_of_a_culvert_that_was_made_up_are_found():
    """Each defect is made with the years in which it exists, and the surveys with their ends."""
    rng = np.random.default_rng(16)
    ends_m = [60.0, 25.0, 60.0, 60.0]
    found = [[] for _ in ends_m]
    truth = [dict.fromkeys(("first", "new", "grown", "unchanged", "gone"), 0) for _ in ends_m]
    for n in range(100):
        at_m, begins, ends = 0.5 + 0.5 * n, int(rng.integers(0, 4)), int(rng.integers(1, 5))
        grows_in = int(rng.integers(1, 4))
        reached = [year for year in range(4) if at_m + 0.1 <= ends_m[year]]
        exists = [year for year in reached if begins <= year < max(ends, begins + 1)]
        for year in exists:
            severity = 4 if year >= grows_in else 2
            found[year].append(seen(at_m + rng.uniform(-0.05, 0.05), severity, u95_m=0.1))
            earlier = [before for before in exists if before < year]
            if earlier:
                is_grown = severity == 4 and earlier[-1] < grows_in
                truth[year]["grown" if is_grown else "unchanged"] += 1
            else:
                truth[year]["new" if min(reached) < year else "first"] += 1
        missing = [year for year in reached if exists and year > exists[-1]]
        if missing:
            truth[missing[0]]["gone"] += 1
    made = reaching(ends_m, *found)
    changes = [changes_of(trace, made) for trace in traces_of(made)]
    assert [counted(list(year)) for year in zip(*changes, strict=True)] == truth
    assert min(truth[3][kind] for kind in ("new", "grown", "unchanged", "gone")) > 3


def aligned(*, is_opposite=False, turn_h=0.0):
    """A later survey that counts from 2 m further on, or from the other end of 20 m of wall."""
    earlier_m = [0.0, 20.0]
    later_m = earlier_m[::-1] if is_opposite else [2.0, 22.0]
    ties = [Tie(at, was, 5.0, turn_h) for at, was in zip(later_m, earlier_m, strict=True)]
    return {(0, 1): AlignedSurveys(is_opposite, [ties], 0.15)}


@pytest.mark.parametrize(
    ("later", "is_same"),
    [
        (seen(5.0), True),
        (seen(5.1), True),  # the tolerance of a click
        (seen(5.15), False),  # not the intervals of the distances
        (seen(3.0), False),  # not the distance
        (seen(5.0, clock=2), False),
    ],
)
def test_on_aligned_walls_the_place_counts_and_not_the_distance(later, is_same):
    found = traces_of(surveys([seen(3.0)], [later]), aligned())
    assert len(found) == (1 if is_same else 2)


def test_where_the_alignment_does_not_hold_distances_count():
    assert len(traces_of(surveys([seen(30.0)], [seen(30.1)]), aligned())) == 1


def test_a_camera_that_turned_about_its_axis_sees_other_hours():
    two = surveys([seen(3.0, clock=3)], [seen(5.0, clock=5)])
    assert len(traces_of(two, aligned())) == 2
    assert len(traces_of(two, aligned(turn_h=-2.0))) == 1


def test_on_aligned_walls_a_survey_from_the_other_end_shows_the_same_defect():
    before, after = seen(3.0, 2, clock=8, clock_to=10), seen(17.05, 4, clock=2, clock_to=4)
    two = surveys([before], [after], directions=["with_flow", "against_flow"])
    assert len(traces_of(two)) == 2
    (trace,) = traces_of(two, aligned(is_opposite=True, turn_h=12.0))
    assert changes_of(trace, two) == ["first", "grown"]
