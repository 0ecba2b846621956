"""Measures against defects of known size in rendered pictures."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from numpy.typing import NDArray
from tracks import straight_track

from app.lab.simulation import SCENARIOS, render
from app.lab.simulation.defects import Defect
from app.survey.adjustment.adjust import adjust
from app.survey.measure import Figure, Measure
from app.survey.measuring import figure_of
from app.survey.place import Course
from app.survey.stated import Stated
from vo_core import Track

LENGTH_MM, GAP_MM = 60.0, 2.0
PAST = 6
"""Frame that is measured: the robot has moved and swayed by then."""
Pixels = NDArray[np.float64]


def seen(name: str, defect: Defect) -> tuple[Pixels, Course]:
    """Return the (N, 2) pixels that a defect darkens in a picture, with the true course to it."""
    clean = replace(
        SCENARIOS[name],
        noise_grey=0.0,
        flicker=0.0,
        length_mm=60.0,
        first_joint_mm=900.0,
        defects=(),
    )
    frames = list(islice(render(clean), PAST + 1))
    with_defect = next(islice(render(replace(clean, defects=(defect,))), PAST, None))
    darker = frames[PAST].image.astype(int) - with_defect.image.astype(int)
    rows, columns = np.nonzero(darker > 0.4 * darker.max())
    truth = straight_track(np.array([frame.x_mm for frame in frames]))
    fields = {
        name: np.array([getattr(frame, name) for frame in frames])
        for name in ("y_mm", "yaw_deg", "z_mm", "pitch_deg", "roll_deg")
    }
    track = replace(truth, **fields)
    assert isinstance(track, Track)
    return np.column_stack([columns, rows]).astype(float), Course(
        adjust(track, clean.rig, Stated(), []), track
    )


def figure(course: Course, kind: str, *pixels: NDArray[np.float64]) -> Figure:
    points = [{"frame": PAST, "pixel": pixel.tolist()} for pixel in pixels]
    found = figure_of(course, Measure.model_validate({"kind": kind, "points": points}))
    assert found is not None
    return found


def ends(pixels: Pixels, course: Course) -> tuple[Pixels, Pixels]:
    """Return the middles of the first and the last column of a crack along the picture."""
    first, last = pixels[:, 0].min(), pixels[:, 0].max()
    start, end = (pixels[pixels[:, 0] == column].mean(axis=0) for column in (first, last))
    return start, end


@pytest.mark.parametrize(("name", "arc_mm"), [("nominal", 12.0), ("wide_lens", -20.0)])
def test_length_of_a_rendered_crack_is_measured_within_3_percent(name: str, arc_mm: float) -> None:
    crack = Defect("crack", 10.0, arc_mm, LENGTH_MM, 8.0)
    pixels, course = seen(name, crack)
    found = figure(course, "length", *ends(pixels, course))
    assert found.value == pytest.approx(LENGTH_MM, rel=0.03)
    assert abs(found.value - LENGTH_MM) <= found.u95
