"""What joints say of a run as it goes on: right rigs, wrong ones, silt, and too little to say."""

from dataclasses import fields, replace

import numpy as np
import pytest
from textures import make_rig
from tracks import SEGMENT_MM, look, straight_track

from vo_core import Track
from vo_core.errors import InvalidCorrection
from vo_core.scale.evidence import KnownLength
from vo_core.scale.proposal import propose

RIG = make_rig(pipe={"segment_length_mm": SEGMENT_MM})
JOINTS_MM = np.array([400.0, 1900.0, 3400.0, 4900.0])
TRUE_MM = np.linspace(0, 6000, 599)


def drive(scale):
    """A track whose distance is wrong by a scale at each true place, and the joints' places."""
    scale = np.broadcast_to(scale, TRUE_MM.shape)
    steps = np.diff(TRUE_MM) * 2 / (scale[1:] + scale[:-1])
    raw_mm = np.concatenate([[0], np.cumsum(steps)])
    sigma_mm = 0.01 * np.sqrt(raw_mm)
    track = replace(
        straight_track(raw_mm),
        sigma_registration_mm=sigma_mm,
        sigma_distance_mm=np.hypot(sigma_mm, 0.01 * raw_mm),
    )
    return track, look(track, np.interp(JOINTS_MM, TRUE_MM, raw_mm))


def begin(track, rows):
    return Track(**{column.name: getattr(track, column.name)[:rows] for column in fields(track)})


def error_mm(proposal):
    return np.abs(proposal.correction.track.distance_mm - TRUE_MM)


def test_a_rig_that_is_right_is_confirmed():
    proposal = propose(*drive(1.0), RIG)
    assert proposal.joints == 4
    assert proposal.scale == pytest.approx(1, abs=1e-5)
    assert proposal.sigma == pytest.approx(5 / 1500, rel=0.1)  # that of the segment's length
    assert not proposal.doubts_rig
    assert str(proposal).startswith("4 joints: scale 1.0000 ± 0.003")


@pytest.mark.parametrize("scale", [0.983, 1.017])
def test_a_rig_wrong_by_its_tolerance_is_put_right(scale):
    proposal = propose(*drive(scale), RIG)
    assert error_mm(proposal).max() < 1
    assert proposal.correction.track.sigma_distance_mm[-1] < 0.004 * 6000
    assert not proposal.doubts_rig
    assert proposal.lower_mm == pytest.approx(230 * (1 - scale), rel=0.1)
    side = "lower" if scale < 1 else "higher"
    assert str(proposal).endswith(f"; your camera sits 4 mm {side}")


def test_a_measured_length_that_sets_the_scale_too_is_named_instead_of_the_height():
    track, sightings = drive(0.983)
    tape = KnownLength(0, len(track) - 1, float(TRUE_MM[-1] - TRUE_MM[0]), 1.0)
    proposal = propose(track, sightings, RIG, [tape])
    assert proposal.lengths == 1
    said = str(proposal)
    assert said.startswith("4 joints and 1 measured length: scale ")
    assert "camera" not in said


def test_silt_is_counted_and_the_rig_is_doubted():
    proposal = propose(*drive(0.89), RIG)
    assert error_mm(proposal).max() < 1
    assert proposal.doubts_rig
    assert proposal.stretches == ()
    assert 20 < proposal.lower_mm < 30
    assert "check height and lens; silt or water in the invert is a likely cause" in str(proposal)
    # Silt need not lie as deep beyond the last joint.
    assert 0.0035 * 6000 < proposal.correction.track.sigma_distance_mm[-1] < 0.005 * 6000


def test_silt_that_gets_deeper_changes_the_scale_along_the_run():
    proposal = propose(*drive(np.interp(TRUE_MM, [0, 6000], [1.0, 0.89])), RIG)
    error = error_mm(proposal)
    assert error.max() < 0.002 * 6000
    assert (error <= 3 * proposal.correction.track.sigma_distance_mm + 0.01).all()
    middle = [(a.from_mm + a.to_mm) / 2 for a in proposal.stretches]
    assert middle == pytest.approx([1150, 2650, 4150], abs=15)
    expected = np.interp(middle, [0, 6000], [1.0, 0.89])
    assert [a.scale for a in proposal.stretches] == pytest.approx(expected, abs=1e-3)
    assert proposal.height is None
    assert "changes along the run from 0.979 to 0.924" in str(proposal)


def test_from_the_second_joint_on_there_is_a_proposal():
    track, sightings = drive(0.99)
    counts = []
    for rows in range(1, len(track) + 1, 20):
        proposal = propose(begin(track, rows), sightings, RIG)
        counts.append(0 if proposal is None else proposal.joints)
    assert sorted(set(counts)) == [0, 2, 3, 4]
    assert counts == sorted(counts)


def test_without_the_length_of_a_segment_nothing_is_proposed():
    assert propose(*drive(1.0), make_rig(pipe={"segment_length_mm": None})) is None


@pytest.mark.parametrize("missed", [0, 1, 2, 3])
def test_a_missed_joint_does_not_matter(missed):
    track, sightings = drive(0.98)
    del sightings[missed]
    proposal = propose(track, sightings, RIG)
    assert proposal.joints == 3
    assert error_mm(proposal).max() < 1


@pytest.mark.parametrize("doubled", [0, 1, 2, 3])
def test_a_joint_that_is_seen_twice_does_not_matter(doubled):
    track, sightings = drive(0.98)
    sightings.append(replace(sightings[doubled], ahead_mm=sightings[doubled].ahead_mm + 25))
    proposal = propose(track, sightings, RIG)
    assert proposal.joints == 4
    assert error_mm(proposal).max() < 0.002 * 6000


def test_joints_against_a_tape_are_refused():
    track, sightings = drive(0.89)
    with pytest.raises(InvalidCorrection, match="contradict each other"):
        propose(track, sightings, RIG, [KnownLength(0, 598, 6240.0, 3.0)])


def test_a_tape_and_joints_outvote_the_rig():
    track, sightings = drive(0.89)
    proposal = propose(track, sightings, RIG, [KnownLength(0, 598, 6000.0, 3.0)])
    assert error_mm(proposal).max() < 1
    assert proposal.doubts_rig
    assert proposal.correction.track.sigma_distance_mm[-1] < 3.1


def test_rings_that_lie_anywhere_are_refused():
    track, _ = drive(1.0)
    with pytest.raises(InvalidCorrection, match="cannot be counted"):
        propose(track, look(track, [400, 1200, 2500]), RIG)
