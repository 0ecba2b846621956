"""Which of camera, joints, counter and person carries the distances of a run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders import clip_rig
from reports import track_of

from app.survey.adjustment.adjust import adjust
from app.survey.adjustment.adjusted_track import Adjusted
from app.survey.distances.notices import notices_of
from app.survey.distances.stated import Length, Stated, Typed, Zero
from vo_core import Rig, Track
from vo_core.scale.carrying import Readings

RIG = Rig.parse(clip_rig())
DRIVEN = track_of(12.0)
RAW = replace(
    DRIVEN,
    sigma_distance_mm=np.hypot(DRIVEN.sigma_registration_mm, 0.015 * DRIVEN.distance_mm),
)
"""The rig knows its scale to 1.5 %."""
LAST = len(RAW) - 1


def counter(scale: float = 1.0, zero_mm: float = 5000.0) -> Readings:
    """A counter that says `scale` times what the camera measured."""
    rows = np.arange(0, len(RAW), 3)
    way_mm = zero_mm + scale * RAW.distance_mm[rows]
    return Readings(rows, way_mm, 3.0, share=0.005, zero_sigma_mm=5.0)


def adjusted(read: Readings | None, raw: Track = RAW, **stated: Any) -> Adjusted:
    return adjust(raw, RIG, Stated(**stated), [], read)


def test_a_counter_that_agrees_changes_nothing() -> None:
    found = adjusted(counter())
    assert found.carried is None
    assert {found.source_at(frame) for frame in range(len(RAW))} == {"odometry"}
    assert found.track.distance_mm == pytest.approx(RAW.distance_mm)


def test_a_counter_that_contradicts_the_rig_carries_the_film_and_it_is_said() -> None:
    found = adjusted(counter(0.7))
    assert found.source_at(LAST) == "counter"
    assert found.track.distance_mm == pytest.approx(5000 + 0.7 * RAW.distance_mm, abs=1.0)
    (notice,) = notices_of(found)
    assert (notice.code, notice.params) == ("counter_doubts_rig", {"scale": 0.7})


def test_a_taped_length_is_believed_more_than_the_counter() -> None:
    tape = Length(first_frame=0, last_frame=LAST, length_m=RAW.distance_mm[-1] / 1000)
    found = adjusted(counter(0.7), lengths=(tape,))
    assert found.source_at(LAST) == "odometry"


def test_a_zero_is_counted_from_whoever_carries_the_distance() -> None:
    found = adjusted(counter(0.7), zero=Zero(frame=100, offset_m=1.0))
    assert found.track.distance_mm[100] == pytest.approx(1000.0)


def test_what_is_typed_is_believed_more_than_the_counter() -> None:
    typed = tuple(
        Typed(frame=frame, distance_m=0.0006 * RAW.distance_mm[frame]) for frame in (0, LAST)
    )
    found = adjusted(counter(0.7), typed=typed)
    assert found.source_at(LAST) == "typed"
    assert found.track.distance_mm == pytest.approx(0.6 * RAW.distance_mm, abs=1.0)
    assert found.distance_class() is not None


def test_lost_rows_stay_lost_for_whoever_asks_for_the_track() -> None:
    lost = replace(RAW, status=np.full(len(RAW), "lost"))
    found = adjusted(counter(), lost)
    assert found.source_at(LAST) == "counter"
    assert set(found.track.status) == {"lost"}


def test_a_known_length_scales_what_the_counter_says() -> None:
    lost = replace(RAW, status=np.full(len(RAW), "lost"))
    length_m = 1.003 * RAW.distance_mm[-1] / 1000
    known = Length(first_frame=0, last_frame=LAST, length_m=length_m, kind="known")
    found = adjusted(counter(), lost, lengths=(known,))
    way_mm = np.ptp(found.track.distance_mm)
    assert way_mm == pytest.approx(1000 * length_m, abs=1.0)
    assert found.closure is not None
