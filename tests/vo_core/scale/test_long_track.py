"""Corrections of tracks of many frames: solved at some of them, interpolated between."""

import numpy as np
import pytest
from tracks import SEGMENT_MM, look, make_track

from vo_core.scale.correction import correct, joint_spacing, sigma_parts
from vo_core.scale.evidence import KnownLength

FRAMES = 30_000


def _wandering(rng, *, turns=False, lost=False):
    """A drive that states its random walk; perhaps with a way back, perhaps with a lost stretch."""
    steps = np.full(FRAMES - 1, 2.0)
    if turns:
        steps[18_000:22_000] *= -1
    walk = np.full(FRAMES - 1, 0.05)
    if lost:
        walk[11_000:11_040] = 10.0
    own = np.zeros(FRAMES)
    own[14_000:14_030] = 30.0  # a bridged stretch whose end is recognised again
    walked = np.concatenate([[0], np.cumsum(rng.normal(0, walk))])
    way = np.concatenate([[0], np.cumsum(steps)])
    sigma = np.sqrt(np.concatenate([[0], np.cumsum(walk**2)]) + own**2)
    return make_track((way + walked) / 1.004, sigma)


@pytest.mark.parametrize("odd", [{}, {"turns": True}, {"lost": True}])
@pytest.mark.parametrize("has_joints", [True, False])
def test_a_frame_between_the_knots_is_as_a_frame_of_its_own(odd, has_joints):
    rng = np.random.default_rng(5)
    track = _wandering(rng, **odd)
    evidence = [KnownLength(10, 29_000, 2.0 * 28_990 - (16_000 if "turns" in odd else 0), 3.0)]
    if has_joints:
        rings = look(track, np.arange(700, 50_000, SEGMENT_MM) / 1.004)
        evidence.append(joint_spacing(track, rings, SEGMENT_MM))
    done = correct(track, evidence).track
    frames = [*rng.integers(0, FRAMES, 30), *range(10_995, 11_045, 5), *range(13_995, 14_035, 5)]
    for frame in map(int, frames):
        alone = np.sqrt(sum(mm**2 for mm in sigma_parts(track, evidence, frame).values()))
        assert done.sigma_distance_mm[frame] == pytest.approx(alone, rel=0.01, abs=1e-3)
    # The zero is always a knot: what lies between it and the end shows where a frame is.
    for frame in map(int, frames[::6]):
        end_mm = correct(track, evidence, zero_frame=frame).track.distance_mm[-1]
        way_mm = done.distance_mm[-1] - done.distance_mm[frame]
        assert way_mm == pytest.approx(end_mm, abs=0.02 * done.sigma_distance_mm.max() + 1e-3)


@pytest.mark.parametrize("zero", [9_001, 10_000])
def test_a_zero_within_a_stand_leaves_every_frame_an_uncertainty(zero):
    rng = np.random.default_rng(0)
    steps = np.full(19_999, 3.0)
    steps[:2_000] = steps[9_000:12_000] = 0.0  # the robot stands
    walk = np.where(steps > 0, 0.03, 0.0)
    true_mm = np.concatenate([[0], np.cumsum(steps)])
    scale = 1 + 0.03 * np.sin(true_mm / 7000)
    way_mm = np.concatenate([[0], np.cumsum(steps * scale[:-1] + rng.normal(0, walk))])
    # Each frame has an error of its own beside the common one; files have four decimals.
    own_mm = rng.normal(0, 0.02, (2, 20_000))
    walked_mm2 = np.concatenate([[0], np.cumsum(walk**2)])
    sigma_mm = np.round(np.sqrt(walked_mm2 + own_mm[0] ** 2), 4)
    track = make_track(np.round(way_mm + own_mm[1], 4), sigma_mm)
    rings = look(track, np.interp(np.arange(700, true_mm[-1], SEGMENT_MM), true_mm, way_mm))
    joints = joint_spacing(track, rings, SEGMENT_MM)

    done = correct(track, [joints], zero_frame=zero).track
    assert np.isfinite(done.sigma_distance_mm).all()
    assert done.sigma_distance_mm[9_000:12_000].max() < 1.0
