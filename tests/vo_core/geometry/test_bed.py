"""A bed of silt: noticed by its shape, doubted where it lies and behind it, counted over."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from textures import make_rig
from tracks import SEGMENT_MM, look, straight_track

from vo_core.errors import InvalidCorrection
from vo_core.geometry.bed import DEPTH_MM, MEMORY_MM, Bed
from vo_core.scale.correction import correct
from vo_core.scale.evidence import rig_scale
from vo_core.scale.proposal import propose

RIG = make_rig(pipe={"segment_length_mm": SEGMENT_MM})
HEIGHT_MM = RIG.mount.height_mm
PATCH_MM = (123.0, 92.0)
"""What 30 degrees see of the wall."""
SHARE = DEPTH_MM / HEIGHT_MM
TRUE_MM = np.linspace(0, 6000, 601)
JOINTS_MM = np.array([400.0, 1900.0, 3400.0, 4900.0])


def drive(bed, true_mm, pitch_share):
    """Sigma of each place of a drive; on the bed a share of the way looks like a pitch."""
    found = []
    for last_mm, x_mm in pairwise(true_mm):
        way_mm = 30.0 * np.sign(x_mm - last_mm)
        pitch_rad = pitch_share(x_mm) * way_mm / HEIGHT_MM
        change = np.array([way_mm, 0, 0, 0, pitch_rad, 0])
        bed.take(change, last_mm, x_mm)
        found.append(bed.doubt.mm)
    return np.abs(found)


def on_bed(x_mm, first_mm=2000.0, last_mm=3000.0):
    return 0.16 * ((x_mm > first_mm) & (x_mm <= last_mm))


UNNOTICED_MM = 240.0
"""Way on a bed until it is as likely as none."""
CLEAN_MM = 1.0
"""Doubt over clean wall, which may always be a bed to some small probability."""


def test_a_bed_is_noticed_and_what_it_did_stays_behind_it():
    sigma_mm = drive(Bed(RIG, PATCH_MM), TRUE_MM, on_bed)
    assert (sigma_mm[TRUE_MM[1:] <= 2000] < CLEAN_MM).all()
    noticed_mm = TRUE_MM[1:][sigma_mm > MEMORY_MM * SHARE / 2][0]
    assert noticed_mm - 2000 == pytest.approx(UNNOTICED_MM, abs=100)
    assert sigma_mm[-1] == pytest.approx(1000 * SHARE, rel=0.15)
    assert sigma_mm[-1] == pytest.approx(sigma_mm[TRUE_MM[1:] > 4000][0], abs=CLEAN_MM)


def test_the_doubt_grows_with_the_evidence_and_never_jumps():
    sigma_mm = drive(Bed(RIG, PATCH_MM), TRUE_MM, on_bed)
    assert np.abs(np.diff(sigma_mm)).max() < 0.2 * MEMORY_MM * SHARE


def test_a_floor_has_no_bed():
    floor = make_rig(pipe={"shape": "flat", "diameter_mm": None, "segment_length_mm": None})
    assert not drive(Bed(floor, PATCH_MM), TRUE_MM, on_bed).any()


def test_on_the_way_back_a_bed_gives_back_what_it_took():
    there_and_back = np.concatenate([TRUE_MM, TRUE_MM[-2::-1]])
    sigma_mm = drive(Bed(RIG, PATCH_MM), there_and_back, on_bed)
    assert sigma_mm.max() > 0.7 * 1000 * SHARE
    assert sigma_mm[-1] < 0.1 * sigma_mm.max()


def test_soft_wheels_and_a_rig_that_is_a_little_wrong_are_no_bed():
    def nodding(x_mm):
        return 0.02 + 0.09 * np.sin(x_mm / 43)  # by 1 degree each 0.9 s

    assert drive(Bed(RIG, PATCH_MM), TRUE_MM, nodding).max() < 2 * CLEAN_MM


def test_the_same_bed_is_noticed_in_a_large_pipe_where_it_shows_less():
    large = make_rig(mount={"height_mm": 350.0}, pipe={"diameter_mm": 600.0})
    wide = drive(Bed(large, (280.0, 210.0)), TRUE_MM, lambda x_mm: 0.5 * on_bed(x_mm))
    assert wide[-1] > 800 * DEPTH_MM / 350


def over_bed(first_mm, last_mm, scale=1.12, rig_sigma=0.01):
    """A track that reads too long over a bed and says so, and the joints' places by it."""
    is_bed = (first_mm < TRUE_MM) & (last_mm >= TRUE_MM)
    raw_mm = np.concatenate([[0], np.cumsum(np.diff(TRUE_MM) * np.where(is_bed, scale, 1)[1:])])
    bed_mm = np.concatenate([[0], np.cumsum(np.diff(raw_mm) * is_bed[1:])])
    noticed = np.interp(TRUE_MM, [first_mm + UNNOTICED_MM, first_mm + UNNOTICED_MM + 1], [0, 1])
    own_mm = 0.01 * np.sqrt(raw_mm)
    track = replace(
        straight_track(raw_mm),
        sigma_registration_mm=own_mm,
        sigma_distance_mm=np.sqrt(
            own_mm**2 + (rig_sigma * raw_mm) ** 2 + (SHARE * bed_mm * noticed) ** 2
        ),
    )
    return track, look(track, np.interp(JOINTS_MM, TRUE_MM, raw_mm))


@pytest.mark.parametrize(("first_mm", "last_mm"), [(2100, 3100), (2600, 6000), (2600, 4500)])
def test_a_bed_in_a_part_of_the_run_is_counted_over_and_stays_where_it_is(first_mm, last_mm):
    track, sightings = over_bed(first_mm, last_mm)
    proposal = propose(track, sightings, RIG)
    found = proposal.correction.track
    assert proposal.joints == 4
    error_mm = found.distance_mm - TRUE_MM
    assert np.mean(np.abs(error_mm) <= 3 * found.sigma_distance_mm + 0.01) >= 0.97
    assert abs(error_mm[-1]) < 0.002 * 6000
    assert found.sigma_distance_mm[-1] < 0.005 * 6000
    assert len(proposal.stretches) == 3


def test_without_joints_the_interval_holds_the_bed():
    track, _ = over_bed(2100, 3100)
    found = correct(track, rig_scale(RIG)).track
    assert found.sigma_distance_mm[-1] == pytest.approx(track.sigma_distance_mm[-1], rel=0.2)
    assert np.mean(np.abs(found.distance_mm - TRUE_MM) <= 3 * found.sigma_distance_mm) > 0.97


def test_two_pairs_of_rings_that_ask_for_two_scales_are_refused():
    track = replace(straight_track(TRUE_MM), sigma_distance_mm=0.01 * TRUE_MM)
    with pytest.raises(InvalidCorrection, match="cannot be counted"):
        propose(track, look(track, [900.0, 1300.0, 2385.0, 2815.0]), RIG)
