"""What an interval is made of: parts that add up, and the tape that shrinks it."""

from dataclasses import astuple

import numpy as np
import pytest
from tracks import SEGMENT_MM, TRUE_MM, make_track, ring

from vo_core.geometry.height import ScaleEffects
from vo_core.scale.correction import correct, joint_spacing
from vo_core.scale.evidence import KnownLength
from vo_core.scale.interval import interval_parts

EFFECTS = ScaleEffects(height=0.008, focal=0.005, diameter=0.0, tilt=0.001)
TRACK = make_track(TRUE_MM, 3.0 * np.sqrt(TRUE_MM / 6000))
JOINTS = [ring(TRACK, at, int(np.searchsorted(TRUE_MM, at)) - 1) for at in (400, 1900, 3400, 4900)]


def in_quadrature(parts):
    whole, *single, _ = astuple(parts)
    return whole, np.linalg.norm(single)


def test_of_a_raw_track_it_is_tracking_and_the_rig():
    parts = interval_parts(TRACK, EFFECTS, [], 300)
    assert parts.height_mm == pytest.approx(0.008 * 6000)
    assert parts.focal_mm == pytest.approx(0.005 * 6000)
    assert parts.tilt_mm == pytest.approx(0.001 * 6000)
    assert parts.tracking_mm == pytest.approx(3.0)
    assert parts.joints_mm == parts.segment_mm == parts.tape_mm == parts.change_mm == 0
    whole, added = in_quadrature(parts)
    assert whole == pytest.approx(added)


def test_a_tape_of_five_metres_would_shrink_it_to_its_own_error():
    parts = interval_parts(TRACK, EFFECTS, [], 300)
    assert parts.sigma_mm > 55
    assert parts.taped_mm == pytest.approx(np.hypot(5 * 6 / 5, 3.0), rel=0.15)


@pytest.mark.parametrize("zero_frame", [None, 60])
@pytest.mark.parametrize("frame", [10, 150, 300])
def test_with_joints_and_a_tape_the_parts_add_up_to_what_the_corrected_track_states(
    zero_frame, frame
):
    evidence = [joint_spacing(TRACK, JOINTS, SEGMENT_MM), KnownLength(20, 250, 4600.0, 15.0)]
    parts = interval_parts(TRACK, EFFECTS, evidence, frame, zero_frame=zero_frame)
    done = correct(TRACK, evidence, zero_frame=zero_frame)
    whole, added = in_quadrature(parts)
    assert whole == pytest.approx(added)
    assert whole == pytest.approx(done.track.sigma_distance_mm[frame])
    assert min(parts.segment_mm, parts.tape_mm, parts.joints_mm) > 0
    assert parts.height_mm == 0  # so much less certain than the joints that it is not asked


def test_a_rig_that_is_exact_leaves_the_tracking():
    parts = interval_parts(TRACK, ScaleEffects(0.0, 0.0, 0.0, 0.0), [], 300)
    assert parts.sigma_mm == pytest.approx(3.0)
    assert parts.height_mm == 0
