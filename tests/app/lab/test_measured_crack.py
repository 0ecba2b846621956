"""Measures against defects of known size in rendered pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from numpy.typing import NDArray
from tracks import straight_track

from app.lab.simulation import SCENARIOS, render
from app.lab.simulation.defects import Defect, draw_defects
from app.survey.adjustment.adjust import adjust
from app.survey.distances.stated import Stated
from app.survey.places.measure import Figure, Measure
from app.survey.places.measuring import figure_of
from app.survey.places.place import Trajectory
from vo_core import Track

LENGTH_MM = 60.0
TEXEL_MM = 0.2
PAST = 6
"""Frame that is measured: the robot has moved and swayed by then."""
Pixels = NDArray[np.float64]


def seen(name: str, crack: Defect) -> tuple[Pixels, Trajectory]:
    """Return how much a crack darkens each pixel of a picture, 0 to 1, with the true trajectory."""
    clean = replace(
        SCENARIOS[name],
        noise_grey=0.0,
        flicker=0.0,
        length_mm=60.0,
        first_joint_mm=900.0,
        defects=(),
    )
    frames = list(islice(render(clean), PAST + 1))
    cracked = next(islice(render(replace(clean, defects=(crack,))), PAST, None))
    sound = np.maximum(frames[PAST].image.astype(float), 1)
    truth = straight_track(np.array([frame.x_mm for frame in frames]))
    fields = {
        name: np.array([getattr(frame, name) for frame in frames])
        for name in ("y_mm", "yaw_deg", "z_mm", "pitch_deg", "roll_deg")
    }
    track: Track = replace(truth, **fields)
    darker = (sound - cracked.image) / sound
    return darker, Trajectory(adjust(track, clean.rig, Stated(), []), track)


def figure(trajectory: Trajectory, kind: str, *pixels: Sequence[float]) -> Figure:
    points = [{"frame": PAST, "pixel": [float(u), float(v)]} for u, v in pixels]
    found = figure_of(trajectory, Measure.model_validate({"kind": kind, "points": points}))
    assert found is not None
    return found


def ends(darker: Pixels) -> list[Pixels]:
    """Return the middles of the first and the last column of a crack along the picture."""
    rows, columns = np.nonzero(darker > 0.4 * darker.max())
    return [
        np.array([column, rows[columns == column].mean()])
        for column in (columns.min(), columns.max())
    ]


def edges(profile: NDArray[np.floating]) -> tuple[float, float] | None:
    """Return where a dark line begins and ends, at half of its depth; None for two lines."""
    half = profile.max() / 2
    dark = np.flatnonzero(profile > half)
    first, last = dark[0], dark[-1]
    if last - first >= len(dark) or 2 * half < 0.3:
        return None
    return (
        first - (profile[first] - half) / (profile[first] - profile[first - 1]),
        last + (profile[last] - half) / (profile[last] - profile[last + 1]),
    )


@pytest.mark.parametrize(("name", "arc_mm"), [("nominal", 12.0), ("wide_lens", -20.0)])
def test_length_of_a_rendered_crack_is_measured_within_3_percent(name: str, arc_mm: float) -> None:
    darker, trajectory = seen(name, Defect("crack", 10.0, arc_mm, LENGTH_MM, 8.0))
    found = figure(trajectory, "length", *ends(darker))
    assert found.value == pytest.approx(LENGTH_MM, rel=0.03)
    assert abs(found.value - LENGTH_MM) <= found.u95


def test_width_of_a_rendered_crack_is_measured_within_3_percent() -> None:
    drawn = np.ones((200, 400), np.float32)
    crack = Defect("crack", 40.0, 20.0, LENGTH_MM, 8.0)
    draw_defects(drawn, (crack,), x0_mm=0, arc0_mm=0, texel_mm=TEXEL_MM, seed=1)
    true_mm = [
        TEXEL_MM * (found[1] - found[0])
        for column in range(60, 340)
        if (found := edges(1 - drawn[:, column])) is not None
    ]
    darker, trajectory = seen("nominal", replace(crack, x_mm=10.0, arc_mm=12.0))
    columns = range(*(round(end[0]) for end in ends(darker)))
    measured_mm = [
        figure(trajectory, "width", (column, found[0]), (column, found[1])).value
        for column in columns[3:-3]
        if (found := edges(darker[:, column])) is not None
    ]
    assert np.median(measured_mm) == pytest.approx(np.median(true_mm), rel=0.03)
