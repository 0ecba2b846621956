"""Counting joints: lists of rings made here, with missing and false ones and a wrong scale."""

from dataclasses import replace

import numpy as np
import pytest
from tracks import SEGMENT_MM, look, straight_track

from vo_core.errors import InvalidCorrection
from vo_core.joints.lattice import count_joints
from vo_core.joints.sightings import Sighting, places_mm


def pipe(rng, length_mm, *, scatter_mm, missing):
    """True places of the joints that are seen, and their numbers from the first one."""
    count = int(length_mm / SEGMENT_MM)
    segments = rng.normal(SEGMENT_MM, scatter_mm, count)
    at_mm = rng.uniform(100, 1300) + np.concatenate([[0], np.cumsum(segments[:-1])])
    seen = rng.uniform(size=count) >= missing
    return at_mm[seen], np.flatnonzero(seen)


@pytest.mark.parametrize("scale", [0.97, 0.99, 1.0, 1.013, 1.03])
@pytest.mark.parametrize(
    ("length_mm", "scatter_mm", "missing", "false"),
    [(30e3, 0, 0, 0), (30e3, 5, 0.2, 0.5), (100e3, 5, 0.2, 0.5), (100e3, 3, 0.5, 1.0)],
)
def test_no_segment_is_slipped_over_a_long_way(scale, length_mm, scatter_mm, missing, false):
    rng = np.random.default_rng(int(1000 * scale))
    true_mm, numbers = pipe(rng, length_mm, scatter_mm=scatter_mm, missing=missing)
    track = straight_track(np.linspace(0, length_mm, 4000) / scale)
    wrong_mm = rng.uniform(0, length_mm, int(false * length_mm / SEGMENT_MM))
    wrong_mm = wrong_mm[np.abs(wrong_mm[:, None] - true_mm).min(axis=1) > 60]
    sightings = look(track, (true_mm + rng.normal(0, 0.3, len(true_mm))) / scale)
    joints = count_joints(track, sightings + look(track, wrong_mm / scale), SEGMENT_MM)

    at_mm = scale * places_mm(track, [joint.sighting for joint in joints])
    nearest = np.abs(at_mm[:, None] - true_mm).argmin(axis=1)
    right = np.abs(at_mm - true_mm[nearest]) < 5
    counted = np.array([joint.number for joint in joints])
    assert {joint.count for joint in joints} == {0}
    assert len(set((counted - numbers[nearest])[right])) == 1
    assert right.sum() >= 0.8 * len(true_mm)
    assert (~right).sum() <= 0.05 * len(joints) + 1


def test_a_joint_seen_there_and_back_has_one_number():
    way = np.linspace(0, 9000, 1000)
    track = straight_track(np.concatenate([way, way[::-1]]))
    joints = count_joints(track, look(track, 400 + SEGMENT_MM * np.arange(6)), SEGMENT_MM)
    assert [joint.number for joint in joints] == [0, 1, 2, 3, 4, 5, 5, 4, 3, 2, 1, 0]


def test_backwards_the_numbers_fall():
    track = straight_track(-np.linspace(0, 6000, 500))
    joints = count_joints(track, look(track, -400 - SEGMENT_MM * np.arange(4)), SEGMENT_MM)
    assert [joint.number for joint in joints] == [0, -1, -2, -3]


@pytest.mark.parametrize(("sigma_mm", "counts"), [(60.0, {0}), (900.0, {0, 1})])
def test_a_loss_that_may_hide_a_segment_starts_a_new_count(sigma_mm, counts):
    x_mm = np.linspace(0, 18_000, 2000)
    track = straight_track(x_mm, np.where(x_mm > 9000, sigma_mm, 0.1))
    off_mm = np.where(x_mm > 9000, 0.8 * sigma_mm, 0.0)  # what the loss did hide
    moved = straight_track(x_mm + off_mm, track.sigma_distance_mm)
    true_mm = 400 + SEGMENT_MM * np.arange(12)
    sightings = look(track, true_mm)
    joints = count_joints(moved, sightings, SEGMENT_MM)
    assert {joint.count for joint in joints} == counts
    assert len(joints) == 12
    if counts == {0}:
        assert [joint.number for joint in joints] == list(range(12))


GAP_MM = 40.5 * 300  # 40 segments at a scale wrong by 1.2 %, 41 at one wrong the other way
ACROSS_A_GAP = [500, 800, 1100, 1100 + GAP_MM, 1400 + GAP_MM, 1700 + GAP_MM]


