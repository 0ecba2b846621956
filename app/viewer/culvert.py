"""The culvert to scale: wall in segments, joints, their names, a measuring tape beside it."""

from __future__ import annotations

import math

import numpy as np
import viser
from numpy.typing import NDArray

from app.viewer.geometry import Mesh, Section, Vector, plank, torus, tube
from app.viewer.views import CameraMode, Reach

MAX_SEGMENTS = 2000
MAX_LABELS = 14

_WALL = np.array([150.0, 152.0, 150.0])
_JOINT = (44, 49, 54)
_COLLAR = (128, 142, 154)
_TAPE = (120, 140, 155)

_NO_TURN = (1.0, 0.0, 0.0, 0.0)

_BEHIND = 0.008
"""The plain wall lies so many scales behind the true one, where the pictures of it are, and its
joints half of that: what was seen hides what is only drawn."""


Colors = NDArray[np.uint8] | tuple[int, int, int]


class Culvert:
    """Draws a culvert that grows in whole segments; only its labels add scene nodes."""

    def __init__(
        self, scene: viser.SceneApi, section: Section, segment_length_m: float | None
    ) -> None:
        self._scene = scene
        self._section = section
        self._has_joints = segment_length_m is not None
        self._segment_m = segment_length_m or 1.0
        self._first = 0
        self._last = 0  # segments first..last-1 are drawn
        self._labels: dict[int, viser.LabelHandle] = {}
        self.grow_to(self._segment_m)

    @property
    def reach_m(self) -> tuple[float, float]:
        """First and last metre drawn."""
        return self._first * self._segment_m, self._last * self._segment_m

    def grow_to(self, x_m: float) -> None:
        """Draw whole segments so far that `x_m` lies within or at the end."""
        place = x_m / self._segment_m
        first = max(min(self._first, math.floor(place + 1e-6)), -MAX_SEGMENTS)
        last = min(max(self._last, math.ceil(place - 1e-6)), MAX_SEGMENTS)
        if (first, last) != (self._first, self._last):
            self._first, self._last = first, last
            self._draw()

    def label(self, stretch_m: Reach, mode: CameraMode) -> None:
        """Name the joints, or the metres where joints are not known, in this part of the culvert.

        Of very many only every n-th is named.  Names stand at the tape, or at the crown for an
        observer inside.
        """
        start, end = (x / self._segment_m for x in stretch_m)
        first, last = max(self._first, math.ceil(start)), min(self._last, math.floor(end))
        every = math.ceil((last - first + 1) / MAX_LABELS)
        wanted = {k for k in range(first, last + 1) if k % every == 0}
        for k in wanted - set(self._labels):
            self._labels[k] = self._add_label(k)
        for k, handle in self._labels.items():
            handle.visible = k in wanted
            handle.position = self._label_place(k, on_crown=mode == "inside")

    def _draw(self) -> None:
        numbers = np.arange(self._first, self._last)
        # Neighbours differ a little, so that segments can be told apart.
        wall = np.where(numbers[:, None] % 2, _WALL, 0.84 * _WALL).astype(np.uint8)
        starts = numbers * self._segment_m
        joints = np.arange(self._first, self._last + 1) * self._segment_m
        size = self._section.scale_m
        if self._section.radius_m is None:
            floor = plank(self._segment_m, self._section.half_width_m)
            self._repeat("wall", floor, starts, wall, lower_m=_BEHIND * size)
            if self._has_joints:
                gap = plank(0.03 * size, self._section.half_width_m)
                self._repeat(
                    "joints", gap, joints - 0.015 * size, _JOINT, lower_m=_BEHIND / 2 * size
                )
        else:
            radius = self._section.radius_m
            # One-sided walls: closed from inside, open towards an observer outside.
            pipe = tube((1 + _BEHIND) * radius, self._segment_m, inward=True)
            self._repeat("wall", pipe, starts, wall)
            if self._has_joints:
                gap = tube((1 + _BEHIND / 2) * radius, 0.04 * radius, inward=True)
                self._repeat("joints", gap, joints - 0.02 * radius, _JOINT)
            collars = joints if self._has_joints else joints[[0, -1]]
            self._repeat("collars", torus(1.05 * radius, 0.055 * radius), collars, _COLLAR)
        self._draw_tape()

    def _repeat(
        self,
        name: str,
        mesh: Mesh,
        xs_m: np.ndarray,
        colors: Colors,
        *,
        lower_m: float = 0.0,
    ) -> None:
        positions = np.zeros((len(xs_m), 3))
        positions[:, 0] = xs_m
        positions[:, 2] = lower_m
        self._scene.add_batched_meshes_simple(
            f"/culvert/{name}",
            mesh.vertices,
            mesh.faces,
            batched_wxyzs=np.tile(_NO_TURN, (len(xs_m), 1)),
            batched_positions=positions,
            batched_colors=colors,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _draw_tape(self) -> None:
        """Beside the wall on the right: a tick every 0.1 m, a longer one every metre."""
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

    def _add_label(self, k: int) -> viser.LabelHandle:
        distance = f"{k * self._segment_m:.2f} m"
        text = f"joint {k} · {distance}" if self._has_joints and k != 0 else distance
        return self._scene.add_label(f"/culvert/labels/{k}", text, anchor="top-center")

    def _label_place(self, k: int, *, on_crown: bool) -> Vector:
        section, size = self._section, self._section.scale_m
        x_m = k * self._segment_m
        if on_crown:
            return np.array([x_m, 0.0, section.axis_z_m - 0.9 * size])
        return np.array([x_m, section.half_width_m + 0.8 * size, section.radius_m or 0.0])
