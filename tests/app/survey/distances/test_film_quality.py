"""The quality of a film is the share of its frames with each fault, by the checks' own limits."""

from dataclasses import replace

import numpy as np
import pytest
from reports import health_columns, track_of

from app.survey.distances.film_quality import PROBLEMS, problems_of, quality_of
from vo_core.image.health import Health

GOOD = Health(overlap=0.9, brightness=0.5, overexposed=0.0, sharpness=0.9, fixed_pattern=0.0)
BAD = {
    "too_fast": {"overlap": 0.4},
    "too_dark": {"brightness": 0.1},
    "overexposed": {"overexposed": 0.4},
    "blurred": {"sharpness": 0.2},
    "lens_dirty": {"fixed_pattern": 0.4},
}
ROWS = 1000


def health_of(problem=None, frames=0):
    poor = replace(GOOD, **BAD[problem]) if problem else GOOD
    return health_columns([poor] * frames + [GOOD] * (ROWS - frames))


def shares_of(track, health):
    found = quality_of(track, health)
    return {name: getattr(found, name) for name, _ in PROBLEMS.values()}


@pytest.mark.parametrize("problem", BAD)
@pytest.mark.parametrize(("frames", "share"), [(50, 0.05), (51, 0.051)])
def test_a_fault_counts_where_more_than_a_twentieth_of_the_frames_have_it(problem, frames, share):
    shares = shares_of(track_of(10.0, ROWS), health_of(problem, frames))
    assert shares[PROBLEMS[problem][0]] == share
    assert problems_of(shares) == ([problem] if share > 0.05 else [])


@pytest.mark.parametrize(("lost", "found"), [(10, []), (11, ["lost"])])
def test_more_than_a_hundredth_of_lost_frames_is_a_problem(lost, found):
    status = np.array(["lost"] * lost + ["weak"] * 5 + ["ok"] * (ROWS - 5 - lost))
    track = replace(track_of(10.0, ROWS), status=status)
    assert problems_of(shares_of(track, health_of())) == found
    assert quality_of(track, health_of()).weak_share == 0.005


def test_health_that_was_not_measured_is_unknown_and_no_problem():
    shares = shares_of(track_of(10.0, ROWS), health_columns([]))
    assert shares["too_fast_share"] is None
    assert problems_of(shares) == []


def test_a_survey_without_a_measured_film_has_no_quality():
    typed = replace(track_of(10.0, ROWS), sigma_distance_mm=np.zeros(ROWS), quality=np.zeros(ROWS))
    assert quality_of(typed, health_of()) is None
    assert quality_of(track_of(10.0, 0), health_columns([])) is None
