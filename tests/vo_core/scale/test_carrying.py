"""The distance where the camera does not measure: truth is a drive of changing speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from vo_core.scale.carrying import Carried, Readings, are_better, carried_wholly, carry
from vo_core.track import Track

FRAMES = 1000
TIME_S = np.arange(FRAMES) / 25
TRUTH_MM = np.concatenate([[0.0], np.cumsum(4 * (1 + 0.5 * np.sin(TIME_S)))[:-1]])
LOST = (TIME_S >= 12) & (TIME_S < 20)
BEGIN_MM = 7000.0
"""What the counter shows at the first frame."""


def track_of(lost: NDArray[np.bool_], scale: float = 1.0) -> Track:
    """A camera that says nothing of the way in `lost` frames, and is certain elsewhere."""
    nothing = np.zeros(FRAMES)
    steps = np.where(lost[1:] | lost[:-1], 0.0, scale * np.diff(TRUTH_MM))
    way_mm = np.concatenate([[0.0], np.cumsum(steps)])
    doubt_mm = np.concatenate([[0.0], np.cumsum(np.where(lost[1:], 8.0, 0.0))])
    sigma_mm = np.hypot(0.02 * np.sqrt(TRUTH_MM + 1), doubt_mm)
    return Track(
        frame=np.arange(FRAMES),
        time_s=TIME_S,
        x_mm=way_mm,
        y_mm=nothing,
        yaw_deg=nothing,
        distance_mm=way_mm,
        sigma_distance_mm=np.hypot(sigma_mm, 0.008 * way_mm),
        quality=np.where(lost, 0.0, 0.9),
        status=np.where(lost, "lost", "ok"),
        sigma_registration_mm=sigma_mm,
        z_mm=nothing,
        pitch_deg=nothing,
        roll_deg=nothing,
        looking_around=np.zeros(FRAMES, bool),
    )


def counter(tick_mm: float, share: float = 0.0) -> NDArray[np.float64]:
    return np.floor((TRUTH_MM * (1 + share) + BEGIN_MM) / tick_mm) * tick_mm


def carried_by(track: Track, shown_mm: NDArray[np.float64], tick_mm: float = 10.0) -> Carried:
    readings = Readings.of_counter(TIME_S, shown_mm, tick_mm=tick_mm, share=0.005)
    assert readings is not None
    found = carry(track, readings)
    assert found is not None
    return found


def covered(track: Track, truth_mm: NDArray[np.float64]) -> float:
    errors = np.abs(track.distance_mm - truth_mm)
    return float((errors <= 1.96 * track.sigma_distance_mm).mean())


def test_between_two_typed_distances_the_way_of_the_camera_is_as_certain_as_its_rig() -> None:
    track = track_of(LOST, scale=0.9)
    rig_mm = 0.1 * track.distance_mm
    track = replace(track, sigma_distance_mm=np.hypot(track.sigma_registration_mm, rig_mm))
    typed = Readings(np.array([0, FRAMES - 1]), TRUTH_MM[[0, -1]], 50.0, share=0.0)
    found = carried_wholly(track, typed)
    assert found.scale is None
    before = TIME_S < 12
    errors_mm = np.abs(found.track.distance_mm - TRUTH_MM)[before]
    assert (errors_mm <= 1.96 * found.track.sigma_distance_mm[before]).all()


def test_a_camera_that_looks_around_stands_where_the_legible_counter_says() -> None:
    standing_mm = np.minimum(TRUTH_MM, TRUTH_MM[300]) + np.maximum(TRUTH_MM - TRUTH_MM[700], 0.0)
    track = replace(track_of(np.ones(FRAMES, bool)), status=np.full(FRAMES, "lost"))
    found = carried_by(track, np.floor((standing_mm + BEGIN_MM) / 100) * 100, 100.0)
    assert found.is_read.all()
    stands = slice(300, 700)
    assert found.track.sigma_distance_mm[stands].max() < 100
    errors_mm = np.abs(found.track.distance_mm - BEGIN_MM - standing_mm)
    assert (errors_mm <= 1.96 * found.track.sigma_distance_mm).all()


@pytest.mark.parametrize("tick_mm", [10.0, 30.48, 100.0])
def test_a_counter_bridges_a_lost_stretch_and_nothing_else(tick_mm: float) -> None:
    found = carried_by(track_of(LOST), counter(tick_mm), tick_mm)
    assert not found.is_whole
    assert not found.is_read.any()
    assert np.array_equal(found.is_bridged, LOST)
    assert np.abs(found.track.distance_mm - TRUTH_MM).max() < tick_mm
    assert covered(found.track, TRUTH_MM) > 0.95
    before = TIME_S < 12
    own_mm = track_of(LOST).distance_mm
    assert found.track.distance_mm[before] == pytest.approx(own_mm[before], abs=0.01)


def test_the_way_over_a_lost_stretch_has_the_scale_of_the_camera() -> None:
    """What corrects the scale afterwards, such as joints, corrects all of the way."""
    found = carried_by(track_of(LOST, scale=0.8), counter(10.0))
    assert found.track.distance_mm == pytest.approx(0.8 * TRUTH_MM, abs=15.0)


def test_a_slip_elsewhere_does_no_harm() -> None:
    shown_mm = counter(10.0)
    shown_mm[TIME_S > 30] -= 400.0
    found = carried_by(track_of(LOST), shown_mm)
    assert np.abs(found.track.distance_mm - TRUTH_MM).max() < 15.0


def test_a_counter_carries_a_film_that_the_camera_did_not_measure() -> None:
    found = carried_by(track_of(np.ones(FRAMES, bool)), counter(10.0, share=0.003))
    assert found.is_whole
    assert found.is_read.all()
    assert found.track.distance_mm == pytest.approx(TRUTH_MM + BEGIN_MM, abs=25.0)
    assert covered(found.track, TRUTH_MM + BEGIN_MM) > 0.95


def test_a_counter_that_is_set_anew_goes_on_from_where_it_was() -> None:
    shown_mm = counter(10.0)
    shown_mm[TIME_S >= 16] -= BEGIN_MM
    found = carried_by(track_of(LOST), shown_mm)
    assert np.abs(found.track.distance_mm - TRUTH_MM).max() < 40.0


def test_the_interval_grows_where_the_counter_is_not_legible_either() -> None:
    shown_mm, lost = counter(10.0), np.ones(FRAMES, bool)
    gap = (TIME_S > 10) & (TIME_S < 14)
    shown_mm[gap | (TIME_S > 35)] = np.nan
    found = carried_by(track_of(lost), shown_mm).track
    assert found.sigma_distance_mm[300] > 5 * found.sigma_distance_mm[240]
    assert found.sigma_distance_mm[-1] > 500.0
    assert covered(found, TRUTH_MM + BEGIN_MM) > 0.99


def test_the_camera_holds_on_where_the_counter_is_not_legible() -> None:
    """The camera is lost in most frames, but not where the counter is not legible."""
    shown_mm, gap = counter(10.0), (TIME_S > 10) & (TIME_S < 14)
    shown_mm[gap] = np.nan
    found = carried_by(track_of(~((TIME_S > 8) & (TIME_S < 16))), shown_mm)
    assert found.is_whole
    assert found.track.distance_mm[gap] == pytest.approx(TRUTH_MM[gap] + BEGIN_MM, abs=12.0)


def test_a_good_camera_needs_no_counter() -> None:
    readings = Readings.of_counter(TIME_S, counter(10.0), tick_mm=10.0, share=0.005)
    assert readings is not None
    assert carry(track_of(np.zeros(FRAMES, bool)), readings) is None


@pytest.mark.parametrize(("scale", "is_wrong"), [(1.0, False), (0.98, False), (1.3, True)])
def test_a_camera_of_another_scale_contradicts_the_counter_whatever_slips(
    scale: float, *, is_wrong: bool
) -> None:
    """The rig knows its scale to 0.8 %."""
    shown_mm = counter(10.0)
    shown_mm[TIME_S > 30] -= 400.0
    readings = Readings.of_counter(TIME_S, shown_mm, tick_mm=10.0, share=0.005)
    assert readings is not None
    track = track_of(np.zeros(FRAMES, bool), scale)
    assert are_better(readings, track, has_ruler=False) == is_wrong


def test_a_counter_knows_the_scale_better_than_a_guess_and_not_than_a_calibrated_rig() -> None:
    readings = Readings.of_counter(TIME_S, 1.1 * counter(10.0), tick_mm=10.0, share=0.005)
    assert readings is not None
    track = track_of(np.zeros(FRAMES, bool))
    guessed, calibrated = (
        replace(track, sigma_distance_mm=np.hypot(own * TRUTH_MM, track.sigma_registration_mm))
        for own in (0.15, 0.003)
    )
    assert are_better(readings, guessed, has_ruler=False)
    assert not are_better(readings, calibrated, has_ruler=False)


@pytest.mark.parametrize("share", [0.0, 0.1, -0.9])
def test_a_counter_is_believed_that_moves_where_the_camera_claims_to_stand(share: float) -> None:
    """Pictures that look alike lock on each other; joints that were counted on them are wrong."""
    readings = Readings.of_counter(TIME_S, counter(10.0), tick_mm=10.0, share=0.005)
    assert readings is not None
    track = track_of(np.zeros(FRAMES, bool), share)
    assert are_better(readings, track, has_ruler=True)
    worn = track_of(np.zeros(FRAMES, bool), 0.95)
    assert not are_better(readings, worn, has_ruler=True)


def test_typed_distances_are_joined_by_straight_lines() -> None:
    rows = np.array([100, 300, 900])
    typed = Readings(rows, TRUTH_MM[rows], 50.0, share=0.0)
    found = carried_wholly(track_of(np.ones(FRAMES, bool)), typed)
    assert found.track.distance_mm[rows] == pytest.approx(TRUTH_MM[rows])
    assert found.track.distance_mm[600] == pytest.approx(TRUTH_MM[[300, 900]].mean())
    assert covered(found.track, TRUTH_MM) > 0.95


def test_between_typed_distances_the_camera_says_how_it_drove() -> None:
    rows = np.array([0, 200, 900])
    typed = Readings(rows, 1.3 * TRUTH_MM[rows], 50.0, share=0.0)
    found = carried_wholly(track_of(np.zeros(FRAMES, bool)), typed)
    assert found.track.distance_mm == pytest.approx(1.3 * TRUTH_MM, abs=5.0)


def test_readings_beyond_the_track_are_left_out() -> None:
    track = track_of(np.ones(FRAMES, bool))
    shorter = Track(**{name: values[:500] for name, values in vars(track).items()})
    readings = Readings(np.array([100, 400, 900]), np.array([1.0, 2.0, 3.0]), 5.0, share=0.0)
    found = carry(shorter, readings)
    assert found is not None
    assert len(found.track) == 500
    assert carry(shorter, replace(readings, rows=np.array([600, 700, 900]))) is None
