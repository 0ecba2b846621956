"""Measures between two clicked points of the wall: the shortest line on it, and its length."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser

from app.survey.places.measure import Figure
from app.viewer.geometry import Section, WallHit, phi_of_clock, wall_points
from app.viewer.wording import Wording

_COLOR = (255, 122, 214)
_INSET = 0.02
_POINT = 0.035
"""Radius of an end, in scales."""
_SIDES = 48


class Ruler:
    """The line between the last two points; one point waits for the other."""

    def __init__(self, scene: viser.SceneApi, section: Section) -> None:
        self._scene = scene
        self._section = section
        self._ends = [
            scene.add_icosphere(
                f"/ruler/{n}", radius=_POINT * section.scale_m, color=_COLOR, visible=False
            )
            for n in range(2)
        ]
        self._line: viser.LineSegmentsHandle | None = None
        self._label = scene.add_label(
            "/ruler/label", "", font_screen_scale=1.5, anchor="bottom-center", visible=False
        )

    def show(
        self, points: Sequence[WallHit], wording: Wording, figure: Figure | None = None
    ) -> None:
        """Show none, one or two points, and the length between two: the measured one with its
        interval, until then and where no picture shows both that of the drawn wall.
        """
        places = [(point.distance_m, arc_m(self._section, point)) for point in points]
        for n, end in enumerate(self._ends):
            end.visible = n < len(places)
            if end.visible:
                (end.position,) = self._on_wall(places[n : n + 1])
        is_whole = len(places) == 2
        self._label.visible = is_whole
        if self._line is not None:
            self._line.visible = is_whole
        if is_whole:
            along, around = shortest(self._section, *points)
            (x_m, from_m), ways = places[0], np.linspace(0.0, 1.0, _SIDES + 1)
            line = self._on_wall([(x_m + way * along, from_m + way * around) for way in ways])
            self._line = self._scene.add_line_segments(
                "/ruler/line",
                np.stack([line[:-1], line[1:]], axis=1),
                colors=_COLOR,
                thickness=0.025 * self._section.scale_m,
            )
            self._label.text = (
                f"≈ {wording.length(float(np.hypot(along, around)))}"
                if figure is None
                else wording.size(figure.value, figure.u95)
            )
            self._label.position = line[_SIDES // 2]

    def _on_wall(self, places: Sequence[tuple[float, float]]) -> np.ndarray:
        xs, arcs = np.array(places).T
        return wall_points(self._section, xs, arcs, _INSET)


def arc_m(section: Section, point: WallHit) -> float:
    """Return the arc of a point, 0 at the invert or the axis of a floor, positive to the right."""
    if section.radius_m is None or point.clock_h is None:
        return point.lateral_m
    return section.radius_m * phi_of_clock(point.clock_h)


def shortest(section: Section, start: WallHit, end: WallHit) -> tuple[float, float]:
    """Return how far the shortest way on the wall leads along and around it, in metres."""
    around_m = arc_m(section, end) - arc_m(section, start)
    if section.radius_m is not None:
        whole_m = 2 * np.pi * section.radius_m
        around_m -= whole_m * round(around_m / whole_m)
    return end.distance_m - start.distance_m, float(around_m)
