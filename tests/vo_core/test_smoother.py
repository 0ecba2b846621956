"""What the end of a film shows of its beginning: tried on linear chains whose answer is known."""

import numpy as np
import pytest

from vo_core.smoother import STATE, Apart, Link, Smoother, joined
from vo_core.track import Estimate

NOTHING = Apart(np.zeros(STATE), 0.0, 0.0, 0.0)
START, STEP = 1e-6, 0.04
"""Variances of x at the start and of a link."""


def estimate(frame, status="ok"):
    return Estimate(frame, frame / 30, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, status, 0.0)


def link(reference, x_mm, before_mm, variance, before, *, is_seen=True):
    """A link along the pipe; the other axes do not matter."""
    mean = np.zeros(14)
    mean[0], mean[6] = x_mm, before_mm
    now, old = np.eye(STATE), np.eye(STATE)
    now[0, 0], old[0, 0] = variance, before
    joint = joined(now, old)
    return Link(reference, mean, joint, is_seen=is_seen)


def chain(*links):
    smoother = Smoother()
    for frame, each in enumerate(links):
        smoother.add(each, estimate(frame, "ok" if each.is_seen else "lost"), NOTHING)
    return smoother.estimates(0.0)


def test_a_film_of_no_frames_or_one_is_smoothed():
    assert Smoother().estimates(0.0) == []
    (only,) = chain(link(-1, 0.0, 0.0, START, START))
    assert (only.distance_mm, only.frame, only.status) == (0.0, 0, "ok")


def test_what_a_later_link_shows_of_its_reference_moves_the_reference():
    # Frame 2 finds frame 1 half a millimetre further on than frame 1 was placed.
    later = link(1, 20.5, 10.5, 0.06, 0.02)
    made = chain(link(-1, 0.0, 0.0, START, START), link(0, 10.0, 0.0, STEP, START), later)
    assert made[2].distance_mm == pytest.approx(20.5)
    assert made[1].distance_mm == pytest.approx(10.5, abs=1e-3)
    assert made[1].sigma_registration_mm == pytest.approx(np.sqrt(0.02), rel=0.01)


def test_a_frame_beside_the_chain_follows_its_reference():
    leaf = link(1, 15.0, 10.0, STEP + 0.01, STEP)
    last = link(1, 20.5, 10.5, 0.06, 0.02)
    made = chain(link(-1, 0.0, 0.0, START, START), link(0, 10.0, 0.0, STEP, START), leaf, last)
    assert made[2].distance_mm == pytest.approx(15.5, abs=1e-3)


def test_frames_that_show_no_wall_lie_between_those_that_do_with_less_doubt_than_alone():
    hidden = [link(1, 10.0 + 7 * n, 10.0, STEP + n**2, STEP, is_seen=False) for n in (1, 2, 3)]
    found = link(1, 50.0, 10.0, 2 * STEP, STEP)
    made = chain(link(-1, 0.0, 0.0, START, START), link(0, 10.0, 0.0, STEP, START), *hidden, found)
    assert [each.distance_mm for each in made[2:5]] == pytest.approx([20.0, 30.0, 40.0])
    assert [each.status for each in made[2:5]] == ["lost"] * 3
    assert made[4].sigma_registration_mm < 1.2
    assert made[3].sigma_registration_mm > made[2].sigma_registration_mm


def test_the_zero_point_moves_all_frames_but_the_first():
    smoother = Smoother()
    for frame, each in enumerate(
        (link(-1, 0.0, 0.0, START, START), link(0, 10.0, 0.0, STEP, START))
    ):
        smoother.add(each, estimate(frame), NOTHING)
    smoother.shift(-1.0, 0.5)
    made = smoother.estimates(0.0)
    assert [(each.x_mm, each.y_mm) for each in made] == [(0.0, 0.0), (9.0, 0.5)]


def test_a_bed_that_is_certain_late_counts_from_where_it_began():
    smoother, places_mm = Smoother(), [0.0, 100.0, 200.0, 300.0, 400.0]
    live_mm, shares = [0.0, 0.0, 0.0, 20.0, 30.0], [0.0, 0.0, 0.0, 0.1, 0.1]
    for frame, (x_mm, mm, share) in enumerate(zip(places_mm, live_mm, shares, strict=True)):
        before_mm = places_mm[max(frame - 1, 0)]
        each = link(frame - 1, x_mm, before_mm, START, START)
        smoother.add(each, estimate(frame), Apart(np.zeros(STATE), 0.0, mm, share))
    sigma_mm = [each.sigma_distance_mm for each in smoother.estimates(0.0)]
    assert sigma_mm == pytest.approx([0.0, 0.0, 10.0, 20.0, 30.0], abs=0.01)
