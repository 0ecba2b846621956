"""Where observations, joints and stretches lie on a wall that is cut open, and labels beside it."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reports import report

from app.reports.drawings.cut_pipe import clock_spans
from app.reports.drawings.placement import spread
from app.reports.drawings.seen_wall import (
    Wall,
    joints_within,
    place_of,
    places_within,
    stretches_within,
)
from app.survey.adjustment.joints import FittedJoint
from vo_core.mosaic.layout import Layout

BITS = 1.3e-11
STRIPS = ((0.0, 4.0), (4.0, 8.0 - BITS), (8.0 - BITS, 12.0 - BITS))
WALL = Wall((), (0.0, 12.0), (-400.0, 400.0), Layout(1.0, 1000.0, -400.0, 400.0, 1000, 800))
PLACES = st.lists(st.floats(-50, 350), max_size=25).map(sorted)


@pytest.mark.parametrize(
    ("first", "last", "spans", "hours"),
    [
        (None, None, [], []),
        (6, None, [(0.5, 0.5)], [(0, 0)]),
        (3, None, [(0.75, 0.75)], [(3, 3)]),
        (9, None, [(0.25, 0.25)], [(-3, -3)]),
        (3, 6, [(0.5, 0.75)], [(0, 3)]),
        (9, 12, [(0.0, 0.25)], [(-6, -3)]),
        (12, 3, [(0.75, 1.0)], [(3, 6)]),
        (3, 9, [(0.25, 0.75)], [(-3, 3)]),
        (10, 2, [(0.0, 2 / 12), (10 / 12, 1.0)], [(-6, -4), (4, 6)]),
        (12, 12, [(0.0, 1.0)], [(-6, 6)]),
    ],
)
def test_a_clock_sector_lies_where_the_wall_is_cut_at_the_crown(first, last, spans, hours):
    """As shares of a strip from the left, and as hours from the invert to the right."""
    assert sorted(clock_spans(first, last)) == [pytest.approx(span) for span in spans]
    made = report(observations=[{"distance_m": 1.0, "clock_from": first, "clock_to": last}])
    pipe = made.rig.pipe.model_copy(update={"shape": "circular", "diameter_mm": 900.0})
    made = replace(made, rig=made.rig.model_copy(update={"pipe": pipe}))
    hour_mm = math.pi * 900 / 12
    found = np.array(sorted(place_of(made, made.entries[0]).around_mm)) / hour_mm
    assert found == pytest.approx(np.array(hours, float))


def test_each_observation_is_in_one_strip():
    made = report(observations=[{"distance_m": m, "code": "BAB"} for m in (0, 4, 8, 12, 12.1)])
    found = [[entry.seq for entry, _ in places_within(made, WALL, span)] for span in STRIPS]
    assert found == [[1], [2], [3, 4]]


@pytest.mark.parametrize("bits", [0.0, BITS, -BITS])
def test_the_joint_at_the_end_of_the_wall_is_in_its_last_strip(bits):
    made = report()
    joint = FittedJoint(8, 1000 * (12.0 + bits), 2.0, None, 0, False)
    adjusted = replace(made.adjusted, sighted=(joint,))
    made = replace(made, corrected=replace(made.corrected, adjusted=adjusted))
    seen = [sum(one.is_seen for one in joints_within(made, span)) for span in STRIPS]
    assert seen == [0, 0, 1]


def test_a_stretch_that_ends_where_a_strip_begins_is_not_in_it():
    ends = ({"distance_m": 3.0, "cont_role": "start"}, {"distance_m": 8.0, "cont_role": "finish"})
    made = report(observations=[{"code": "BAB", "cont_id": 1} | end for end in ends])
    assert [len(stretches_within(made, span)) for span in STRIPS] == [1, 1, 0]


@given(PLACES, st.data())
def test_labels_keep_their_order_and_gaps_and_none_could_move_nearer_to_its_place(wanted, data):
    gaps = [data.draw(st.floats(1, 12)) for _ in wanted[1:]]
    places = spread(wanted, gaps, 0, 300)
    assert len(places) == len(wanted)
    assert all(after - before >= gap - 1e-6
               for (before, after), gap in zip(pairwise(places), gaps, strict=True))  # fmt: skip
    around = [-1e9, *places, 1e9]
    for n, target in enumerate(wanted):
        low = max(0, around[n] + (gaps[n - 1] if n else 0))
        high = min(300, around[n + 2] - (gaps[n] if n < len(gaps) else 0))
        assert low - 1e-6 <= places[n] <= high + 1e-6
        best = min(max(target, low), max(low, high))
        # Where labels touch each other, one can only come nearer if its neighbours go away.
        assert abs(places[n] - target) <= abs(best - target) + 1e-6


def test_crowded_labels_share_the_way_to_their_place_and_too_many_are_refused():
    assert spread([50, 50, 50], 10, 0, 100) == [40, 50, 60]
    assert spread([0] * 11, 10, 0, 100) == [10 * n for n in range(11)]
    with pytest.raises(ValueError, match="do not fit"):
        spread([0] * 12, 10, 0, 100)
