"""Readings are compared with the track of the same film, in the unit that the film shows."""

import numpy as np
import pytest
from tracks import make_track

from app.burnt_in.box import Box
from app.burnt_in.comparison import with_track
from app.burnt_in.counter import CounterReadings
from app.burnt_in.finder import CounterPlace
from vo_core.errors import InvalidCorrection

FRAMES = 16


def readings(unit):
    frames = np.arange(float(FRAMES))
    place = CounterPlace(Box(0, 0, 90, 20), 1, unit, has_fields=False)
    return CounterReadings(frames / 10, frames / 10, np.ones(FRAMES), place, None)


@pytest.mark.parametrize(
    ("shown", "stated", "frames", "reason"),
    [
        ("m", None, 40, "The track has a frame 39; the film ends with frame 15."),
        ("m", "ft", FRAMES, "The film shows m beside its counter, not ft."),
        ("", None, FRAMES, "state whether it is m or ft"),
    ],
)
def test_what_cannot_be_compared_is_refused(shown, stated, frames, reason):
    track = make_track(np.arange(float(frames)), np.ones(frames))
    with pytest.raises(InvalidCorrection, match=reason):
        with_track(readings(shown), track, stated)
