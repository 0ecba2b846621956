"""Draws defects as pins on the wall: a stem, a head coloured by severity, a 95 % whisker, a label.

A stretch is a band along the wall, a clock sector an arc of it; both are one patch of the wall.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray
from viser.transforms import SO3

from app.viewer.geometry import (
    Mesh,
    PinHit,
    Section,
    Vector,
    joined,
    octahedron,
    phi_of_clock,
    strip,
    wall_points,
)
from app.viewer.look import CameraMode
from app.viewer.pin import COLORS, Color, Pin
from app.viewer.pin_labels import Emphasis, PinLabels
from app.viewer.pin_numbers import show_numbers
from app.viewer.views import View
from app.viewer.wording import Wording
from vo_core.geometry.measure import developed_points

_SELECTED: Color = (255, 255, 255)

_ON_WALL = 0.015
"""Distance of lines and patches from the wall, in scales of the section."""
_HEAD = 0.4
"""Distance of heads from the wall, in scales."""
_MIN_WHISKER = 0.04
"""Smallest half-width of a drawn whisker, in scales of the section."""
_NARROW = 0.12
"""Half the width of a patch across its length, in scales."""
_BETWEEN = 8
"""Pieces of a measured line between two points, as the wall is curved."""
_CLICKED_RAD = 0.012
"""Largest angle between a click and a pin; about 8 px of a window 640 px high."""


@dataclass(frozen=True, slots=True)
class _Shape:
    """The drawing of a pin that is not selected, which is independent of other pins."""

    head: Vector
    """(3,) centre of its head."""
    lines: NDArray[np.float64]
    """(N, 2, 3) stem, whisker, its two caps, edges of the patch."""
    patch: Mesh | None


class Pins:
    """Draws all pins in a few nodes.

    The shape of a pin is computed once, so that one pin more does not make the server repeat the
    work for 2000 others.
    """

    def __init__(self, scene: viser.SceneApi, section: Section) -> None:
        self._scene = scene
        self._section = section
        self._sorted: list[Pin] = []
        self._labels = PinLabels(scene, section)
        self._heads: viser.BatchedMeshHandle | None = None
        self._lines: viser.LineSegmentsHandle | None = None
        self._patches: dict[Color, viser.MeshHandle] = {}
        self._shapes: dict[Pin, _Shape] = {}

    def show(self, pins: Sequence[Pin], mode: CameraMode, selected: str | None) -> None:
        """Draw exactly these pins and highlight the one with the id `selected`."""
        pins = self._sorted = sorted(pins, key=lambda pin: pin.distance_m)
        self._shapes = {pin: self._shapes.get(pin) or self._shape(pin) for pin in pins}
        self._show_patches(pins)
        if pins:
            self._draw(pins, mode, selected)
        for node in (self._heads, self._lines):
            if node is not None:
                node.visible = bool(pins)

    def label(
        self,
        mode: CameraMode,
        emphasis: Emphasis,
        robot_x_m: float,
        wording: Wording,
        *,
        is_low: bool,
    ) -> None:
        """Label the pins near the robot and those that are emphasised; in a low window only
        these.
        """
        self._labels.show(
            self._sorted,
            lambda pin: self._shapes[pin].head,
            mode,
            emphasis,
            robot_x_m,
            wording,
            is_low=is_low,
        )

    def show_numbers(self, view: View) -> None:
        """Label all pins with their numbers, for a page that begins at this view."""
        heads = [self._shapes[pin].head for pin in self._sorted]
        show_numbers(self._scene, self._section, self._sorted, heads, view)

    def _shape(self, pin: Pin) -> _Shape:
        return _Shape(_head(self._section, pin), self._segments(pin), self._patch(pin))

    def _draw(self, pins: Sequence[Pin], mode: CameraMode, selected: str | None) -> None:
        size = self._section.scale_m
        heads = np.array([_head_m(self._section, pin, mode) for pin in pins])
        heads *= [1.6 if pin.id == selected else 1.0 for pin in pins]
        self._heads = self._scene.add_batched_meshes_simple(
            "/pins/heads",
            *octahedron(),
            batched_wxyzs=np.tile(SO3.identity().wxyz, (len(pins), 1)),
            batched_positions=np.array([self._shapes[pin].head for pin in pins]),
            batched_scales=heads,
            batched_colors=np.array([pin.color for pin in pins], np.uint8),
            flat_shading=True,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        segments = [self._shapes[pin].lines for pin in pins]
        colors = np.array([pin.color for pin in pins], np.uint8) // 2
        for n, pin in enumerate(pins):
            if pin.id == selected:
                segments[n] = np.concatenate([segments[n], self._ring(pin)])
                colors[n] = _SELECTED
        counts = [len(lines) for lines in segments]
        self._lines = self._scene.add_line_segments(
            "/pins/lines",
            np.concatenate(segments),
            colors=np.repeat(np.repeat(colors, counts, axis=0)[:, None], 2, axis=1),
            thickness=0.028 * _enlarged(mode) * size,
        )

    def _show_patches(self, pins: Sequence[Pin]) -> None:
        """Draw stretches and sectors, those of one colour in one node."""
        for color in COLORS:
            meshes = [
                mesh
                for pin in pins
                if pin.color == color and (mesh := self._shapes[pin].patch) is not None
            ]
            if meshes:
                self._patches[color] = self._scene.add_mesh_simple(
                    f"/pins/patches/{COLORS.index(color)}",
                    *joined(meshes),
                    color=color,
                    opacity=0.45,
                    cast_shadow=False,
                    receive_shadow=False,
                )
            elif color in self._patches:
                self._patches[color].visible = False

    def _patch(self, pin: Pin) -> Mesh | None:
        area = _area(self._section, pin)
        if area is None:
            return None
        first_m, last_m, arc_from_m, arc_to_m = area
        inner = self._section.inset(_ON_WALL * self._section.scale_m)
        mesh, _ = strip(inner, arc_from_m, arc_to_m)
        lift_m = _ON_WALL * self._section.scale_m if self._section.radius_m is None else 0.0
        return Mesh(
            mesh.vertices * [last_m - first_m, 1.0, 1.0] + [first_m, 0.0, -lift_m], mesh.faces
        )

    def _segments(self, pin: Pin) -> NDArray[np.float64]:
        section, size = self._section, self._section.scale_m
        half_m = max(pin.u95_m or 0.0, _MIN_WHISKER * size)
        start, end = pin.distance_m - half_m, pin.distance_m + half_m
        cap = 0.07 * size
        lines = [
            np.array([_on_wall(section, pin, pin.distance_m), _head(section, pin)]),
            np.array([_on_wall(section, pin, start), _on_wall(section, pin, end)]),
            np.array([_on_wall(section, pin, start, -cap), _on_wall(section, pin, start, cap)]),
            np.array([_on_wall(section, pin, end, -cap), _on_wall(section, pin, end, cap)]),
        ]
        area = _area(section, pin)
        if area is not None:
            first_m, last_m, arc_from_m, arc_to_m = area
            arcs = np.linspace(arc_from_m, arc_to_m, 33)
            lines += [
                _lines_at(section, np.full_like(arcs, x_m), arcs) for x_m in (first_m, last_m)
            ]
            xs = np.array([first_m, last_m])
            lines += [_lines_at(section, xs, np.full(2, arc)) for arc in (arc_from_m, arc_to_m)]
        lines += [along_wall(section, np.array(points)) for points in pin.measured_m]
        return np.concatenate([line.reshape(-1, 2, 3) for line in lines])

    def _ring(self, pin: Pin) -> NDArray[np.float64]:
        """Return (32, 2, 3) lines of a ring around the foot of the selected pin."""
        turn = np.linspace(0, 2 * np.pi, 33)
        reach = 0.3 * self._section.scale_m
        arc_m = _arc(self._section, pin)
        return _lines_at(
            self._section, pin.distance_m + reach * np.cos(turn), arc_m + reach * np.sin(turn)
        )


def pin_under(
    pins: Sequence[Pin],
    mode: CameraMode,
    section: Section,
    origin: Sequence[float],
    direction: Sequence[float],
) -> PinHit | None:
    """Return the pin whose head or stem a click meets or nearly meets; of several the closest."""
    if not pins:
        return None
    o, d = np.asarray(origin, np.float64), np.asarray(direction, np.float64)
    length = np.linalg.norm(d)
    if length == 0:
        return None
    ways = np.linspace(0.0, 1.0, 6)[None, :, None]
    xs_m, arcs_m = [pin.distance_m for pin in pins], [_arc(section, pin) for pin in pins]
    feet = wall_points(section, xs_m, arcs_m, _ON_WALL)[:, None]
    heads = wall_points(section, xs_m, arcs_m, _HEAD)[:, None]
    sight = feet + ways * (heads - feet) - o  # (pins, 6 points of the stem, 3)
    ahead = sight @ (d / length)
    beside = np.linalg.norm(sight - ahead[..., None] * (d / length), axis=2)
    size_m = np.array([_head_m(section, pin, mode) for pin in pins])[:, None]
    # The clickable head is as wide as drawn, a stem a third of that; far away a few pixels count.
    allowed = np.maximum(size_m * np.where(ways[..., 0] == 1.0, 1.0, 1 / 3), _CLICKED_RAD * ahead)
    missed = np.where(ahead > 0, beside / allowed, np.inf).min(axis=1)
    best = int(missed.argmin())
    return PinHit(pins[best].id) if missed[best] <= 1.0 else None


def _enlarged(mode: CameraMode) -> float:
    return 2.2 if mode == "overview" else 1.0


def _head_m(section: Section, pin: Pin, mode: CameraMode) -> float:
    """Return the distance from the centre of the head to its corners."""
    return (0.085 + 0.012 * (pin.severity or 0)) * _enlarged(mode) * section.scale_m


def _head(section: Section, pin: Pin) -> Vector:
    (point,) = wall_points(section, [pin.distance_m], [_arc(section, pin)], _HEAD)
    return np.asarray(point)


def _on_wall(section: Section, pin: Pin, x_m: float, around_m: float = 0.0) -> Vector:
    """Return a point of the wall near the pin, `around_m` to the right of it along the wall."""
    (point,) = wall_points(section, [x_m], [_arc(section, pin) + around_m], _ON_WALL)
    return np.asarray(point)


def _arc(section: Section, pin: Pin) -> float:
    if section.radius_m is None:
        return pin.lateral_m
    # Without a clock position the defect is drawn at the crown, where the robot hides nothing.
    return section.radius_m * phi_of_clock(12.0 if pin.clock is None else pin.clock)


def _lines_at(section: Section, xs_m: Vector, arcs_m: Vector) -> NDArray[np.float64]:
    """Return (N - 1, 2, 3) lines from point to point of the wall."""
    points = wall_points(section, xs_m, arcs_m, _ON_WALL)
    return np.stack([points[:-1], points[1:]], axis=1)


def along_wall(section: Section, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (M, 2, 3) lines through (N, 3) points that follow the wall between them."""
    corners = developed_points(points_m, section.radius_m)
    at = np.linspace(0, len(corners) - 1, _BETWEEN * (len(corners) - 1) + 1)
    xs, arcs = (np.interp(at, np.arange(len(corners)), column) for column in corners.T)
    return _lines_at(section, xs, arcs)


def _area(section: Section, pin: Pin) -> tuple[float, float, float, float] | None:
    """Return first and last metre and arc of a stretch or sector; None for a mere point."""
    has_sector = section.radius_m is not None and None not in (pin.clock, pin.clock_to)
    if pin.finish_m is None and not has_sector:
        return None
    narrow_m = _NARROW * section.scale_m
    if pin.finish_m is None:
        first_m, last_m = pin.distance_m - narrow_m, pin.distance_m + narrow_m
    else:
        first_m, last_m = sorted((pin.distance_m, pin.finish_m))
    arc_m = _arc(section, pin)
    if not has_sector:
        return first_m, last_m, arc_m - narrow_m, arc_m + narrow_m
    # Clockwise as seen in the direction of travel: the wall angle falls. 12 to 12 is all around.
    hours = (pin.clock_to - pin.clock) % 12 or 12.0  # type: ignore[operator]
    return first_m, last_m, arc_m - np.pi / 6 * hours * section.scale_m, arc_m
