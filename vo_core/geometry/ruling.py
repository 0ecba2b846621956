"""A ruler on the wall in the picture of any camera: lines across and along, at even distances.

Drawn over a frame it shows at a glance whether a rig's rotation, view, lens and height are true.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vo_core.geometry.rectify import no_wall_in_view
from vo_core.geometry.wall import (
    NOMINAL,
    Points,
    cast,
    develop,
    enclose,
    robot_pixels,
    robot_rays,
    sight,
)
from vo_core.rig import Rig

STEPS_MM = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
"""Distances of two lines that people read without a calculation."""

MOST_LINES = 8
"""Lines across, and lines along a floor, in one picture."""

FARTHEST_HEIGHTS = 6.0
"""A camera that looks ahead sees the wall without end; lines farther than so many heights of the
camera would lie on each other."""

LINE_POINTS = 65
HOURS = 12


@dataclass(frozen=True, slots=True)
class Line:
    """One line on the wall."""

    at: float
    """mm ahead of the camera; for a line along: hour of the clock, or mm to the right on a
    floor."""
    uv: Points
    """(LINE_POINTS, 2) pixels; nan where the lens does not see it."""


@dataclass(frozen=True, slots=True)
class Ruling:
    """Lines of the wall in a picture."""

    step_mm: int
    """Distance between two lines across."""
    across: list[Line]
    along: list[Line]


def ruling(rig: Rig) -> Ruling:
    """Rule the wall that a rig's camera sees from its nominal pose.

    Raises:
        InvalidRig: The camera sees no wall.
    """
    low, high = _seen_mm(rig)
    step_mm = _step_mm(high[0] - low[0])
    spread = np.linspace(0.0, 1.0, LINE_POINTS)

    def line(at: float, axial_mm: Points | float, arc_mm: Points | float) -> Line:
        axial, arc = np.broadcast_arrays(axial_mm, arc_mm)
        wall = enclose(rig, np.stack([axial, arc], 1))
        return Line(at, robot_pixels(rig, sight(rig, NOMINAL, wall)))

    axial_mm = low[0] + spread * (high[0] - low[0])
    if rig.pipe.radius_mm is None:
        arc_mm = low[1] + spread * (high[1] - low[1])
        rows = _multiples(low[1], high[1], _step_mm(high[1] - low[1]))
        along = [line(right_mm, axial_mm, right_mm) for right_mm in rows]
    else:
        girth_mm = 2 * np.pi * rig.pipe.radius_mm
        arc_mm = (spread - 0.5) * girth_mm
        # The invert is at 6 o'clock, and 3 o'clock is to the right.
        hours = range(1, HOURS + 1)
        along = [line(hour, axial_mm, (6 - hour) * girth_mm / HOURS) for hour in hours]
    across = [line(at, at, arc_mm) for at in _multiples(low[0], high[0], step_mm)]
    return Ruling(step_mm, across, along)


def _seen_mm(rig: Rig) -> tuple[list[float], list[float]]:
    """Least and largest (axial, arc) mm of the wall in the picture, from the camera's foot."""
    u = np.linspace(0, rig.camera.width - 1, 33)
    v = np.linspace(0, rig.camera.height - 1, 25)
    pixels = np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)
    wall = develop(rig, cast(rig, NOMINAL, robot_rays(rig, pixels)))
    reach_mm = FARTHEST_HEIGHTS * rig.mount.height_mm
    near = wall[np.abs(wall[:, 0]) <= reach_mm]  # nan is not
    if not len(near):
        raise no_wall_in_view(rig)
    return near.min(axis=0).tolist(), near.max(axis=0).tolist()


def _step_mm(extent_mm: float) -> int:
    return next((step for step in STEPS_MM if extent_mm / step <= MOST_LINES), STEPS_MM[-1])


def _multiples(low: float, high: float, step: int) -> list[float]:
    return [float(k * step) for k in range(int(np.ceil(low / step)), int(high // step) + 1)]
