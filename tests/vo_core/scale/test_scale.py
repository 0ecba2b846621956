"""Corrections of a finished track: known lengths, joints, and all of it together."""

from dataclasses import replace

import numpy as np
import pytest
from films import film
from textures import make_rig
from tracks import SEGMENT_MM, TRUE_MM, make_track, ring

from app.lab.simulation import SCENARIOS
from vo_core import Odometry, Track
from vo_core.errors import InvalidCorrection
from vo_core.geometry.height import implied_height
from vo_core.joints.finder import JointFinder
from vo_core.joints.sightings import Sighting
from vo_core.scale.correction import correct, joint_spacing, zeroed
from vo_core.scale.evidence import JointSpacing, KnownLength, StatedScale


def drifting(rng, true_mm, scale, walk_mm):
    """A track with a scale and a random walk that it states; `walk_mm` is its sigma at the end."""
    count = len(true_mm)
    steps = rng.normal(0, walk_mm / np.sqrt(count - 1), count - 1)
    drift = np.concatenate([[0], np.cumsum(steps)])
    sigma = walk_mm * np.sqrt(np.arange(count) / (count - 1))
    return make_track((true_mm - drift) / scale, sigma)


PERFECT = make_track(TRUE_MM / 1.01, np.zeros(301))


def test_one_length_scales_the_whole_track():
    done = correct(PERFECT, [KnownLength(0, 300, 6000.0, 3.0)])
    assert done.scale == pytest.approx(1.01)
    assert done.sigma == pytest.approx(1.01 * 3 / 6000, rel=1e-6)
    assert done.track.distance_mm == pytest.approx(TRUE_MM)
    assert done.track.x_mm == pytest.approx(TRUE_MM)
    assert done.track.y_mm == pytest.approx(1.01 * PERFECT.y_mm)
    assert done.track.sigma_distance_mm == pytest.approx(3 * TRUE_MM / 6000, abs=1e-6)
    for same in ("frame", "time_s", "yaw_deg", "quality", "status"):
        assert np.array_equal(getattr(done.track, same), getattr(PERFECT, same))
    assert PERFECT.distance_mm[-1] == pytest.approx(6000 / 1.01)


@pytest.mark.parametrize("frames", [(50, 250), (250, 50)])
def test_a_length_between_any_two_frames_in_any_order(frames):
    done = correct(PERFECT, [KnownLength(*frames, 4000.0)])
    assert done.scale == pytest.approx(1.01)


def test_backwards_is_scaled_too():
    done = correct(
        replace(PERFECT, distance_mm=-PERFECT.distance_mm), [KnownLength(0, 300, 6000.0)]
    )
    assert done.scale == pytest.approx(1.01)
    assert done.track.distance_mm[-1] == pytest.approx(-6000)


def test_at_the_end_of_a_length_the_track_is_as_certain_as_the_tape():
    rng = np.random.default_rng(1)
    track = drifting(rng, TRUE_MM, 1.0, walk_mm=20.0)
    done = correct(track, [KnownLength(0, 300, 6000.0, 2.0)])
    assert done.track.distance_mm[-1] == pytest.approx(6000)
    assert done.track.sigma_distance_mm[-1] == pytest.approx(2, abs=0.01)
    # Between two known ends a random walk is a bridge: sigma sqrt(t (1 - t)).
    assert done.track.sigma_distance_mm[150] == pytest.approx(np.hypot(20 / 2, 2 / 2), rel=0.01)


def test_lengths_are_weighted_by_their_uncertainty():
    done = correct(PERFECT, [KnownLength(0, 300, 6002.0, 1.0), KnownLength(0, 300, 5996.0, 2.0)])
    assert done.scale * 6000 / 1.01 == pytest.approx((6002 / 1 + 5996 / 4) / (1 + 1 / 4))
    assert done.track.sigma_distance_mm[-1] == pytest.approx(1 / np.sqrt(1 + 1 / 4))
    assert [finding.scale for finding in done.findings] == pytest.approx(
        [1.01 * 6002 / 6000, 1.01 * 5996 / 6000]
    )
    assert [left.residual_mm for left in done.residuals] == pytest.approx([1.2, -4.8])


def test_the_uncertainty_of_the_rig_is_a_term_of_its_own():
    track = make_track(TRUE_MM, np.full(301, 2.0) * (TRUE_MM > 0))
    done = correct(track, [StatedScale(0.005)])
    assert done.track.distance_mm == pytest.approx(TRUE_MM)
    assert done.track.sigma_distance_mm[-1] == pytest.approx(np.hypot(2, 30))


def test_a_good_length_outweighs_a_rig_that_is_known_badly():
    done = correct(PERFECT, [StatedScale(0.01), KnownLength(0, 300, 6000.0, 1.0)])
    assert done.scale == pytest.approx(1.01, abs=1e-5)
    assert done.sigma == pytest.approx(1.01 / 6000, rel=0.01)


