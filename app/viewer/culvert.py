"""Draws the culvert to scale: its wall, joints, labels and a measuring tape."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from app.survey.places.spans import SAME_M, is_within
from app.viewer.geometry import (
    Cut,
    Mesh,
    Section,
    Vector,
    cut_away,
    dashed,
    half_shell,
    plank,
    torus,
    tube,
)
from app.viewer.look import CameraMode
from app.viewer.views import Reach
from app.viewer.wording import Wording

MAX_METRES = 4000
MAX_LABELS = 14
MAX_LABELS_LOW = 4
"""Most labels in a low window."""

_WALL = np.array([150.0, 152.0, 150.0])
_JOINT = (44, 49, 54)
_COLLAR = (128, 142, 154)
_EXPECTED = (214, 196, 120)
_TAPE = (120, 140, 155)

_NO_TURN = (1.0, 0.0, 0.0, 0.0)
_SIDES = 96

_BEHIND = 0.008
"""Distance, in scales, of the plain wall behind the true wall, which shows the pictures; joints are
drawn at half this distance. So pictures hide what is only drawn."""


Colors = NDArray[np.uint8] | tuple[int, int, int]


class JointMark(NamedTuple):
    """A joint that was seen, or a place where one is expected."""

    number: int | None
    """None if it cannot be counted from the zero."""
    x_m: float
    is_seen: bool


class Culvert:
    """Draws a culvert that grows in whole metres; only few labels add scene nodes."""

    def __init__(self, scene: viser.SceneApi, section: Section) -> None:
        self._scene = scene
        self._section = section
        self._first = 0
        self._last = 0  # metres first..last are drawn
        self._cut: Cut = "none"
        self._joints: tuple[JointMark, ...] = ()
        self._drawn: dict[str, viser.BatchedMeshHandle] = {}
        self._labels: list[viser.LabelHandle] = []
        self.grow_to(1.0)

    @property
    def reach_m(self) -> tuple[float, float]:
        """First and last metre drawn."""
        return float(self._first), float(self._last)

    def grow_to(self, x_m: float) -> None:
        """Draw whole metres up to and including `x_m`."""
        first = max(min(self._first, math.floor(x_m + SAME_M)), -MAX_METRES)
        last = min(max(self._last, math.ceil(x_m - SAME_M)), MAX_METRES)
        if (first, last) != (self._first, self._last):
            self._first, self._last = first, last
            self._draw_wall()

    def set_joints(self, joints: Sequence[JointMark]) -> None:
        """Show exactly these joints."""
        if tuple(joints) != self._joints:
            self._joints = tuple(joints)
            self._draw_joints()

    def set_cut(self, cut: Cut) -> None:
        """Cut half of the pipe away."""
        if cut != self._cut:
            self._cut = cut
            self._draw_wall()
            self._draw_joints()

    def label(self, stretch_m: Reach, mode: CameraMode, wording: Wording, *, is_low: bool) -> None:
        """Label the joints, or the metres where there are none, in this part of the culvert.

        If there are very many for the window, only every n-th is labelled. Labels are at the tape,
        or at the crown for an observer inside.
        """
        start, end = stretch_m
        named = [
            (x_m, wording.joint(number, x_m, is_seen=is_seen))
            for number, x_m, is_seen in self._joints
            if is_within(x_m, stretch_m)
        ]
        if not self._joints:
            first, last = math.ceil(start - SAME_M), math.floor(end + SAME_M)
            metres = range(max(self._first, first), min(self._last, last) + 1)
            named = [(float(metre), wording.distance(metre)) for metre in metres]
        most = MAX_LABELS_LOW if is_low else MAX_LABELS
        wanted = named[:: max(1, math.ceil(len(named) / most))]
        while len(self._labels) < len(wanted):
            name = f"/culvert/labels/{len(self._labels)}"
            self._labels.append(self._scene.add_label(name, "", anchor="top-center"))
        for handle, (x_m, text) in zip(self._labels, wanted, strict=False):
            handle.text = text
            handle.position = self._label_place(x_m, on_crown=mode == "inside")
        for count, handle in enumerate(self._labels, 1):
            handle.visible = count <= len(wanted)

    def _draw_wall(self) -> None:
        starts = np.arange(self._first, self._last, dtype=np.float64)
        # Adjacent metres differ slightly in colour.
        wall = np.where(starts[:, None] % 2, _WALL, 0.84 * _WALL).astype(np.uint8)
        size = self._section.scale_m
        if self._section.radius_m is None:
            floor = plank(1.0, self._section.half_width_m)
            self._repeat("wall", floor, starts, wall, lower_m=_BEHIND * size)
        else:
            radius = self._section.radius_m
            # One-sided walls: opaque from inside, transparent towards an observer outside.
            pipe = tube((1 + _BEHIND) * radius, 1.0, inward=True)
            if self._cut != "none":
                pipe = half_shell((1 + _BEHIND) * radius, 0.08 * radius, *self._kept_rad(radius))
            self._repeat("wall", pipe, starts, wall, is_two_sided=self._cut != "none")
            ends = np.array([self._first, self._last], np.float64)
            self._repeat("ends", self._left(_collar(radius), radius), ends, _COLLAR)
        self._draw_tape()

    def _draw_joints(self) -> None:
        """Draw a seen joint as a gap with a collar, an expected one as a broken ring."""
        seen = np.array([joint.x_m for joint in self._joints if joint.is_seen])
        expected = np.array([joint.x_m for joint in self._joints if not joint.is_seen])
        size, radius = self._section.scale_m, self._section.radius_m
        if radius is None:
            gap = plank(0.03 * size, self._section.half_width_m)
            line = plank(0.012 * size, self._section.half_width_m)
            at_m, lower_m = 0.015 * size, _BEHIND / 2 * size
            self._repeat("joints", gap, seen - at_m, _JOINT, lower_m=lower_m)
            self._repeat("expected", line, expected, _EXPECTED, lower_m=lower_m)
        else:
            gap = tube((1 + _BEHIND / 2) * radius, 0.04 * radius, inward=True)
            self._repeat("joints", self._left(gap, radius), seen - 0.02 * radius, _JOINT)
            self._repeat("collars", self._left(_collar(radius), radius), seen, _COLLAR)
            ring = torus((1 - _BEHIND) * radius, 0.012 * radius, sides=_SIDES)
            broken = dashed(ring, _SIDES, dashes=24, share=0.45)
            self._repeat("expected", self._left(broken, radius), expected, _EXPECTED)

    def _left(self, mesh: Mesh, radius_m: float) -> Mesh:
        """Return what the cut leaves of it."""
        return mesh if self._cut == "none" else cut_away(mesh, *self._kept_rad(radius_m))

    def _kept_rad(self, radius_m: float) -> tuple[float, float]:
        first_m, last_m = self._section.kept_arcs_m(self._cut)
        return first_m / radius_m, last_m / radius_m

    def _repeat(
        self,
        name: str,
        mesh: Mesh,
        xs_m: np.ndarray,
        colors: Colors,
        *,
        lower_m: float = 0.0,
        is_two_sided: bool = False,
    ) -> None:
        if name in self._drawn:
            self._drawn[name].visible = len(xs_m) > 0
        if not len(xs_m):
            return
        positions = np.zeros((len(xs_m), 3))
        positions[:, 0] = xs_m
        positions[:, 2] = lower_m
        self._drawn[name] = self._scene.add_batched_meshes_simple(
            f"/culvert/{name}",
            mesh.vertices,
            mesh.faces,
            batched_wxyzs=np.tile(_NO_TURN, (len(xs_m), 1)),
            batched_positions=positions,
            batched_colors=colors,
            side="double" if is_two_sided else "front",
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _draw_tape(self) -> None:
        """Draw a tape beside the wall on the right: a tick every 0.1 m, a longer one every
        metre.
        """
        size = self._section.scale_m
        start, end = self.reach_m
        y, z = self._section.half_width_m + 0.35 * size, self._section.radius_m or 0.0
        step_m = 0.1 if end - start <= 100 else 1.0
        ticks = np.arange(math.ceil(start / step_m), math.floor(end / step_m + 1e-9) + 1)
        length = np.where(ticks % round(1 / step_m) == 0, 0.34, 0.14) * size
        xs = ticks * step_m
        ends = np.stack(
            [
                np.stack([xs, np.full_like(xs, y), np.full_like(xs, z)], axis=1),
                np.stack([xs, y + length, np.full_like(xs, z)], axis=1),
            ],
            axis=1,
        )
        edge = np.array([[[start, y, z], [end, y, z]]])
        self._scene.add_line_segments(
            "/culvert/tape", np.concatenate([edge, ends]), colors=_TAPE, thickness=0.02 * size
        )

    def _label_place(self, x_m: float, *, on_crown: bool) -> Vector:
        section, size = self._section, self._section.scale_m
        if on_crown:
            return np.array([x_m, 0.0, section.axis_z_m - 0.9 * size])
        return np.array([x_m, section.half_width_m + 0.8 * size, section.radius_m or 0.0])


def _collar(radius_m: float) -> Mesh:
    return torus(1.05 * radius_m, 0.055 * radius_m)
