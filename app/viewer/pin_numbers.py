"""Labels every pin of a stand-alone page with its number, placed so that no two overlap.

Such a page has neither a pointer nor a robot that moves, so that nobody chooses the labels. A label
keeps its size on the screen: seen from where the page begins, in a window that is not lower than
assumed here, all labels are apart; nearer by they are further apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import viser

from app.viewer.geometry import Section, Vector
from app.viewer.pin import Pin
from app.viewer.views import UP, View

_WINDOW_PX = 480
"""Least height of the window; its width does not change the scale."""
_HIGH_PX, _DIGIT_PX, _MARGIN_PX = 20.0, 8.5, 7.0
"""Size of a label on the screen."""
_FONT_SCALE = 1.15
_ABOVE_AXIS = 1.2
"""Height of the lowest labels, in scales of the section: clear of the wall."""
_MOST_TIERS = 12
"""A number that finds no free place below this tier is left out."""


@dataclass(frozen=True)
class _Box:
    """A place on the screen, px from its centre."""

    left: float
    right: float
    low: float
    high: float

    def meets(self, other: _Box) -> bool:
        return (
            self.left < other.right
            and other.left < self.right
            and self.low < other.high
            and other.low < self.high
        )


def show_numbers(
    scene: viser.SceneApi,
    section: Section,
    pins: Sequence[Pin],
    heads: Sequence[Vector],
    view: View,
) -> None:
    """Draw the numbers with a line from each to the head of its pin."""
    base_z_m = section.axis_z_m - _ABOVE_AXIS * section.scale_m
    places = apart([pin.number for pin in pins], heads, base_z_m, view)
    leaders, colors = [], []
    for n, (pin, head, place) in enumerate(zip(pins, heads, places, strict=True)):
        if place is None:
            continue
        label = scene.add_label(f"/pins/numbers/{n}", str(pin.number), anchor="bottom-center")
        label.position = (float(place[0]), float(place[1]), float(place[2]))
        label.font_screen_scale = _FONT_SCALE
        leaders.append((head, place))
        colors.append((pin.color, pin.color))
    if leaders:
        scene.add_line_segments(
            "/pins/leaders",
            np.array(leaders),
            colors=np.array(colors, np.uint8),
            thickness=0.012 * section.scale_m,
        )


def apart(
    numbers: Sequence[int], heads: Sequence[Vector], base_z_m: float, view: View
) -> list[Vector | None]:
    """Return a place above each head, as low as possible, at which labels are apart on the screen.

    Args:
        numbers: The texts.
        heads: (3,) points, world.
        base_z_m: World z of the lowest labels; z points down.
        view: Where the observer stands.

    Returns:
        (3,) points of the middle of the labels' lower edges; None for a label without a free place.
    """
    screen = _Screen(view)
    taken: list[_Box] = []
    places: list[Vector | None] = []
    for number, head in zip(numbers, heads, strict=True):
        wide = _DIGIT_PX * len(str(number)) + _MARGIN_PX
        foot = np.array([head[0], head[1], base_z_m])
        free = (
            (place, box)
            for tier, aside in product(range(_MOST_TIERS), (0, 1, -1))
            for place in [screen.moved(foot, aside * wide, tier * _HIGH_PX)]
            for box in [screen.box(place, wide)]
            if not any(box.meets(other) for other in taken)
        )
        place, box = next(free, (None, None))
        places.append(place)
        if box is not None:
            taken.append(box)
    return places


class _Screen:
    """The window as seen from a view."""

    def __init__(self, view: View) -> None:
        self._position = view.position
        self._forward = (view.look_at - view.position) / np.linalg.norm(
            view.look_at - view.position
        )
        right = np.cross(self._forward, UP)
        self._right = right / np.linalg.norm(right)
        self._above = np.cross(self._right, self._forward)
        self._px = _WINDOW_PX / 2 / np.tan(view.fov_rad / 2)

    def _per_m(self, point: Vector) -> float:
        return float(self._px / ((point - self._position) @ self._forward))

    def moved(self, point: Vector, right_px: float, up_px: float) -> Vector:
        """Return a point moved on the screen: level to the right, and upright."""
        per_m = self._per_m(point)
        upright = up_px / (per_m * float(self._above @ UP))
        moved: Vector = point + right_px / per_m * self._right + upright * UP
        return moved

    def box(self, point: Vector, wide_px: float) -> _Box:
        """Return the place of a label whose lower edge has its middle at the point."""
        offset, per_m = point - self._position, self._per_m(point)
        across, up = (float(offset @ axis) * per_m for axis in (self._right, self._above))
        return _Box(across - wide_px / 2, across + wide_px / 2, up, up + _HIGH_PX)
