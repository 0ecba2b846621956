"""From a place on the wall to the frame that shows it, and back."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from textures import make_rig

from app.errors import IncompleteWallPoint
from app.inspections.picking import SeenAt, WallPlace, length_between, seen_best
from app.survey.adjustment.adjust import adjust
from app.survey.distances.stated import Length, Stated
from app.survey.places.place import Trajectory, wall_under
from vo_core import Rig, Track

FRAMES = 400
DOWN = make_rig()
FLOOR = make_rig(pipe={"shape": "flat", "diameter_mm": None})
TURNED = make_rig(mount={"rotation_deg": 90.0, "pitch_deg": 10.0, "lateral_mm": 8.0})
FORWARD = make_rig(
    camera={"model": "fisheye", "fx": 250.0, "fy": 250.0},
    mount={"view": "forward", "height_mm": 150.0},
)


def make_track(x_mm: ArrayLike, **columns: Any) -> Track:
    x = np.asarray(x_mm, np.float64)
    n = len(x)
    wobble = np.sin(np.arange(n) / 30)
    fields = {
        "frame": np.arange(n),
        "time_s": np.arange(n) / 30,
        "x_mm": x,
        "y_mm": 5 * wobble,
        "yaw_deg": wobble,
        "distance_mm": x,
        "sigma_distance_mm": np.full(n, 1.0),
        "quality": np.full(n, 0.9),
        "status": np.full(n, "ok"),
        "sigma_registration_mm": np.full(n, 1.0),
        **dict.fromkeys(("z_mm", "pitch_deg", "roll_deg", "looking_around"), np.zeros(n)),
    }
    return Track(**fields | columns)


def make_trajectory(rig: Rig, track: Track, stated: Stated = Stated()) -> Trajectory:  # noqa: B008
    return Trajectory(adjust(track, rig, stated, []), track)


def drive(rig: Rig, stated: Stated = Stated()) -> Trajectory:  # noqa: B008
    """2 m forward, 5 mm a frame."""
    return make_trajectory(rig, make_track(5.0 * np.arange(FRAMES)), stated)


def place_of(trajectory: Trajectory, frame: int, pixel: tuple[float, float]) -> WallPlace:
    seen = wall_under(trajectory, frame, pixel)
    assert seen is not None
    return WallPlace(
        seen.distance_mm, seen.clock_h, seen.lateral_mm if seen.clock_h is None else None
    )


RIGS = {"down": DOWN, "floor": FLOOR, "turned": TURNED, "forward": FORWARD}


@cache
def trajectory_of(name: str, stated: Stated) -> Trajectory:
    """Adjusted once for all examples."""
    return drive(RIGS[name], stated)


@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize(
    "stated",
    [
        Stated(),
        Stated(
            lengths=(
                Length(
                    first_frame=0, last_frame=FRAMES - 1, length_m=2.1, sigma_mm=3.0, kind="tape"
                ),
            )
        ),
    ],
    ids=["raw", "corrected"],
)
@given(frame=st.integers(80, 300), across=st.floats(0.1, 0.9), along=st.floats(0.1, 0.9))
def test_pixel_that_is_found_shows_the_place_that_was_asked_for(
    name: str, stated: Stated, frame: int, across: float, along: float
) -> None:
    rig, trajectory = RIGS[name], trajectory_of(name, stated)
    pixel = (across * (rig.camera.width - 1), along * (rig.camera.height - 1))
    # Nearer to the middle a camera that looks ahead shows wall too far away to be seen well.
    assume(rig is not FORWARD or np.hypot(pixel[0] - 319.5, pixel[1] - 239.5) >= 180)
    asked = place_of(trajectory, frame, pixel)

    seen = seen_best(trajectory, asked, None)

    assert seen is not None
    found = place_of(trajectory, seen.frame, seen.pixel)
    assert found.distance_mm == pytest.approx(asked.distance_mm, abs=0.01)
    if asked.clock_h is None:
        assert found.lateral_mm == pytest.approx(asked.lateral_mm, abs=0.01)
    else:
        around = ((found.clock_h or 0.0) - asked.clock_h + 6) % 12 - 6
        assert around == pytest.approx(0, abs=1e-3)


def test_camera_that_looks_down_shows_it_best_in_the_middle() -> None:
    trajectory = drive(DOWN)
    seen = seen_best(trajectory, place_of(trajectory, 200, (30.0, 240.0)), None)

    assert seen is not None
    assert abs(seen.pixel[0] - 319.5) < 1194 / 230 * 5  # a frame further is 5 mm on
    assert seen.frame < 200  # the left of the picture lies behind the camera


def test_camera_that_looks_ahead_shows_it_best_from_near() -> None:
    seen = seen_best(drive(FORWARD), WallPlace(1500.0, 9.0, None), None)

    assert seen is not None
    ahead_mm = 1500 - 5 * seen.frame
    assert 50 < ahead_mm < 400
    assert seen.pixel[0] < 319.5


def passes(**columns: Any) -> Trajectory:
    """Forward, back and forward again over the same metre."""
    once = 5.0 * np.arange(200)
    return make_trajectory(DOWN, make_track([*once, *once[::-1], *once], **columns))


@pytest.mark.parametrize(("near_frame", "first"), [(0, 0), (260, 200), (599, 400), (2**31, 400)])
def test_of_several_passes_the_nearest_counts(near_frame: int, first: int) -> None:
    seen = seen_best(passes(), WallPlace(500.0, 6.0, None), near_frame)

    assert seen is not None
    assert first <= seen.frame < first + 200


def test_measured_frame_comes_before_a_weak_and_a_lost_one() -> None:
    status = np.full(600, "lost")
    status[200:400] = "weak"
    place = WallPlace(500.0, 6.0, None)
    weak = seen_best(passes(status=status), place, 10)
    status[400:] = "ok"
    measured = seen_best(passes(status=status), place, 10)

    assert weak is not None
    assert 200 <= weak.frame < 400
    assert measured is not None
    assert measured.frame >= 400


@pytest.mark.parametrize(
    ("distance_mm", "clock"), [(-500.0, 6.0), (2500.0, 6.0), (1000.0, 12.0), (1000.0, 9.0)]
)
def test_place_that_no_frame_shows_is_not_found(distance_mm: float, clock: float) -> None:
    assert seen_best(drive(DOWN), WallPlace(distance_mm, clock, None), None) is None


def test_nothing_is_found_in_an_empty_track() -> None:
    trajectory = make_trajectory(DOWN, Track.from_estimates(()))
    assert seen_best(trajectory, WallPlace(0.0, 6.0, None), 5) is None


@pytest.mark.parametrize(
    ("rig", "place"),
    [(DOWN, WallPlace(1000.0, None, 4.0)), (FLOOR, WallPlace(1000.0, 6.0, None))],
)
def test_place_needs_the_coordinate_around_its_wall(rig: Rig, place: WallPlace) -> None:
    with pytest.raises(IncompleteWallPoint, match="needs"):
        seen_best(drive(rig), place, None)


def test_standing_robot_is_one_pass() -> None:
    trajectory = make_trajectory(DOWN, make_track(np.full(50_000, 100.0), y_mm=np.zeros(50_000)))
    assert isinstance(seen_best(trajectory, WallPlace(100.0, 6.0, None), 40_000), SeenAt)


@pytest.mark.parametrize("tape_m", [1.995, 2.1])
def test_a_line_between_two_places_has_the_length_of_the_corrected_wall(tape_m: float) -> None:
    trajectory = trajectory_of(
        "down",
        Stated(
            lengths=(
                Length(
                    first_frame=0, last_frame=FRAMES - 1, length_m=tape_m, sigma_mm=3.0, kind="tape"
                ),
            )
        ),
    )
    radius_mm = DOWN.pipe.diameter_mm / 2 * tape_m / 1.995  # type: ignore[operator]
    start = WallPlace(1000.0, 6.0, None)
    along = length_between(trajectory, start, WallPlace(1400.0, 6.0, None))
    around = length_between(trajectory, start, WallPlace(1000.0, 6.4, None))
    assert along is not None
    assert around is not None
    assert along.value == pytest.approx(400, rel=1e-3)
    assert around.value == pytest.approx(radius_mm * np.radians(12), rel=1e-3)
    assert 0 < min(around.u95, along.u95) < 5
    assert length_between(trajectory, start, WallPlace(9000.0, 6.0, None)) is None
