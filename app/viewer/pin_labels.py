"""Labels pins near the robot, under the pointer or selected, each joined to its pin by a line."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import viser

from app.survey.adjustment.adjusted_track import BY_CAMERA
from app.viewer.geometry import Section, Vector
from app.viewer.look import CameraMode
from app.viewer.pin import Color, Pin
from app.viewer.wording import Wording

MOST_NEAR = 6
"""Most pins that are labelled because they are near: more would hide each other."""
_NEAR: dict[CameraMode, tuple[float, float]] = {
    "overview": (8.0, 8.0),
    "follow": (3.0, 7.0),
    "inside": (0.5, 4.5),
}
"""Behind and ahead of the robot, in scales of the section."""

_TIERS = 3
_STEP: dict[CameraMode, float] = {"overview": 0.6, "follow": 0.25, "inside": 0.25}
"""Neighbouring labels stand on different tiers, this far apart in scales."""
_ABOVE_AXIS = 1.1
"""Height of the lowest tier seen from outside, in scales: clear of the wall."""
_ABOVE_HEAD = 0.2
"""Height of the lowest tier above the pin's head seen from inside, in scales."""


@dataclass(frozen=True, slots=True)
class Emphasis:
    """Ids of the pins that are labelled wherever they are; None: none."""

    selected: str | None = None
    hovered: str | None = None


@dataclass(frozen=True, slots=True)
class _Label:
    """A label as last sent."""

    text: str
    scale: float
    head: tuple[float, float, float]
    at: tuple[float, float, float]
    color: Color


class PinLabels:
    """A few label nodes that serve the pins in turn; nothing is sent while the choice stays."""

    def __init__(self, scene: viser.SceneApi, section: Section) -> None:
        self._scene = scene
        self._section = section
        self._handles: list[viser.LabelHandle] = []
        self._leaders: viser.LineSegmentsHandle | None = None
        self._shown: tuple[_Label, ...] = ()

    def show(
        self,
        pins: Sequence[Pin],
        head_of: Callable[[Pin], Vector],
        mode: CameraMode,
        emphasis: Emphasis,
        robot_x_m: float,
        wording: Wording,
        *,
        is_low: bool,
    ) -> None:
        """Label the chosen of these pins, which are sorted by distance; in a low window those that
        a person points at or has selected, in one line.
        """
        most_near = 0 if is_low else MOST_NEAR
        chosen = near_or_emphasised(
            pins, mode, emphasis, robot_x_m, self._section.scale_m, most_near
        )
        labels = tuple(
            self._label(pin, head_of(pin), mode, emphasis, n % _TIERS, None if is_low else wording)
            for n, pin in enumerate(chosen)
        )
        if labels != self._shown:
            self._shown = labels
            self._send(labels)

    def _label(
        self,
        pin: Pin,
        head: Vector,
        mode: CameraMode,
        emphasis: Emphasis,
        tier: int,
        wording: Wording | None,
    ) -> _Label:
        """Without `wording` in one line."""
        is_selected = pin.id == emphasis.selected
        is_short = mode == "overview" and not is_selected and pin.id != emphasis.hovered
        text = _short_text(pin) if is_short or wording is None else _text(pin, wording)
        x_m, y_m, z_m = head.tolist()
        size, axis_z_m = self._section.scale_m, self._section.axis_z_m
        base_m = z_m - _ABOVE_HEAD * size if mode == "inside" else axis_z_m - _ABOVE_AXIS * size
        return _Label(
            f"» {text}" if is_selected else text,
            1.5 if is_selected else 1.15,
            (x_m, y_m, z_m),
            (x_m, y_m, base_m - _STEP[mode] * tier * size),
            pin.color,
        )

    def _send(self, labels: Sequence[_Label]) -> None:
        while len(self._handles) < len(labels):
            name = f"/pins/labels/{len(self._handles)}"
            self._handles.append(self._scene.add_label(name, "", anchor="bottom-center"))
        for handle, label in zip(self._handles, labels, strict=False):
            handle.text, handle.position = label.text, label.at
            handle.font_screen_scale = label.scale
        for count, handle in enumerate(self._handles, 1):
            handle.visible = count <= len(labels)
        if labels:
            self._leaders = self._scene.add_line_segments(
                "/pins/leaders",
                np.array([(label.head, label.at) for label in labels]),
                colors=np.array([(label.color, label.color) for label in labels], np.uint8),
                thickness=0.012 * self._section.scale_m,
            )
        elif self._leaders is not None:
            self._leaders.visible = False


def near_or_emphasised(
    pins: Sequence[Pin],
    mode: CameraMode,
    emphasis: Emphasis,
    robot_x_m: float,
    scale_m: float,
    most_near: int,
) -> list[Pin]:
    """Return the pins to label, sorted by distance as `pins` are."""
    behind, ahead = (scale_m * scales for scales in _NEAR[mode])
    first = bisect_left(pins, robot_x_m - behind, key=_distance_m)
    last = bisect_right(pins, robot_x_m + ahead, key=_distance_m)
    nearest = sorted(pins[first:last], key=lambda pin: abs(pin.distance_m - robot_x_m))[:most_near]
    emphasised = {emphasis.selected, emphasis.hovered} - {None}
    named = {pin.id: pin for pin in nearest}
    if emphasised:
        named |= {pin.id: pin for pin in pins if pin.id in emphasised}
    return sorted(named.values(), key=_distance_m)


def _distance_m(pin: Pin) -> float:
    return pin.distance_m


def _short_text(pin: Pin) -> str:
    """Write the severity in words too: colour is never the only sign."""
    return pin.label if pin.severity is None else f"S{pin.severity} {pin.label}"


def _text(pin: Pin, wording: Wording) -> str:
    parts = [wording.distance(pin.distance_m)]
    if pin.u95_m is not None:
        parts.append(wording.interval(pin.u95_m))
    if pin.source is not None and pin.source not in BY_CAMERA:
        parts.append(f"({wording.source(pin.source)})")
    if pin.finish_m is not None:
        parts += [wording.word("to"), wording.distance(pin.finish_m)]
    return f"{_short_text(pin)}\n{' '.join(parts)}"
