"""Whether the stated interval is true: figures by construction, and one film with a few rigs."""

from dataclasses import replace

import numpy as np
import pytest

from app.lab.intervals import Stated, Trial, calibration, films, plot, run_trials, to_markdown
from app.lab.simulation import SCENARIOS


def drawn(sigma_mm: float, stated_mm: float, runs: int = 4000) -> list[tuple[Stated, float]]:
    """Normal errors of `sigma_mm` that are stated to be `stated_mm`, on ways of 2 m."""
    errors_mm = np.random.default_rng(1).normal(0, sigma_mm, runs)
    return [(Stated(float(error_mm), stated_mm), 2000.0) for error_mm in errors_mm]


def test_honest_sigma_holds_what_it_is_meant_to_hold():
    result = calibration(drawn(20.0, 20.0))
    assert result.runs == 4000
    assert result.inside == pytest.approx((0.68, 0.95), abs=0.02)
    assert result.sigma_percent == pytest.approx(1.0)
    assert result.error_percent == pytest.approx(0.674, abs=0.03)  # median of |N(0, 1)|


def test_sigma_that_is_too_small_or_too_wide_is_seen():
    small, wide = (calibration(drawn(20.0, stated)).inside for stated in (5.0, 80.0))
    assert small[0] < 0.25
    assert wide[0] > 0.99


@pytest.fixture(scope="module")
def trials():
    calls = []
    film = replace(
        SCENARIOS["nominal"], length_mm=120.0, speed_mm_s=600.0, acceleration_mm_s2=2400.0
    )
    found = run_trials([film], 3, lambda *call: calls.append(call))
    assert [done for _, done, _ in calls] == [0, 1, 2, 3]
    assert {total for *_, total in calls} == {3}
    return found


def test_one_film_is_tracked_with_several_rigs(trials):
    assert len({trial.raw for trial in trials}) == 3
    for trial in trials:
        assert trial.film == "nominal"
        assert trial.path_mm == pytest.approx(120, abs=2)
        assert 0 < abs(trial.raw.error_mm) < 4 * trial.raw.sigma_mm
        assert trial.joined is None  # no joint lies on this way


def test_runs_before_and_after_the_joints_have_their_own_lines(trials):
    joined = replace(trials[0], joined=Stated(error_mm=0.12, sigma_mm=0.24))
    text = to_markdown([joined, *trials[1:]])
    assert "| nominal | 3 |" in text
    assert "| nominal, with joints | 1 | 100% | 100% | 0.20 | 0.10 |" in text
    assert "| all | 3 |" in text
    assert "In 2 of 3 runs the joints cannot be counted." in text


@pytest.mark.parametrize("joined", [None, Stated(0.1, 0.2)])
def test_plot_is_a_picture(tmp_path, joined):
    plot([Trial("nominal", 2000.0, Stated(5.0, 10.0), joined)], tmp_path / "intervals.png")
    assert (tmp_path / "intervals.png").read_bytes().startswith(b"\x89PNG")


def test_films_pass_two_joints():
    for film in films():
        segment_mm = film.rig.pipe.segment_length_mm
        assert film.first_joint_mm + segment_mm < film.length_mm
