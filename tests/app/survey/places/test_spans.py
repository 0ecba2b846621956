"""Ends of a pipe, a run, a strip or a sheet are compared so that no last bit decides."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import date

import numpy as np
import pytest
from tracks import straight_track

from app.survey.adjustment.distance_class import DistanceClass
from app.survey.adjustment.joints import expected_joints
from app.survey.assets.asset_history import Seen, Survey
from app.survey.places.spans import SAME_M, begins_within, is_same, is_within, overlap

SPAN = (3.0, 12.0)
LAST_BITS = [0.0, 1.3e-11, -1.3e-11, *(math.nextafter(12.0, to) - 12.0 for to in (0.0, 99.0))]
"""By what a distance of 12 m differs from one processor to another."""


@pytest.mark.parametrize("bits", LAST_BITS)
def test_an_end_belongs_to_what_it_ends(bits: float) -> None:
    first_m, last_m = (end_m + bits for end_m in SPAN)
    assert is_same(last_m, SPAN[1])
    assert is_within(first_m, SPAN)
    assert is_within(last_m, SPAN)
    assert begins_within(first_m, SPAN)
    assert not begins_within(last_m, SPAN)
    assert not overlap((last_m, 99.0), SPAN)
    assert not overlap((0.0, first_m), SPAN)


def test_what_is_a_millimetre_outside_is_outside() -> None:
    for off_m in (SPAN[0] - 2 * SAME_M, SPAN[1] + 2 * SAME_M):
        assert not is_within(off_m, SPAN)
        assert not begins_within(off_m, SPAN)
    assert overlap((SPAN[1] - 2 * SAME_M, 99.0), SPAN)


@pytest.mark.parametrize("bits", LAST_BITS)
def test_the_joint_at_the_very_end_of_the_run_is_expected(bits: float) -> None:
    track = straight_track(np.linspace(0.0, 12_000.0, 100))
    track = replace(track, distance_mm=track.distance_mm * (1 + bits))
    expected = expected_joints(track, [], 1500.0, has_zero=True)
    assert [joint.number for joint in expected] == list(range(1, 9))


def test_a_survey_covers_what_lies_at_its_very_end() -> None:
    survey = Survey(date(2026, 1, 1), "with_flow", [], end_m=0.3)
    seen = Seen("i", "o", "BAB", 0.1, 0.2, None, None)
    assert seen.distance_m + seen.reach_m > 0.3  # in binary
    assert survey.covers(seen)


@pytest.mark.parametrize("bits", LAST_BITS)
def test_a_class_is_met_at_its_limit(bits: float) -> None:
    found = DistanceClass.of(12_000.0, 0.01, 600.0 + 1000 * bits)
    assert found.percent == 5