def test_a_gap_that_may_be_counted_in_two_ways_asks_for_a_length():
    track = straight_track(np.linspace(0, 15_000, 3000))
    with pytest.raises(InvalidCorrection, match=r"How many segments .* give a taped length"):
        count_joints(track, look(track, ACROSS_A_GAP), 300.0)


def test_what_else_is_known_of_the_scale_counts_across_a_gap():
    track = straight_track(np.linspace(0, 15_000, 3000))
    sightings = look(track, ACROSS_A_GAP)
    joints = count_joints(track, sightings, 300.0, scale=41 / 40.5, scale_sigma=0.001)
    assert [joint.number for joint in joints] == [0, 1, 2, 43, 44, 45]


def test_two_rings_far_apart_do_not_make_a_lattice():
    track = straight_track(np.linspace(0, 70_000, 6000))
    with pytest.raises(InvalidCorrection, match="cannot be counted by the 2 rings"):
        count_joints(track, look(track, [500, 60_500]), SEGMENT_MM)


def test_many_joints_are_believed_against_a_wrong_scale():
    track = straight_track(np.linspace(0, 30_000, 3000))
    sightings = look(track, 500 + SEGMENT_MM * np.arange(19))
    joints = count_joints(track, sightings, SEGMENT_MM, scale=0.98, scale_sigma=0.0005)
    assert [joint.number for joint in joints] == list(range(19))


def test_courses_of_bricks_are_no_joints_of_a_pipe_whose_joints_are_dark():
    track = straight_track(np.linspace(0, 6000, 600))
    bright = [replace(s, contrast=0.2) for s in look(track, 92 + 800 * np.arange(7))]
    dark = look(track, 405 + SEGMENT_MM * np.arange(4))
    joints = count_joints(track, bright + dark, SEGMENT_MM)
    assert [joint.sighting for joint in joints] == dark


@pytest.mark.parametrize("deepest", [0.8, 0.9])
def test_over_silt_that_gets_deeper_no_joint_is_lost(deepest):
    true_mm = np.linspace(0, 12_000, 1200)
    raw_mm = np.concatenate([[0], np.cumsum(np.diff(true_mm) / np.linspace(1, deepest, 1199))])
    track = straight_track(raw_mm)
    sightings = look(track, np.interp(405 + SEGMENT_MM * np.arange(8), true_mm, raw_mm))
    joints = count_joints(track, sightings, SEGMENT_MM, scale_sigma=0.01)
    assert [joint.number for joint in joints] == list(range(8))


def test_every_second_place_of_a_lattice_does_not_stay_empty():
    track = straight_track(np.linspace(0, 9000, 900))
    with pytest.raises(InvalidCorrection, match="check the length of a segment"):
        count_joints(track, look(track, 405 + SEGMENT_MM * np.arange(6)), SEGMENT_MM / 2)


def test_no_joints_and_no_lattice_are_reported():
    track = straight_track(np.linspace(0, 9000, 900))
    with pytest.raises(InvalidCorrection, match="No joints were seen"):
        count_joints(track, [], SEGMENT_MM)
    with pytest.raises(
        InvalidCorrection, match="Segments of 1500 mm cannot be counted by the 3 rings"
    ):
        count_joints(track, look(track, [400, 1200, 2500]), SEGMENT_MM)
    with pytest.raises(InvalidCorrection, match="the same joint"):
        count_joints(track, look(track, [400]), SEGMENT_MM)


@pytest.mark.parametrize("wrong_mm", [170.0, 640.0, 1100.0, 1900.0])
def test_a_wrong_length_of_a_segment_is_refused(wrong_mm):
    track = straight_track(np.linspace(0, 9000, 900))
    sightings = look(track, 400 + SEGMENT_MM * np.arange(5))
    with pytest.raises(InvalidCorrection, match="check the length of a segment"):
        count_joints(track, sightings, wrong_mm)


def test_two_joints_are_enough():
    track = straight_track(np.linspace(0, 3000, 300))
    joints = count_joints(track, look(track, [400, 1915]), SEGMENT_MM)
    assert [joint.number for joint in joints] == [0, 1]


def test_joints_of_another_track_are_refused():
    track = straight_track(np.linspace(0, 9000, 10))
    with pytest.raises(InvalidCorrection, match="no frame 99"):
        count_joints(track, [Sighting(99, 0.0, 1.0, 0.5)] * 2, SEGMENT_MM)


def test_one_joint_seen_twice_is_no_scale():
    track = straight_track(np.r_[np.linspace(0, 3000, 100), np.linspace(3000, 0, 100)])
    with pytest.raises(InvalidCorrection, match="the same joint"):
        count_joints(track, look(track, [1500.0]), SEGMENT_MM)
