"""What a camera sent faster than it could be tracked."""

from __future__ import annotations

import threading
from itertools import islice
from pathlib import Path

import pytest

from app.jobs.live.waiting import MOST, Captured, Waiting
from app.jobs.track.gaps import between, place_after
from vo_core import Estimate
from vo_core.sources import VideoFile


def row(frame: int, time_s: float, x_mm: float, **other: object) -> Estimate:
    fields = {"sigma_distance_mm": 1.0, "quality": 0.8, "status": "ok"} | other
    fields.setdefault("sigma_registration_mm", fields["sigma_distance_mm"])
    return Estimate(
        frame=frame, time_s=time_s, x_mm=x_mm, y_mm=0.0, yaw_deg=0.0, distance_mm=x_mm, **fields
    )  # type: ignore[arg-type]


def test_skipped_frames_lie_between_their_neighbours_in_time_and_are_less_certain() -> None:
    before, after = row(3, 1.0, 10.0), row(6, 1.3, 40.0, sigma_distance_mm=2.0)
    found = list(between(before, after, [(4, 1.1), (5, 1.25)]))
    assert [each.frame for each in found] == [4, 5]
    assert [each.x_mm for each in found] == pytest.approx([20.0, 35.0])
    assert [each.distance_mm for each in found] == pytest.approx([20.0, 35.0])
    assert {each.status for each in found} == {"weak"}
    assert all(each.sigma_distance_mm > 2.0 for each in found)
    # 500 mm/s^2 for half of 0.1 s times 0.2 s, beside the 2 mm of the neighbour
    assert found[0].sigma_distance_mm == pytest.approx((2**2 + 5**2) ** 0.5)


def test_a_skipped_frame_next_to_a_lost_one_is_lost() -> None:
    (found,) = between(row(0, 0.0, 0.0), row(2, 0.2, 9.0, status="lost"), [(1, 0.1)])
    assert found.status == "lost"


def test_where_a_robot_that_was_moved_goes_on_is_unknown_and_where_it_stood_still_is_known() -> (
    None
):
    last = row(3, 1.0, 10.0)
    assert place_after(last, "moved", 2.0).sigma_distance_mm > 9_000
    stood = place_after(last, "stood_still", 2.0)
    assert (stood.distance_mm, stood.sigma_distance_mm) == pytest.approx((10.0, 1.0), abs=1)


@pytest.fixture
def captured(clip: Path) -> list[Captured]:
    with VideoFile(clip) as video:
        return [Captured(frame, frame.t_s) for frame in islice(video, 12)]


def test_the_oldest_waiting_frame_goes_and_the_next_one_says_so(captured: list[Captured]) -> None:
    waiting = Waiting(is_patient=False)
    for each in captured[:8]:
        waiting.add(each)
    first = waiting.take(0)
    assert first is not None
    assert first.frame.index == 0, "the track begins with the first frame of all"
    assert first.skipped == []
    for each in captured[8:]:
        waiting.add(each)
    waiting.close()
    taken = []
    while not waiting.is_over:
        found = waiting.take(0)
        assert found is not None
        taken += [number for number, _ in found.skipped] + [found.frame.index]
    assert taken == list(range(1, 12)), "every frame is tracked or reported as skipped, in order"
    assert waiting.dropped == 12 - 1 - MOST


def test_a_patient_queue_leaves_nothing_out(captured: list[Captured]) -> None:
    waiting = Waiting(is_patient=True)

    def fill() -> None:
        for each in captured:
            waiting.add(each)
        waiting.close()

    thread = threading.Thread(target=fill)
    thread.start()
    taken = []
    while not waiting.is_over:
        found = waiting.take(5)
        if found is not None:
            assert found.skipped == []
            taken.append(found.frame.index)
    thread.join()
    assert taken == list(range(12))
