"""Times in a recording."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from app.jobs.clocks import FileClock, StreamClock


def test_arrival_counts_where_the_camera_states_no_time() -> None:
    clock = StreamClock(zero_s=100.0, last_ms=-1)
    assert [clock.time_ms(100 + t, None) for t in (0.0, 0.033, 0.07, 0.1)] == [0, 33, 70, 100]


def test_pictures_that_were_held_up_do_not_come_a_millisecond_apart() -> None:
    clock = StreamClock(zero_s=0.0, last_ms=-1)
    arrived = [n / 30 for n in range(60)] + [2.5 + n / 1000 for n in range(16)]
    arrived += [2.5 + n / 30 for n in range(1, 60)]
    times = [clock.time_ms(at_s, None) for at_s in arrived]
    assert min(b - a for a, b in pairwise(times)) > 5
    assert times[-1] == round(1000 * arrived[-1]), "and are on time again soon"


def test_a_hesitating_network_does_not_show_in_the_times() -> None:
    rng = np.random.default_rng(1)
    clock = StreamClock(zero_s=50.0, last_ms=-1, delay_s=50.0)
    frames = 600
    times = [
        clock.time_ms(50 + n / 30 + max(rng.normal(0.005, 0.01), 0.0), n / 30)
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
        last = clock.time_ms(n / 10, n / 10 * (1 + drift))
    assert last == pytest.approx(1000 * (hour - 1) / 10, abs=5)


def test_a_jump_of_the_cameras_clock_is_no_jump_of_ours() -> None:
    clock = StreamClock(zero_s=0.0, last_ms=-1)
    times = [clock.time_ms(n / 10, n / 10 + (5000 if n >= 10 else 0)) for n in range(20)]
    assert times == [100 * n for n in range(20)]


def test_times_after_a_drop_out_are_later_than_all_before() -> None:
    clock = StreamClock(zero_s=0.0, last_ms=5000)
    assert clock.time_ms(4.9, None) > 5000
    assert clock.time_ms(8.0, None) == 8000


def test_a_picture_that_is_shown_before_earlier_ones_keeps_its_place() -> None:
    clock = StreamClock(zero_s=0.0, last_ms=-1, delay_s=0.2)
    stated = [0.0, 0.12, 0.04, 0.08, 0.24, 0.16]
    times = [clock.time_ms(0.3 + n / 25, pts) for n, pts in enumerate(stated)]
    assert times == pytest.approx([200, 320, 240, 280, 440, 360], abs=2)


def test_a_growing_file_keeps_its_own_times() -> None:
    clock = FileClock()
    assert [clock.time_ms(0.0, pts) for pts in (1.4, 1.44, 2.0)] == [0, 40, 600]
