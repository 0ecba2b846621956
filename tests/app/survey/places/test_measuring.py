"""Sizes on the wall from pixels, against points whose place is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import cos, radians, sin

import numpy as np
import pytest
from pydantic import ValidationError
from tracks import straight_track

from app.lab.simulation import SCENARIOS
from app.lab.simulation.rigs import drawn_rigs
from app.survey.adjustment.adjust import adjust
from app.survey.distances.stated import Stated
from app.survey.places.measure import Figure, Measure
from app.survey.places.measuring import figure_of
from app.survey.places.place import Trajectory
from vo_core import Rig, Track
from vo_core.geometry.wall import Pose, robot_pixels, sight

Point = tuple[float, float, float]
DOWN = SCENARIOS["nominal"].rig
WIDE = SCENARIOS["wide_lens"].rig
FORWARD = next(
    scenario.rig for scenario in SCENARIOS.values() if scenario.rig.mount.view == "forward"
)
RADIUS_MM = 150.0
DRIVEN_MM = 10.0


def track(frames: int = 20) -> Track:
    """A track that sways and turns, in steps of `DRIVEN_MM`."""
    number = np.arange(frames)
    return replace(
        straight_track(DRIVEN_MM * number), y_mm=np.sin(number), yaw_deg=0.5 * np.cos(number)
    )


def trajectory_of(rig: Rig) -> Trajectory:
    return Trajectory(adjust(track(), rig, Stated(), []), track())


def on_wall(rig: Rig, x_mm: float, clock_h: float, radius_mm: float | None = None) -> Point:
    phi = radians(180 - 30 * clock_h)
    radius = radius_mm if radius_mm is not None else (rig.pipe.diameter_mm or 0) / 2
    return x_mm, radius * sin(phi), radius * cos(phi)


def shown(rig: Rig, frame: int, point: Point) -> dict[str, object]:
    """Return the pixel that shows a point of the world in a frame."""
    row, trajectory = track(), trajectory_of(rig)
    estimates = trajectory.estimates(frame)
    assert estimates is not None
    pose: Pose = estimates[0].pose
    (pixel,) = robot_pixels(rig, sight(rig, pose, np.array([point])))
    assert np.isfinite(pixel).all()
    assert frame < len(row)
    return {"frame": frame, "pixel": pixel.tolist()}


def measured(
    trajectory: Trajectory,
    kind: str,
    points: Sequence[tuple[int, Point]],
    seen_by: Rig | None = None,
) -> Figure | None:
    rig = seen_by or trajectory.adjusted.rig
    fields = {"kind": kind, "points": [shown(rig, frame, point) for frame, point in points]}
    return figure_of(trajectory, Measure.model_validate(fields))


@pytest.mark.parametrize("rig", [DOWN, WIDE, FORWARD], ids=["down", "wide", "forward"])
def test_line_along_the_wall_is_as_long_as_a_tape_says(rig: Rig) -> None:
    ahead = 300.0 if rig is FORWARD else 30.0
    corners = [(ahead, 6.0), (ahead + 20, 6.0), (ahead + 20, 5.8)]
    points = [(3, on_wall(rig, *corner)) for corner in corners]
    found = measured(trajectory_of(rig), "length", points)
    radius_mm = (rig.pipe.diameter_mm or 0) / 2
    assert found is not None
    assert found.value == pytest.approx(20 + radians(6) * radius_mm, rel=1e-4)


def test_area_is_that_of_the_developed_wall() -> None:
    corners = [(35, 6.1), (35, 5.9), (55, 5.9), (55, 6.1)]
    found = measured(trajectory_of(DOWN), "area", [(4, on_wall(DOWN, *place)) for place in corners])
    assert found is not None
    assert (found.value, found.kind) == (
        pytest.approx(20 * radians(6) * RADIUS_MM, rel=1e-4),
        "area",
    )


def test_line_over_several_frames_has_a_wider_interval() -> None:
    trajectory = trajectory_of(DOWN)
    near = measured(trajectory, "length", [(3, on_wall(DOWN, 20, 6)), (3, on_wall(DOWN, 50, 6))])
    far = measured(trajectory, "length", [(3, on_wall(DOWN, 20, 6)), (15, on_wall(DOWN, 170, 6))])
    assert near is not None
    assert far is not None
    assert far.value == pytest.approx(150, abs=0.01)
    assert far.u95 > near.u95


def test_gap_of_a_joint_counts_only_along_the_pipe() -> None:
    points = [(3, on_wall(DOWN, 30, 6.1)), (3, on_wall(DOWN, 42, 5.9))]
    found = measured(trajectory_of(DOWN), "gap", points)
    assert found is not None
    assert found.value == pytest.approx(12, abs=1e-3)


def test_step_at_a_joint_is_how_far_the_edge_stands_into_the_pipe() -> None:
    radius_mm = (FORWARD.pipe.diameter_mm or 0) / 2
    edge = on_wall(FORWARD, 400, 5, radius_mm - 15)
    found = measured(trajectory_of(FORWARD), "step", [(3, on_wall(FORWARD, 400, 5)), (3, edge)])
    assert found is not None
    assert found.value == pytest.approx(15, abs=0.01)


@pytest.mark.parametrize("half_deg", [20, 100])
def test_depth_of_a_bed_is_what_its_chord_cuts_off(half_deg: float) -> None:
    rig = FORWARD
    hours = half_deg / 30
    # A robot that leans sees the bed leaning: one edge higher than the other.
    edges = [(3, on_wall(rig, 500, 6.2 + hours)), (3, on_wall(rig, 500, 6.2 - hours))]
    found = measured(trajectory_of(rig), "depth", edges)
    share = (1 - cos(radians(half_deg))) / 2
    assert found is not None
    assert found.percent == pytest.approx(100 * share, abs=0.01)
    assert found.value == pytest.approx(share * (rig.pipe.diameter_mm or 0), rel=1e-3)


def test_a_corrected_track_corrects_what_is_measured() -> None:
    points = [(3, on_wall(DOWN, 30, 6)), (3, on_wall(DOWN, 50, 6))]
    plain = trajectory_of(DOWN)
    closed = replace(plain.adjusted, scale=1.1, scale_sigma=0.002, source="closure")
    before, after = (
        measured(trajectory, "length", points)
        for trajectory in (plain, Trajectory(closed, track()))
    )
    assert before is not None
    assert after is not None
    assert after.value == pytest.approx(22, rel=1e-4)
    assert after.u95 < 1.1 * before.u95


def test_stated_intervals_cover_wrong_rigs_and_missed_clicks() -> None:
    rng, hits, trials = np.random.default_rng(3), 0, 100
    places = [on_wall(DOWN, 20, 6.1), on_wall(DOWN, 55, 5.9)]
    true_mm = float(np.hypot(35, radians(6) * RADIUS_MM))
    pixels = np.array([shown(DOWN, 3, place)["pixel"] for place in places])
    rigs = drawn_rigs(DOWN, 1)
    for _ in range(trials):
        clicked = pixels + rng.normal(0, 1, pixels.shape)
        fields = {"kind": "width", "points": [{"frame": 3, "pixel": p.tolist()} for p in clicked]}
        found = figure_of(trajectory_of(next(rigs)), Measure.model_validate(fields))
        assert found is not None
        hits += abs(found.value - true_mm) <= found.u95
    assert 0.9 <= hits / trials <= 0.99


def test_a_picture_that_cannot_show_it_gives_no_figure() -> None:
    below = trajectory_of(Rig.parse({**DOWN.model_dump(), "pipe": {"shape": "flat"}}))
    places = [(3, (30.0, 0.0, 0.0)), (3, (50.0, 0.0, 0.0))]
    assert measured(below, "depth", places) is None
    assert measured(below, "length", places) is not None


@pytest.mark.parametrize(("kind", "count"), [("width", 3), ("area", 2), ("depth", 3)])
def test_a_measure_has_the_points_that_its_kind_needs(kind: str, count: int) -> None:
    point = {"frame": 0, "pixel": [1.0, 1.0]}
    with pytest.raises(ValidationError, match=f"{kind} needs"):
        Measure.model_validate({"kind": kind, "points": [point] * count})
