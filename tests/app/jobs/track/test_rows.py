"""The rows of a run of several parts, as they come and once more from smoothed estimates."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.jobs.track.rows import RowPlan, Rows
from vo_core import Estimate


def part(*frames: int, drift_mm: float = 0.0) -> list[Estimate]:
    """A drive of 5 mm a frame from 0, of which the measured way is off by so much a frame."""
    first = frames[0]
    ways_mm = [(5.0 + drift_mm) * (frame - first) for frame in frames]
    return [
        Estimate(frame, frame / 25, x_mm, 0.0, 0.0, x_mm, 1.0, 0.9, "ok", 1.0)
        for frame, x_mm in zip(frames, ways_mm, strict=True)
    ]


def run(start: Estimate | None, *parts: list[Estimate]) -> tuple[list[Estimate], RowPlan]:
    """The rows of parts between which the robot stood still, and what they are made of; a frame
    that the numbers pass over was left out.
    """
    placing, plan, rows = Rows(start, "stood_still"), RowPlan(start, "stood_still"), []
    for number, estimates in enumerate(parts):
        if number > 0:
            placing.begin_part("stood_still")
            plan.begin_part("stood_still", parts[number - 1])
        for estimate in estimates:
            known = -1 if placing.last is None else placing.last.frame
            left_out = [(frame, frame / 25) for frame in range(known + 1, estimate.frame)]
            before, own = placing.place(estimate, left_out)
            plan.add(estimate.frame, left_out)
            rows += [*before, own]
    at_end = [(rows[-1].frame + 1, (rows[-1].frame + 1) / 25)]
    plan.leave_out(at_end)
    return rows + placing.leave_out(at_end), plan


@pytest.mark.parametrize("start", [None, replace(part(3)[0], x_mm=40.0, distance_mm=40.0)])
def test_estimates_that_smoothing_leaves_as_they_are_give_the_same_rows(
    start: Estimate | None,
) -> None:
    first = 0 if start is None else 4
    parts = part(first, first + 1, first + 3), part(first + 4, first + 6)
    rows, plan = run(start, *parts)
    assert [row.frame for row in rows] == list(range(first, first + 8))
    assert list(plan.rows(parts[-1])) == rows


def test_a_later_part_begins_where_the_smoothed_part_before_it_ends() -> None:
    live = part(0, 1, 2, 4, drift_mm=1.0), part(5, 6, drift_mm=1.0)
    placing, plan = Rows(None, None), RowPlan(None, None)
    for estimate in live[0]:
        left_out = [(3, 3 / 25)] if estimate.frame == 4 else []
        placing.place(estimate, left_out)
        plan.add(estimate.frame, left_out)
    plan.begin_part("stood_still", part(0, 1, 2, 4))
    for estimate in live[1]:
        plan.add(estimate.frame, [])
    rows = list(plan.rows(part(5, 6)))
    assert [row.distance_mm for row in rows] == pytest.approx([0, 5, 10, 15, 20, 20, 25])


def test_a_frame_that_an_earlier_process_has_tracked_keeps_its_row() -> None:
    start = part(3)[0]
    plan = RowPlan(start, None)
    for frame in (3, 4):  # the last known frame is looked at once more
        plan.add(frame, [])
    assert [row.frame for row in plan.rows(part(3, 4))] == [4]


def test_a_run_of_which_a_part_was_too_long_keeps_its_rows() -> None:
    plan = RowPlan(None, None)
    for frame in (0, 1):
        plan.add(frame, [])
    plan.begin_part("stood_still", [])
    plan.add(2, [])
    assert list(plan.rows(part(2))) == []
