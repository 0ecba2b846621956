"""What an interval is made of, on a track of which the truth is known."""

from __future__ import annotations

import numpy as np
import pytest
from builders import clip_rig
from reports import track_of

from app.survey.adjustment.adjust import adjust
from app.survey.distances.interval import U95
from app.survey.distances.stated import Length, RigSigma, Stated, Zero
from app.survey.distances.uncertainty_budget import UncertaintyBudget, budget_of
from vo_core import Rig
from vo_core.geometry.height import scale_effects

RAW = track_of(12.0)
RIG = Rig.parse(clip_rig())
LAST = len(RAW) - 1


def made_of(stated: Stated, frame: int = LAST) -> UncertaintyBudget:
    found = budget_of(adjust(RAW, RIG, stated, []), RAW, frame)
    assert found is not None
    return found


def test_the_parts_of_an_interval_add_up_to_what_the_track_states() -> None:
    found = made_of(Stated())
    squares = sum(part.half_width_m**2 for part in found.parts)
    assert np.sqrt(squares) == pytest.approx(found.half_width_m, rel=0.02)
    assert found.parts[0].name == "height"
    by_height_m = U95 * 12 * abs(scale_effects(RIG).height)
    assert found.parts[0].half_width_m == pytest.approx(by_height_m, rel=0.01)
    assert {part.name for part in found.parts} == {"height", "focal", "tracking"}


def test_a_tape_is_recommended_with_what_it_would_make_of_the_interval() -> None:
    before = made_of(Stated())
    assert before.taped is not None
    assert before.taped.length_m == 5.0
    at = int(np.searchsorted(RAW.distance_mm, 5000))
    taped = Length(
        first_frame=0, last_frame=at, length_m=RAW.distance_mm[at] / 1000, sigma_mm=5.0, kind="tape"
    )
    after = made_of(Stated(lengths=(taped,)))
    assert after.half_width_m == pytest.approx(before.taped.half_width_m, abs=0.002)
    assert after.half_width_m < before.half_width_m / 3
    assert after.taped is None
    assert after.parts[0].name in ("tape", "tracking")


def test_beside_the_zero_there_is_nothing_to_tape() -> None:
    found = made_of(Stated(zero=Zero(frame=LAST, offset_m=3.0)))
    assert (found.distance_m, found.half_width_m, found.taped) == (3.0, 0.01, None)


def test_what_was_stated_of_the_rig_counts() -> None:
    found = made_of(Stated(rig_sigma=RigSigma(height_mm=0.1)))
    assert found.half_width_m < made_of(Stated()).half_width_m / 2
    assert "focal" not in {part.name for part in found.parts}
