"""Defects as pins on the wall: a stem, a head coloured by severity, a 95 % whisker and a label."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray
from viser.transforms import SO3

from app.viewer.geometry import Section, Vector, octahedron, phi_of_clock, shown_mm
from app.viewer.views import CameraMode

_SEVERITY_COLORS = (
    (154, 166, 178),
    (86, 204, 150),
    (190, 212, 78),
    (252, 202, 56),
    (255, 136, 44),
    (255, 62, 66),
)
_UNRATED = (124, 176, 255)
_MIN_WHISKER = 0.04
"""Least half-width of a drawn whisker, in scales of the section."""
_CROWDED = 5.0
"""In an overview, pins closer than so many scales are labelled with their code alone."""


@dataclass(frozen=True, slots=True)
class Pin:
    """A defect on the wall."""

    id: str
    distance_m: float
    clock: float | None
    """In (0, 12]; None on a floor."""
    u95_m: float
    """Half-width of the 95 % interval of the distance."""
    severity: int | None
    """0 note to 5 act now; None not rated."""
    label: str
    lateral_m: float = 0.0
    """To the right of the axis; counts on a floor only."""


class Pins:
    """Draws all pins in two scene nodes and a label each; nodes are named by place, not by pin."""

    def __init__(self, scene: viser.SceneApi, section: Section) -> None:
        self._scene = scene
        self._section = section
        self._heads: viser.BatchedMeshHandle | None = None
        self._lines: viser.LineSegmentsHandle | None = None
        self._labels: list[viser.LabelHandle] = []

    def show(self, pins: Sequence[Pin], mode: CameraMode) -> None:
        """Replace everything drawn by `pins`."""
        pins = sorted(pins, key=lambda pin: pin.distance_m)
        self._show_labels(pins, mode)
        if pins:
            self._draw(pins, 2.2 if mode == "overview" else 1.0)
        for node in (self._heads, self._lines):
            if node is not None:
                node.visible = bool(pins)

    def _draw(self, pins: Sequence[Pin], enlarged: float) -> None:
        size = self._section.scale_m
        colors = np.array([_color(pin) for pin in pins], np.uint8)
        sizes = np.array([0.085 + 0.012 * (pin.severity or 0) for pin in pins]) * enlarged * size
        self._heads = self._scene.add_batched_meshes_simple(
            "/pins/heads",
            *octahedron(),
            batched_wxyzs=np.tile(SO3.identity().wxyz, (len(pins), 1)),
            batched_positions=np.array([self._head(pin) for pin in pins]),
            batched_scales=sizes,
            batched_colors=colors,
            flat_shading=True,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        segments = [self._segments(pin) for pin in pins]
        line_colors = np.concatenate(
            [np.tile(color // 2, (len(s), 2, 1)) for s, color in zip(segments, colors, strict=True)]
        )
        self._lines = self._scene.add_line_segments(
            "/pins/lines",
            np.concatenate(segments),
            colors=line_colors,
            thickness=0.028 * enlarged * size,
        )

    def _show_labels(self, pins: Sequence[Pin], mode: CameraMode) -> None:
        while len(self._labels) < len(pins):
            self._labels.append(
                self._scene.add_label(
                    f"/pins/labels/{len(self._labels)}",
                    "",
                    font_screen_scale=1.15,
                    anchor="bottom-center",
                )
            )
        distances = np.array([-np.inf, *(pin.distance_m for pin in pins), np.inf])
        gaps = np.diff(distances)
        crowded = np.minimum(gaps[:-1], gaps[1:]) < _CROWDED * self._section.scale_m
        for label, pin, is_crowded in zip(self._labels, pins, crowded, strict=False):
            label.text = _short_text(pin) if is_crowded and mode == "overview" else _text(pin)
            label.position = self._head(pin) - [0.0, 0.0, 0.16 * self._section.scale_m]
        for number, label in enumerate(self._labels):
            label.visible = number < len(pins)

    def _segments(self, pin: Pin) -> NDArray[np.float64]:
        """(4, 2, 3): stem, whisker along the wall, and its two caps around the wall."""
        size = self._section.scale_m
        half_m = max(pin.u95_m, _MIN_WHISKER * size)
        start, end = pin.distance_m - half_m, pin.distance_m + half_m
        cap = 0.07 * size
        return np.array(
            [
                [self._on_wall(pin, pin.distance_m), self._head(pin)],
                [self._on_wall(pin, start), self._on_wall(pin, end)],
                [self._on_wall(pin, start, -cap), self._on_wall(pin, start, cap)],
                [self._on_wall(pin, end, -cap), self._on_wall(pin, end, cap)],
            ]
        )

    def _head(self, pin: Pin) -> Vector:
        return self._on_wall(pin, pin.distance_m, inset_m=0.4 * self._section.scale_m)

    def _on_wall(
        self, pin: Pin, x_m: float, around_m: float = 0.0, *, inset_m: float | None = None
    ) -> Vector:
        """A point of the wall near the pin, `around_m` to the right of it along the wall."""
        inset = 0.015 * self._section.scale_m if inset_m is None else inset_m
        radius = self._section.radius_m
        if radius is None:
            return np.array([x_m, pin.lateral_m + around_m, -inset])
        # Without a clock position the defect is drawn at the crown, where the robot hides nothing.
        phi = phi_of_clock(12.0 if pin.clock is None else pin.clock) + around_m / radius
        reach = radius - inset
        return np.array([x_m, reach * np.sin(phi), reach * np.cos(phi)])


def _color(pin: Pin) -> tuple[int, int, int]:
    return _UNRATED if pin.severity is None else _SEVERITY_COLORS[pin.severity]


def _short_text(pin: Pin) -> str:
    """Severity is said in words too: colour is never the only sign."""
    return pin.label if pin.severity is None else f"S{pin.severity} {pin.label}"


def _text(pin: Pin) -> str:
    return f"{_short_text(pin)}\n{pin.distance_m:.2f} m ± {shown_mm(pin.u95_m)} mm"
