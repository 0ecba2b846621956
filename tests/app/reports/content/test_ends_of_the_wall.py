"""What lies at the border of two strips of the unrolled wall, and at its ends."""

from __future__ import annotations

from dataclasses import replace

import pytest
from reports import report

from app.reports.content.wall import Wall, joints_within, places_within, stretches_within
from app.survey.adjustment.joints import FittedJoint
from vo_core.mosaic.mosaic import Layout

BITS = 1.3e-11
STRIPS = ((0.0, 4.0), (4.0, 8.0 - BITS), (8.0 - BITS, 12.0 - BITS))
WALL = Wall((), (0.0, 12.0), (-400.0, 400.0), Layout(1.0, 1000.0, -400.0, 400.0, 1000, 800))


def test_each_observation_is_in_one_strip() -> None:
    made = report(observations=[{"distance_m": m, "code": "BAB"} for m in (0, 4, 8, 12, 12.1)])
    found = [[entry.seq for entry, _ in places_within(made, WALL, span)] for span in STRIPS]
    assert found == [[1], [2], [3, 4]]


@pytest.mark.parametrize("bits", [0.0, BITS, -BITS])
def test_the_joint_at_the_end_of_the_wall_is_in_its_last_strip(bits: float) -> None:
    made = report()
    joint = FittedJoint(8, 1000 * (12.0 + bits), 2.0, None, 0, False)
    adjusted = replace(made.adjusted, sighted=(joint,))
    made = replace(made, corrected=replace(made.corrected, adjusted=adjusted))
    seen = [sum(one.is_seen for one in joints_within(made, span)) for span in STRIPS]
    assert seen == [0, 0, 1]


def test_a_stretch_that_ends_where_a_strip_begins_is_not_in_it() -> None:
    ends = ({"distance_m": 3.0, "cont_role": "start"}, {"distance_m": 8.0, "cont_role": "finish"})
    made = report(observations=[{"code": "BAB", "cont_id": 1} | end for end in ends])
    assert [len(stretches_within(made, span)) for span in STRIPS] == [1, 1, 0]
