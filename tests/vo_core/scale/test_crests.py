"""The crests of a corrugated wall as a ruler, on tracks whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from textures import make_rig
from tracks import look, straight_track

from vo_core.errors import InvalidCorrection
from vo_core.joints.sightings import Sighting
from vo_core.scale.correction import correct
from vo_core.scale.crests import crest_spacing, seen_pitch_mm
from vo_core.scale.evidence import KnownLength, rig_scale
from vo_core.scale.proposal import propose

PITCH_MM = 67.7
WAVES = {"corrugation": {"pitch_mm": PITCH_MM, "depth_mm": 13.0}}
RIG = make_rig(pipe=WAVES | {"segment_length_mm": None})
TRUE_MM = np.linspace(0, 6000, 601)
SIGMA = 0.01


def measured(scale, lost_at_mm=None):
    """A track that has to be scaled, by a rig that is known to 1 %."""
    walked = 0.01 * np.sqrt(TRUE_MM)
    if lost_at_mm is not None:
        walked = np.hypot(walked, 40.0 * (lost_at_mm < TRUE_MM))
    raw_mm = TRUE_MM / scale
    track = straight_track(raw_mm, walked)
    return replace(track, sigma_distance_mm=np.hypot(walked, SIGMA * raw_mm))


def seen_crests(track, scale, every_mm=500.0, seed=1):
    """Crests that are noted half a metre apart, a metre behind the camera."""
    rng, found = np.random.default_rng(seed), []
    for at_mm in np.arange(every_mm, 6000, every_mm):
        frame = int(np.searchsorted(TRUE_MM, at_mm))
        crest_mm = PITCH_MM * round((at_mm - 300) / PITCH_MM) + rng.normal(0, 0.5)
        ahead_mm = (crest_mm - TRUE_MM[frame]) / scale
        wave_mm = PITCH_MM / scale * rng.normal(1, 0.004)
        found.append(Sighting(frame, float(ahead_mm), 0.5, 0.7, float(wave_mm)))
    return found


@pytest.mark.parametrize("scale", [0.985, 1.0, 1.02])
def test_crests_bring_a_run_to_scale(scale):
    track = measured(scale)
    proposal = propose(track, seen_crests(track, scale), RIG)
    found = proposal.correction.track
    assert proposal.ruler == "crests"
    assert np.abs(found.distance_mm - TRUE_MM).max() < 0.003 * 6000
    assert found.sigma_distance_mm[-1] < 0.6 * track.sigma_distance_mm[-1]
    assert proposal.scale == pytest.approx(scale, abs=0.002)
    assert "crests at 11 places: scale" in str(proposal)


def test_behind_a_loss_the_count_begins_anew():
    track = measured(1.01, lost_at_mm=3000)
    spacing = crest_spacing(track, seen_crests(track, 1.01), RIG.pipe.corrugation)
    assert [joint.count for joint in spacing.joints] == [0] * 6 + [1] * 5
    assert correct(track, [spacing]).scale == pytest.approx(1.01, abs=0.002)


def test_crests_of_an_unknown_pitch_only_tell_it():
    track = measured(1.01)
    seen = seen_crests(track, 1.01)
    smooth = make_rig(pipe={"segment_length_mm": None})
    assert propose(track, seen, smooth) is None
    assert seen_pitch_mm(seen) == pytest.approx(PITCH_MM / 1.01, rel=0.005)
    assert seen_pitch_mm(look(track, [400.0, 900.0])) is None


def test_crests_are_no_joints_and_help_to_count_them():
    rig = make_rig(pipe=WAVES | {"segment_length_mm": 1500.0})
    track = measured(1.02)
    joints = look(track, np.array([400.0, 1900.0, 3400.0, 4900.0]) / 1.02)
    proposal = propose(track, [*seen_crests(track, 1.02), *joints], rig)
    assert (proposal.ruler, proposal.joints) == ("joints", 4)
    assert proposal.scale == pytest.approx(1.02, abs=0.002)


def test_crests_and_a_tape_that_contradict_each_other_are_refused():
    track = measured(1.0)
    tape = KnownLength(0, 600, 5700.0)
    with pytest.raises(InvalidCorrection, match=r"contradict.*crests 67\.7 mm apart"):
        propose(track, seen_crests(track, 1.0), RIG, [tape])


def test_the_rig_still_counts_beside_crests():
    track = measured(1.0)
    spacing = crest_spacing(track, seen_crests(track, 1.0), RIG.pipe.corrugation)
    alone, both = (correct(track, found).sigma for found in ([spacing], [spacing, *rig_scale(RIG)]))
    assert both < alone


def test_of_the_crests_of_a_long_pipe_some_are_enough():
    true_mm = np.linspace(0, 600_000, 12_001)
    track = straight_track(true_mm / 1.01, 0.01 * np.sqrt(true_mm))
    places_mm = PITCH_MM * 8 * np.arange(1, 1100)
    frames = np.searchsorted(true_mm, places_mm)
    seen = [
        Sighting(frame, (at_mm - true_mm[frame]) / 1.01, 0.5, 0.7, PITCH_MM / 1.01)
        for frame, at_mm in zip(frames.tolist(), places_mm.tolist(), strict=True)
    ]
    spacing = crest_spacing(track, seen, RIG.pipe.corrugation)
    assert spacing.places <= 120
    assert (spacing.joints[0].sighting, spacing.joints[-1].sighting) == (seen[0], seen[-1])
    assert correct(track, [spacing]).scale == pytest.approx(1.01, abs=0.002)