def test_stated_uncertainties_are_honest():
    rng = np.random.default_rng(2)
    scale_errors, distance_errors = [], []
    for _ in range(200):
        track = drifting(rng, TRUE_MM, 0.98, walk_mm=8.0)
        lengths = [
            KnownLength(first, last, TRUE_MM[last] - TRUE_MM[first] + rng.normal(0, 4), 4.0)
            for first, last in ((0, 100), (80, 290))
        ]
        done = correct(track, lengths)
        scale_errors.append((done.scale - 0.98) / done.sigma)
        error = done.track.distance_mm - TRUE_MM
        distance_errors.append((error / np.maximum(done.track.sigma_distance_mm, 1e-9))[[60, 300]])
    assert np.std(scale_errors) == pytest.approx(1, abs=0.15)
    assert np.std(distance_errors, axis=0) == pytest.approx(np.ones(2), abs=0.15)


@pytest.mark.parametrize(
    ("length", "said"),
    [
        (KnownLength(0, 301, 6000.0), "no frame 301 in the track; it has frames 0 to 300"),
        (KnownLength(0, 300, 0.0), "must be above 0"),
        (KnownLength(0, 300, 6000.0, 0.0), "must be above 0"),
        (KnownLength(0, 300, 600.0), "cannot be right: the track has 5.941 m there"),
        (KnownLength(7, 7, 10.0), "cannot be right: the track has 0.000 m there"),
    ],
)
def test_a_length_that_does_not_fit_is_refused(length, said):
    with pytest.raises(InvalidCorrection, match=said):
        correct(PERFECT, [length])


def test_a_mark_in_a_lost_frame_is_refused():
    status = ["ok"] * 300 + ["lost"]
    track = make_track(TRUE_MM, np.zeros(301), status)
    with pytest.raises(InvalidCorrection, match="not recognised in frame 300"):
        correct(track, [KnownLength(0, 300, 6000.0)])


def test_from_a_zero_frame_only_the_way_from_there_is_uncertain():
    track = make_track(TRUE_MM, 20.0 * np.sqrt(TRUE_MM / 6000))
    done = correct(track, [StatedScale(0.005)], zero_frame=100)
    assert done.track.distance_mm == pytest.approx(TRUE_MM - 2000)
    assert done.track.x_mm == pytest.approx(TRUE_MM - 2000)
    assert done.track.sigma_distance_mm[100] == 0
    way_mm = TRUE_MM - 2000
    by_hand = np.hypot(20 * np.sqrt(np.abs(way_mm) / 6000), 0.005 * way_mm)
    assert done.track.sigma_distance_mm == pytest.approx(by_hand, abs=1e-6)
    counted = zeroed(track, 100)
    assert counted.distance_mm == pytest.approx(TRUE_MM - 2000)
    assert counted.sigma_distance_mm == pytest.approx(20 * np.sqrt(np.abs(way_mm) / 6000))


def test_uncertainties_from_a_zero_frame_are_honest():
    rng = np.random.default_rng(5)
    errors = []
    for _ in range(200):
        track = drifting(rng, TRUE_MM, 0.98, walk_mm=8.0)
        length = KnownLength(30, 250, TRUE_MM[250] - TRUE_MM[30] + rng.normal(0, 4), 4.0)
        done = correct(track, [length, StatedScale(0.02)], zero_frame=120)
        error = done.track.distance_mm - (TRUE_MM - TRUE_MM[120])
        errors.append((error / np.maximum(done.track.sigma_distance_mm, 1e-9))[[10, 180, 300]])
    assert np.std(errors, axis=0) == pytest.approx(np.ones(3), abs=0.15)


def test_a_zero_frame_that_is_not_there_is_refused():
    for use in (zeroed, lambda track, frame: correct(track, [StatedScale(0.01)], zero_frame=frame)):
        with pytest.raises(InvalidCorrection, match="no frame 301"):
            use(PERFECT, 301)


def test_no_evidence_is_refused():
    with pytest.raises(InvalidCorrection, match="Nothing was given"):
        correct(PERFECT, [])
    with pytest.raises(InvalidCorrection, match="above 0"):
        correct(PERFECT, [StatedScale(0.0)])
    with pytest.raises(InvalidCorrection, match="it has no frames"):
        correct(Track.from_estimates([]), [KnownLength(0, 1, 10.0)])


def test_a_contradiction_names_both_sides():
    with pytest.raises(InvalidCorrection) as refused:
        correct(PERFECT, [KnownLength(0, 300, 6000.0, 2.0), KnownLength(0, 150, 3100.0, 2.0)])
    assert "6 m ± 2 mm between frames 0 and 300" in str(refused.value)
    assert "3.1 m ± 2 mm between frames 0 and 150" in str(refused.value)


