"""Draws a scale bar on the wall ahead of the robot; its length is true at its place."""

from __future__ import annotations

import math

import numpy as np
import viser

from app.viewer.geometry import Section, wall_points
from app.viewer.wording import Wording

_COLOR = (245, 248, 250)
_PHI_RAD = np.radians(-60)
"""On the left and low, where all cameras see it, and no cut takes the wall away."""
_AHEAD = 0.6
"""Distance from the robot, in scales: it is not hidden by the robot."""
_INSET = 0.03
_CAP = 0.08
"""Half the length of its ends, in scales."""


class ScaleBar:
    """Two nodes that are moved along with the robot, and drawn anew only in another length."""

    def __init__(self, scene: viser.SceneApi, section: Section) -> None:
        self._scene = scene
        self._section = section
        self._bar: viser.LineSegmentsHandle | None = None
        self._label = scene.add_label("/scale_bar/label", "", anchor="top-center")
        self._drawn: tuple[float, Wording] | None = None
        self._at_m: float | None = None

    def show(self, robot_x_m: float, wording: Wording) -> None:
        """Show the bar where the robot is, in every view about as long as the pipe is wide."""
        length_m = round_length_m(2 * self._section.scale_m, wording.unit_m)
        if (length_m, wording) != self._drawn:
            self._draw(length_m, wording)
        if robot_x_m != self._at_m:
            self._at_m = robot_x_m
            self._place()

    def _draw(self, length_m: float, wording: Wording) -> None:
        section, cap_m = self._section, _CAP * self._section.scale_m
        xs = np.array([0.0, length_m, 0.0, 0.0, length_m, length_m])
        arcs = _arc_m(section) + np.array([0.0, 0.0, -cap_m, cap_m, -cap_m, cap_m])
        self._bar = self._scene.add_line_segments(
            "/scale_bar/bar",
            wall_points(section, xs, arcs, _INSET).reshape(3, 2, 3),
            colors=_COLOR,
            thickness=0.03 * section.scale_m,
        )
        self._label.text = wording.length(length_m)
        self._drawn = (length_m, wording)
        self._at_m = None  # a new node stands at the zero

    def _place(self) -> None:
        if self._bar is None or self._drawn is None or self._at_m is None:
            return
        x_m = self._at_m + _AHEAD * self._section.scale_m
        self._bar.position = (x_m, 0.0, 0.0)
        middle = np.array([x_m + self._drawn[0] / 2])
        (at,) = wall_points(self._section, middle, np.array([_arc_m(self._section)]), _INSET)
        self._label.position = at


def _arc_m(section: Section) -> float:
    return float(_PHI_RAD) * section.scale_m


def round_length_m(most_m: float, unit_m: float) -> float:
    """Return the longest 1, 2 or 5 times a power of ten of the unit that is not over `most_m`."""
    most = most_m / unit_m
    power = 10.0 ** math.floor(math.log10(most))
    digit = max(digit for digit in (1, 2, 5) if digit * power <= most * (1 + 1e-9))
    return digit * power * unit_m
