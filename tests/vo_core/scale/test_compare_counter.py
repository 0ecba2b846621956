"""A counter against a track: faults are found where they are, and the scale is the true one."""

import numpy as np
import pytest
from tracks import make_track

from vo_core.scale.correction import correct
from vo_core.scale.counter import compare_counter

pytestmark = pytest.mark.unit
TICK = 0.1
FRAMES = 3000
DRIVEN_MM = np.linspace(0, 30_000, FRAMES)
"""By the track; the sigma grows to 30 mm by registration."""
TRACK = make_track(DRIVEN_MM, 30 * np.sqrt(DRIVEN_MM / 30_000))
SCALE = 0.98


def shown(counter, tick=TICK):
    """What a counter shows, in its unit: whole ticks."""
    return np.floor(np.asarray(counter) / tick + 1e-9) * tick


def true_m(start=5.0):
    return start + SCALE * DRIVEN_MM / 1000


def compared(counter, track=TRACK, unit="m", tick=TICK):
    return compare_counter(track, shown(counter, tick), unit=unit, tick=tick)


def test_a_counter_without_faults_gives_the_scale():
    found = compared(true_m())
    assert found.faults == ()
    assert found.scale == pytest.approx(SCALE, abs=3 * found.sigma)
    assert found.sigma < 0.01
    assert found.length.length_mm == pytest.approx(SCALE * 30_000, abs=100)


def test_feet_are_converted():
    found = compared(true_m() / 0.3048, unit="ft")
    assert found.scale == pytest.approx(SCALE, abs=3 * found.sigma)


def test_the_known_length_brings_the_track_to_scale():
    found = compared(true_m())
    done = correct(TRACK, [found.length])
    assert done.scale == pytest.approx(SCALE, abs=3 * done.sigma)
    assert done.sigma == pytest.approx(found.sigma, rel=0.1)


@pytest.mark.parametrize("start", [0.0, 80.0])
def test_a_reset_is_found_and_the_longer_part_gives_the_scale(start):
    counter = true_m()
    counter[1000:] += start - counter[1000]
    found = compared(counter)
    (fault,) = found.faults
    assert (fault.kind, fault.first_frame, fault.last_frame) == ("reset", 999, 1000)
    assert fault.counter_mm == pytest.approx(1000 * (start - true_m()[999]), abs=200)
    assert found.length.first_frame >= 1000
    assert found.scale == pytest.approx(SCALE, abs=3 * found.sigma)


def test_a_counter_that_sticks_is_found():
    counter = true_m()
    counter[1200:1500] = counter[1200]
    counter[1500:] -= true_m()[1500] - counter[1200]
    found = compared(counter)
    (fault,) = found.faults
    assert fault.kind == "stuck"
    assert abs(fault.first_frame - 1200) < 25  # two ticks are 20 frames
    assert abs(fault.last_frame - 1500) < 25
    assert fault.counter_mm == pytest.approx(0, abs=110)
    assert fault.camera_mm == pytest.approx(SCALE * 3000, abs=300)
    assert found.scale == pytest.approx(SCALE, abs=3 * found.sigma)


@pytest.mark.parametrize("factor", [0.5, 1.6])
def test_a_cable_that_slips_or_slackens_is_found(factor):
    steps = np.diff(true_m(), prepend=5.0)
    steps[1200:1500] *= factor
    found = compared(5 + np.cumsum(steps))
    (fault,) = found.faults
    assert fault.kind == "slip"
    assert abs(fault.first_frame - 1200) < 100
    assert abs(fault.last_frame - 1500) < 100
    assert found.scale == pytest.approx(SCALE, abs=3 * found.sigma)


def test_a_counter_that_runs_on_while_the_camera_stands_has_slipped():
    driven_mm = np.concatenate([DRIVEN_MM[:1500], np.full(600, DRIVEN_MM[1500]), DRIVEN_MM[1500:]])
    counter = 5 + SCALE * driven_mm / 1000
    counter[1600:2000] += np.linspace(0, 2, 400)
    counter[2000:] += 2
    found = compared(counter, make_track(driven_mm, np.full(len(driven_mm), 5.0)))
    (fault,) = found.faults
    assert fault.kind == "slip"
    assert 1500 < fault.first_frame < 1650
    assert 1950 < fault.last_frame < 2050
    assert fault.camera_mm == pytest.approx(0, abs=10)


def test_a_camera_that_returns_is_no_fault():
    driven_mm = np.concatenate([DRIVEN_MM, DRIVEN_MM[::-1]])
    found = compared(5 + SCALE * driven_mm / 1000, make_track(driven_mm, np.full(6000, 5.0)))
    assert found.faults == ()
    assert found.scale == pytest.approx(SCALE, abs=3 * found.sigma)


def test_illegible_frames_and_one_reading_a_second_are_enough():
    counter = shown(true_m())
    counter[np.arange(FRAMES) % 30 > 0] = np.nan
    counter[900:1500] = np.nan
    found = compare_counter(TRACK, counter, unit="m", tick=TICK)
    assert found.faults == ()
    assert found.scale == pytest.approx(SCALE, abs=3 * found.sigma)


def test_a_track_lost_for_a_while_accuses_no_counter():
    """The bridged stretch is wrong by 2 m, and its sigma says so."""
    driven_mm = DRIVEN_MM + np.where(np.arange(FRAMES) > 1500, 2000.0, 0.0)
    sigma_mm = np.where(np.arange(FRAMES) > 1500, 1500.0, 5.0)
    found = compared(true_m(), make_track(driven_mm, sigma_mm))
    assert found.faults == ()


@pytest.mark.parametrize(
    "counter", [np.full(FRAMES, np.nan), np.full(FRAMES, 7.0), 40 - true_m()],
    ids=["illegible", "standing", "counts down"],
)  # fmt: skip
def test_without_a_way_in_common_no_scale_is_offered(counter):
    found = compare_counter(TRACK, counter, unit="m", tick=TICK)
    assert found.scale is None
    assert found.length is None
    assert str(found) == "too little was driven without a fault of the counter"


def test_the_sentence_states_counter_camera_and_scale():
    found = compared(true_m())
    assert str(found).startswith("counter 29.400 m, camera 30.000 ± 0.030 m: scale 0.980 ± 0.005")
    assert not found.agrees