def test_joints_correct_scale_and_drift_and_their_scatter_is_reported():
    rng = np.random.default_rng(3)
    true_mm = np.linspace(0, 30_000, 1501)
    errors, scale_errors, scatters = [], [], []
    for _ in range(30):
        track = drifting(rng, true_mm, 1.01, walk_mm=10.0)
        joints_mm = 400 + np.concatenate([[0], np.cumsum(rng.normal(SEGMENT_MM, 4, 19))])
        frames = np.searchsorted(true_mm, joints_mm) - 1
        sightings = [
            Sighting(int(f), float((at - true_mm[f]) / 1.01 + rng.normal(0, 0.2)), 0.2, -0.3)
            for at, f in zip(joints_mm, frames, strict=True)
        ]
        done = correct(track, [joint_spacing(track, sightings, SEGMENT_MM, segment_sigma_mm=0)])
        scale_errors.append((done.scale - 1.01) / done.sigma)
        scatters.append(done.scatter_mm)
        errors.append((done.track.distance_mm - true_mm)[-1] / done.track.sigma_distance_mm[-1])
        assert len(done.residuals) == len(sightings)
    assert np.median(scatters) == pytest.approx(4, rel=0.25)
    assert np.std(scale_errors) == pytest.approx(1, abs=0.4)
    assert np.std(errors) == pytest.approx(1, abs=0.4)


def test_a_stretch_without_a_lock_takes_up_what_the_joints_ask_for():
    true_mm = np.linspace(0, 9000, 901)
    after = np.arange(901) > 450
    track = make_track(true_mm - 80.0 * after, np.where(after, 60.0, 0.2))
    joints_mm = 400 + SEGMENT_MM * np.arange(6)
    frames = np.searchsorted(true_mm, joints_mm) - 1
    sightings = [ring(track, at - 80.0 * after[f], int(f)) for at, f in zip(joints_mm, frames)]  # noqa: B905
    done = correct(track, [joint_spacing(track, sightings, SEGMENT_MM)])
    error = np.abs(done.track.distance_mm - true_mm)
    assert error.max() < 5
    assert (error <= 3 * done.track.sigma_distance_mm + 0.01).all()


def test_a_lock_after_a_loss_takes_its_doubt_back():
    sigma = np.where((np.arange(301) > 100) & (np.arange(301) < 110), 50.0, 0.5)
    track = make_track(TRUE_MM / 1.01, sigma * (TRUE_MM > 0))
    done = correct(track, [KnownLength(0, 300, 6000.0, 1.0)])
    assert done.track.sigma_distance_mm[105] == pytest.approx(50 * 1, rel=0.1)
    assert done.track.sigma_distance_mm[150] < 1.5


def test_joints_and_a_length_that_contradict_each_other_are_rejected():
    sightings = [
        ring(PERFECT, at / 1.01, int(np.searchsorted(TRUE_MM, at)))
        for at in (400, 1900, 3400, 4900)
    ]
    length = KnownLength(0, 300, 6120.0, 3.0)
    spacing = joint_spacing(PERFECT, sightings, SEGMENT_MM, [length])
    assert isinstance(spacing, JointSpacing)
    with pytest.raises(InvalidCorrection, match=r"6.12 m ± 3 mm .* 4 joints 1500 mm apart"):
        correct(PERFECT, [length, spacing])


LONG = replace(
    SCENARIOS["nominal"].shortened(6000),
    speed_mm_s=1500.0,
    acceleration_mm_s2=3000.0,
    rig=make_rig(
        camera={"width": 320, "height": 240, "fx": 597.0, "fy": 597.0, "cx": 159.5, "cy": 119.5}
    ),
)


@pytest.fixture(scope="module")
def long_run():
    return film(LONG)


@pytest.mark.parametrize("factor", [0.99, pytest.param(1.01, marks=pytest.mark.long)])
def test_joints_of_a_rendered_pipe_put_a_wrong_height_right(long_run, factor):
    wrong = make_rig(camera=LONG.rig.camera.model_dump(), mount={"height_mm": factor * 230.0})
    odometry, finder, estimates = Odometry(wrong), JointFinder(wrong), []
    for frame in long_run:
        estimates.append(odometry.step(frame.image, frame.t_s))
        finder.add(frame.image, estimates[-1])
    raw, true_mm = Track.from_estimates(estimates), np.array([f.x_mm for f in long_run])
    assert np.abs(raw.distance_mm - true_mm).max() > 50
    spacing = joint_spacing(raw, finder.finish(), SEGMENT_MM, segment_sigma_mm=0)
    done = correct(raw, [spacing])
    error = np.abs(done.track.distance_mm - true_mm)
    assert [joint.number for joint in spacing.joints] == list(range(4))
    assert error.max() < 3
    assert (error <= 3 * done.track.sigma_distance_mm + 0.01).mean() > 0.99
    assert max(abs(left.residual_mm) for left in done.residuals) < 1.5
    height = implied_height(wrong, done.scale, done.sigma)
    assert height.height_mm == pytest.approx(230, abs=3 * height.sigma_mm)
    assert height.sigma_mm < 0.2
