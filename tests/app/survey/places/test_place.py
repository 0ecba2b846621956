"""Places of observations, derived together and kept for a trajectory."""

from __future__ import annotations

from collections.abc import Iterator

from builders import clip_rig
from reports import track_of

from app.survey.adjustment.adjust import adjust
from app.survey.distances.stated import Stated
from app.survey.observations.tag import StatedTag
from app.survey.places.place import Anchor, Place, Trajectory, place_of, places_of
from vo_core import Rig

RAW = track_of(12.0)
ADJUSTED = adjust(RAW, Rig.parse(clip_rig()), Stated(), [])


class Cleared(dict[Anchor, Place]):
    """Places that another request clears as soon as they are kept."""

    def update(self, *given: object, **named: Place) -> None:
        super().update(*given, **named)  # type: ignore[call-overload]
        self.clear()


def tags(count: int) -> Iterator[StatedTag]:
    return (StatedTag.kept({"frame": n % len(RAW), "pixel": (n / 200, 80.0)}) for n in range(count))


def test_places_come_whatever_other_requests_do_to_the_kept_ones() -> None:
    asked = list(tags(20))
    expected = [place_of(Trajectory(ADJUSTED, RAW), tag) for tag in asked]
    assert None not in expected
    assert places_of(Trajectory(ADJUSTED, RAW, Cleared()), asked) == expected


def test_a_survey_of_very_many_tags_is_derived_once() -> None:
    trajectory, asked = Trajectory(ADJUSTED, RAW), list(tags(12_000))
    first = places_of(trajectory, asked)
    again = places_of(trajectory, asked)
    assert all(one is other for one, other in zip(first, again, strict=True))


def test_a_trajectory_keeps_a_limited_number_of_places() -> None:
    place = place_of(Trajectory(ADJUSTED, RAW), next(tags(1)))
    assert place is not None
    trajectory = Trajectory(ADJUSTED, RAW, {(frame, None): place for frame in range(20_000)})
    places_of(trajectory, list(tags(10)))
    assert len(trajectory.places) == 10
