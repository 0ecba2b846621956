"""Times in a recording."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from app.jobs.live.clocks import FileClock, StreamClock


def test_arrival_counts_where_the_camera_states_no_time() -> None:
    clock = StreamClock(zero_s=100.0, last_ms=-1)
    times = [clock.time_ms(100 + t, None, is_reordered=False) for t in (0.0, 0.033, 0.07, 0.1)]
    assert times == [0, 33, 70, 100]


def test_pictures_that_were_held_up_do_not_come_a_millisecond_apart() -> None:
    clock = StreamClock(zero_s=0.0, last_ms=-1)
    arrived = [n / 30 for n in range(60)] + [2.5 + n / 1000 for n in range(16)]
    arrived += [2.5 + n / 30 for n in range(1, 60)]
    times = [clock.time_ms(at_s, None, is_reordered=False) for at_s in arrived]
    assert min(b - a for a, b in pairwise(times)) > 5
    assert times[-1] == round(1000 * arrived[-1]), "and are on time again soon"


def test_a_hesitating_network_does_not_show_in_the_times() -> None:
    rng = np.random.default_rng(1)
    clock = StreamClock(zero_s=50.0, last_ms=-1, delay_s=50.0)
    frames = 600
    times = [
        clock.time_ms(50 + n / 30 + max(rng.normal(0.005, 0.01), 0.0), n / 30, is_reordered=False)
        for n in range(frames)
    ]
    steps = [b - a for a, b in pairwise(times)]
    assert 32 <= min(steps) <= max(steps) <= 35


@pytest.mark.parametrize("drift", [-2e-4, 2e-4])
def test_a_camera_whose_clock_is_off_is_followed(drift: float) -> None:
    clock = StreamClock(zero_s=0.0, last_ms=-1)
    hour = 3600 * 10
    last = 0
    for n in range(hour):
        last = clock.time_ms(n / 10, n / 10 * (1 + drift), is_reordered=False)
    assert last == pytest.approx(1000 * (hour - 1) / 10, abs=5)


@pytest.mark.parametrize("jump_s", [5000.0, 1.0, -0.3, -1.9, -5000.0])
def test_a_jump_of_the_cameras_clock_is_no_jump_of_ours(jump_s: float) -> None:
    clock = StreamClock(zero_s=0.0, last_ms=-1)
    times = [
        clock.time_ms(n / 10, n / 10 + (jump_s if n >= 10 else 0), is_reordered=False)
        for n in range(20)
    ]
    assert times == [100 * n for n in range(20)]


def test_times_after_a_drop_out_are_later_than_all_before() -> None:
    clock = StreamClock(zero_s=0.0, last_ms=5000)
    assert clock.time_ms(4.9, None, is_reordered=False) > 5000
    assert clock.time_ms(8.0, None, is_reordered=False) == 8000


def test_a_picture_that_is_shown_before_earlier_ones_keeps_its_place() -> None:
    clock = StreamClock(zero_s=0.0, last_ms=-1, delay_s=0.2)
    stated = [0.0, 0.12, 0.04, 0.08, 0.24, 0.16]
    times = [clock.time_ms(0.3 + n / 25, pts, is_reordered=True) for n, pts in enumerate(stated)]
    assert times == pytest.approx([200, 320, 240, 280, 440, 360], abs=2)


def test_a_growing_file_keeps_its_own_times() -> None:
    clock = FileClock()
    assert [clock.time_ms(0.0, pts, is_reordered=False) for pts in (1.4, 1.44, 2.0)] == [0, 40, 600]


def test_a_growing_file_goes_on_after_a_pause_where_its_times_begin_anew() -> None:
    clock = FileClock()
    stated = [5.0, 5.12, 5.04, 5.08, 0.0, 0.12, 0.04, None]
    times = [clock.time_ms(0.0, pts, is_reordered=True) for pts in stated]
    assert times == [0, 120, 40, 80, 10_120, 10_240, 10_160, 10_240]


def test_a_camera_that_sends_pictures_out_of_order_may_be_set_back_too() -> None:
    clock = StreamClock(zero_s=0.0, last_ms=-1)
    times = [
        clock.time_ms(n / 25, n / 25 - (1.9 if n >= 50 else 0), is_reordered=True)
        for n in range(100)
    ]
    assert sum(b <= a for a, b in pairwise(times)) <= 1, "the time that it was set back"
    assert times[-1] == 1000 * 99 // 25
